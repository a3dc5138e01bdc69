"""Ways to damage a file: bytes, words and lines of text, data sets of HDF5 and netCDF, what stands beside it on the disk.

Each is a function of the input's folder, its main file and a random.Random that changes the folder; WAYS has them by kind.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from random import Random

Damage = Callable[[Path, Path, Random], None]

NUMBERS = (
    "nan", "inf", "-inf", "NaN", "-1", "0", "-0.0", "1e400", "1e-400", "1e308", "99999999999999999999", "2147483648",
    "-2147483648", "9223372036854775807", "18446744073709551615", "1000000000", "1e15", "0x10", "1_000", "1,5", "--3",
    "+", ".", "1.5", "3.0000000001", "1d5", "\u0663", "1e", "", "abc", "*", "1" * 400,
)  # fmt: skip
"""What stands in the place of a number."""
RENAMED = "renamed.txt"
"""Beside the input's folder: the main file's new name."""
SUFFIXES = (
    ".msh", ".inp", ".bdf", ".nas", ".fem", ".e", ".exo", ".vtu", ".vtk", ".xdmf", ".med", ".mesh",
    ".meshb", ".ugrid", ".cgns", ".h5m", ".dat", ".post", ".vol", ".node", ".ele", ".off", ".stl",
    ".ply", ".obj", ".svg", ".wkt", ".xml", ".hmf", ".mdpa", ".avs", ".su2", ".tec", ".f3grid", ".f3",
    ".txt", ".h5", ".vol.gz", ".dato.gz", ".",
)  # fmt: skip
HUGE = (2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63 - 1, 10**9, 10**12, 0, 1)
FOREIGN = (
    "*TIE, NAME=a\nb, c", "*NGEN\n1, 1000000000, 1", "*NODE\n1, 1, 2", "*ELEMENT, TYPE=XYZ\n1, 2",
    "*NSET, NSET=z, GENERATE\n1, 1000000000000, 1",
    "*ELGEN\n11, 1000000, 1, 1, 1000000, 1, 1",
    "*NCOPY, CHANGE NUMBER=1000000000000, OLD SET=bottom, NEW SET=q, SHIFT\n0,0,1\n0,0,0,0,0,1,0",
    "*NFILL, NSET=g\nbottom, top, 1000000000, 1", "*ELSET, ELSET=r, GENERATE\n1, 9223372036854775807, 1",
    "*SYSTEM\n0,0,0,0,0,0", "*END PART", "*PART, NAME=p",
    "*SURFACE, NAME=s\nlower, S9", "*INSTANCE, NAME=i, PART=none\n*END INSTANCE", "*NSET, NSET=loop\nloop", "*NMAP",
    "*INCLUDE", "*", "**", "*,,,=,",
    "GRID,1,9,nan,0.,0.", "SET1,9,1,THRU,99999999", "SET1,9,1,THRU,999999999999", "SET3,9,ELEM,1,THRU,2000000000,BY,1",
    "CORD2R,5,5,0.,0.,0.,0.,0.,1.\n,1.,0.,0.",
    "CORD1R,6,1,1,1", "GRDSET,,77", "RBE2,1,2,3", "CTETRA,9,9,1,1,1,1", "CTRIAX6,1,1,1,2,3", "INCLUDE", "ENDDATA",
    "BEGIN BULK", "+,,,", "*,,,", "GRID*", "$",
    "$Nodes\n1000000000\n1 0 0 0\n$EndNodes", "$Elements\n2\n1 4 2 1 1 1 2 3 4\n$EndElements",
    "$PhysicalNames\n1\n3 1 \"a\n$EndPhysicalNames", "$NodeData\n1", "$Comments\nx",
    "$Entities\n9999999999 1 1 1\n$EndEntities", "$Partitioned", "<DataArray/>", "]]>", "&amp;&lt;", "\\x00",
    "CELLS 1000000000 5000000000", "POINTS 1000000000 double",
    "FIELD x 99999999", "LOOKUP_TABLE q 1000000000", "Vertices\n1000000000", "Tetrahedra\n-5", "End",
)  # fmt: skip
"""Lines of some format, in any other too."""


def in_bytes(change: Callable[[bytearray, Random], bytearray | None]) -> Damage:
    """A damage of the main file's bytes, or of those of a file beside it."""

    def apply(folder: Path, main: Path, random: Random) -> None:
        files = sorted(path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
        if not files:
            return
        file = main if random.random() < 0.7 and main in files else random.choice(files)
        data = bytearray(file.read_bytes())
        changed = change(data, random)
        file.write_bytes(data if changed is None else changed)

    apply.__name__ = change.__name__.strip("_")
    return apply


def _lines(change: Callable[[list[str], Random], list[str]]) -> Damage:
    """A damage of lines."""

    def edit(data: bytearray, random: Random) -> bytearray:
        return bytearray(
            "\n".join(change(data.decode("latin-1").split("\n"), random)).encode("latin-1", "replace")
        )

    edit.__name__ = change.__name__
    return in_bytes(edit)


@in_bytes
def truncated(data: bytearray, random: Random) -> bytearray:
    return data[: random.randrange(len(data) + 1)]


@in_bytes
def flipped_bit(data: bytearray, random: Random) -> None:
    for _ in range(random.choice((1, 1, 1, 2, 5, 20))):
        if data:
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)


@in_bytes
def other_bytes(data: bytearray, random: Random) -> None:
    at = random.randrange(len(data) + 1)
    size = random.choice((1, 2, 4, 8, 16, 100))
    filler = random.choice((b"\0", b"\xff", b"\x7f", b" ", b"\n", b"9", b'"', b"<", None))
    data[at : at + size] = filler * size if filler else random.randbytes(size)


@in_bytes
def huge_integer(data: bytearray, random: Random) -> None:
    size = random.choice((4, 8))
    at = random.randrange(max(1, len(data) // 4)) * 4
    value = random.choice((*HUGE, -1)) % 2 ** (8 * size)
    data[at : at + size] = value.to_bytes(size, random.choice(("little", "big")))


@in_bytes
def removed_bytes(data: bytearray, random: Random) -> None:
    at = random.randrange(len(data) + 1)
    del data[at : at + random.choice((1, 2, 4, 7, 50, 300))]


@in_bytes
def repeated_bytes(data: bytearray, random: Random) -> None:
    at, size = random.randrange(len(data) + 1), random.choice((1, 4, 40, 400, len(data)))
    data[at:at] = data[at : at + size] * random.choice((1, 1, 2, 50))


@in_bytes
def moved_bytes(data: bytearray, random: Random) -> None:
    at, size, to = (
        random.randrange(len(data) + 1),
        random.choice((4, 40, 400)),
        random.randrange(len(data) + 1),
    )
    piece = data[at : at + size]
    del data[at : at + size]
    data[to:to] = piece


@in_bytes
def other_encoding(data: bytearray, random: Random) -> bytearray:
    text = data.decode("latin-1")
    way = random.choice(
        ("utf-16", "utf-16-le", "utf-32", "bom", "nul", "cr", "crlf", "latin", "surrogate", "bytes")
    )
    if way in ("cr", "crlf"):
        return bytearray(data.replace(b"\n", b"\r" if way == "cr" else b"\r\n"))
    if way in ("nul", "latin", "surrogate", "bytes", "bom"):
        piece = {
            "nul": b"\0",
            "latin": b"\xe9",
            "surrogate": b"\xed\xa0\x80",
            "bytes": b"\xff\xfe\xc0",
            "bom": b"\xef\xbb\xbf",
        }[way]
        at = 0 if way == "bom" else random.randrange(len(data) + 1)
        return data[:at] + piece + data[at:]
    return bytearray(text.encode(way))


@in_bytes
def other_number(data: bytearray, random: Random) -> bytearray:
    places = list(re.finditer(rb"[-+]?\d[\d.eE+-]*", data[:200_000]))
    for place in sorted(
        random.sample(places, min(len(places), random.choice((1, 1, 1, 2, 4)))), key=lambda m: -m.start()
    ):
        word = random.choice((*NUMBERS, str(random.choice(HUGE)), random.choice(places)[0].decode()))
        data[place.start() : place.end()] = word.encode()
    return data


@in_bytes
def other_word(data: bytearray, random: Random) -> bytearray:
    """A word in the place of another of the same file."""
    places = list(re.finditer(rb"[A-Za-z_$*][\w:-]*", data[:200_000]))
    if places:
        one, other = random.choice(places), random.choice(places)[0]
        word = random.choice(
            (other, one[0].upper(), one[0].lower(), one[0] * 200, b"", b"a b", b"%s%n{0}", b"../../x")
        )
        data[one.start() : one.end()] = word
    return data


@_lines
def removed_lines(lines: list[str], random: Random) -> list[str]:
    at = random.randrange(len(lines))
    return lines[:at] + lines[at + random.choice((1, 1, 2, 10)) :]


@_lines
def repeated_lines(lines: list[str], random: Random) -> list[str]:
    at, size = random.randrange(len(lines)), random.choice((1, 1, 3, 10, 40))
    to = random.randrange(len(lines) + 1)
    return lines[:to] + lines[at : at + size] * random.choice((1, 1, 2, 200)) + lines[to:]


@_lines
def swapped_lines(lines: list[str], random: Random) -> list[str]:
    a, b = random.randrange(len(lines)), random.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return lines


@_lines
def foreign_lines(lines: list[str], random: Random) -> list[str]:
    at = random.randrange(len(lines) + 1)
    return [*lines[:at], *random.choice(FOREIGN).split("\n"), *lines[at:]]


@_lines
def long_line(lines: list[str], random: Random) -> list[str]:
    at = random.randrange(len(lines))
    lines[at] += random.choice(("1 ", "a", ",", "(", '"', " ", "1, ")) * 50_000
    return lines


@in_bytes
def empty(data: bytearray, random: Random) -> bytearray:
    return bytearray(
        random.choice(
            (
                b"",
                b" ",
                b"\n\n\n",
                b"\0" * 100,
                b"\x1f\x8b\x08\0",
                b"PK\3\4",
                b"\x89HDF\r\n\x1a\n",
                b"CDF\1",
                b"$MeshFormat\n",
            )
        )
    )


def other_suffix(folder: Path, main: Path, random: Random) -> None:
    """The file of one format under the name of another; the name stays, the content changes place."""
    suffix = random.choice(SUFFIXES)
    renamed = main.with_name(main.name.split(".")[0] + suffix)
    main.rename(renamed)
    (folder.parent / RENAMED).write_text(renamed.name)


def special_file(folder: Path, main: Path, random: Random) -> None:
    """What the name leads to is no ordinary file."""
    way = random.choice(
        ("loop", "dangling", "folder", "pipe", "zero", "link", "unreadable", "null", "tty", "self")
    )
    moved = main.rename(folder / f"real{main.suffix}")
    if way == "pipe":
        os.mkfifo(main)
    elif way == "folder":
        main.mkdir()
    elif way == "unreadable":
        moved.rename(main)
        main.chmod(0)
    else:
        targets = {
            "loop": main.name,
            "dangling": "nowhere",
            "zero": "/dev/zero",
            "link": moved.name,
            "null": "/dev/null",
            "tty": "/dev/tty",
            "self": "/proc/self/mem",
        }
        main.symlink_to(targets[way])


def missing_companion(folder: Path, main: Path, random: Random) -> None:
    others = [path for path in folder.rglob("*") if path.is_file() and path != main]
    if others:
        random.choice(others).unlink()


BYTES: tuple[Damage, ...] = (
    truncated, flipped_bit, flipped_bit, other_bytes, huge_integer, removed_bytes, repeated_bytes, moved_bytes, empty,
    other_suffix, special_file,
)  # fmt: skip
TEXT: tuple[Damage, ...] = (
    other_number, other_number, other_number, other_word, removed_lines, repeated_lines, swapped_lines, foreign_lines,
    foreign_lines, long_line, other_encoding,
)  # fmt: skip


def ways(kind: str) -> tuple[Damage, ...]:
    """All that fits a kind of file."""
    from fuzzing.datasets import HDF5, NETCDF
    from fuzzing.structure import (
        XML,
        compressed_bomb,
        deep_deck,
        deep_xml,
        entity_bomb,
        included,
        other_reference,
    )

    more: dict[str, tuple[Damage, ...]] = {
        "msh_text": TEXT, "msh_binary": (other_number, foreign_lines), "medit": TEXT, "vtk": TEXT, "med": HDF5,
        "inp": (*TEXT, included, deep_deck), "bdf": (*TEXT, included, deep_deck), "exodus": (*NETCDF, *HDF5),
        "vtu": (*TEXT, *XML, compressed_bomb), "xdmf": (*TEXT, *XML, other_reference, missing_companion, *HDF5),
        "other": (*TEXT, *HDF5, missing_companion, deep_xml, entity_bomb),
        "results": (*TEXT, *HDF5, *HDF5, missing_companion),
    }  # fmt: skip
    return BYTES + more[kind]
