"""Ways to damage a file: bytes, words and lines of text, data sets of HDF5 and netCDF, what stands beside it on the disk.

Each is a function of the input's folder, its main file and a random.Random that changes the folder; WAYS has them by kind.
"""

from __future__ import annotations

import os
import re
import zlib
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
HUGE = (2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63 - 1, 10**9, 10**12, 0, 1)
FOREIGN = (
    "*TIE, NAME=a\nb, c", "*NGEN\n1, 1000000000, 1", "*NODE\n1, 1, 2", "*ELEMENT, TYPE=XYZ\n1, 2", "*NSET, NSET=z, GENERATE\n1, 1000000000000, 1",
    "*ELGEN\n11, 1000000, 1, 1, 1000000, 1, 1", "*NCOPY, CHANGE NUMBER=1000000000000, OLD SET=bottom, NEW SET=q, SHIFT\n0,0,1\n0,0,0,0,0,1,0",
    "*NFILL, NSET=g\nbottom, top, 1000000000, 1", "*ELSET, ELSET=r, GENERATE\n1, 9223372036854775807, 1", "*SYSTEM\n0,0,0,0,0,0", "*END PART", "*PART, NAME=p",
    "*SURFACE, NAME=s\nlower, S9", "*INSTANCE, NAME=i, PART=none\n*END INSTANCE", "*NSET, NSET=loop\nloop", "*NMAP", "*INCLUDE", "*", "**", "*,,,=,",
    "GRID,1,9,nan,0.,0.", "SET1,9,1,THRU,99999999", "SET1,9,1,THRU,999999999999", "SET3,9,ELEM,1,THRU,2000000000,BY,1", "CORD2R,5,5,0.,0.,0.,0.,0.,1.\n,1.,0.,0.",
    "CORD1R,6,1,1,1", "GRDSET,,77", "RBE2,1,2,3", "CTETRA,9,9,1,1,1,1", "CTRIAX6,1,1,1,2,3", "INCLUDE", "ENDDATA", "BEGIN BULK", "+,,,", "*,,,", "GRID*", "$",
    "$Nodes\n1000000000\n1 0 0 0\n$EndNodes", "$Elements\n2\n1 4 2 1 1 1 2 3 4\n$EndElements", "$PhysicalNames\n1\n3 1 \"a\n$EndPhysicalNames", "$NodeData\n1", "$Comments\nx",
    "$Entities\n9999999999 1 1 1\n$EndEntities", "$Partitioned", "<DataArray/>", "]]>", "&amp;&lt;", "\\x00", "CELLS 1000000000 5000000000", "POINTS 1000000000 double",
    "FIELD x 99999999", "LOOKUP_TABLE q 1000000000", "Vertices\n1000000000", "Tetrahedra\n-5", "End",
)  # fmt: skip
"""Lines of some format, in any other too."""


def _bytes(change: Callable[[bytearray, Random], bytearray | None]) -> Damage:
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
    return _bytes(edit)


@_bytes
def truncated(data: bytearray, random: Random) -> bytearray:
    return data[: random.randrange(len(data) + 1)]


@_bytes
def flipped_bit(data: bytearray, random: Random) -> None:
    for _ in range(random.choice((1, 1, 1, 2, 5, 20))):
        if data:
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)


@_bytes
def other_bytes(data: bytearray, random: Random) -> None:
    at = random.randrange(len(data) + 1)
    size = random.choice((1, 2, 4, 8, 16, 100))
    filler = random.choice((b"\0", b"\xff", b"\x7f", b" ", b"\n", b"9", b'"', b"<", None))
    data[at : at + size] = filler * size if filler else random.randbytes(size)


@_bytes
def huge_integer(data: bytearray, random: Random) -> None:
    size = random.choice((4, 8))
    at = random.randrange(max(1, len(data) // 4)) * 4
    value = random.choice((*HUGE, -1)) % 2 ** (8 * size)
    data[at : at + size] = value.to_bytes(size, random.choice(("little", "big")))


@_bytes
def removed_bytes(data: bytearray, random: Random) -> None:
    at = random.randrange(len(data) + 1)
    del data[at : at + random.choice((1, 2, 4, 7, 50, 300))]


@_bytes
def repeated_bytes(data: bytearray, random: Random) -> None:
    at, size = random.randrange(len(data) + 1), random.choice((1, 4, 40, 400, len(data)))
    data[at:at] = data[at : at + size] * random.choice((1, 1, 2, 50))


@_bytes
def moved_bytes(data: bytearray, random: Random) -> None:
    at, size, to = (
        random.randrange(len(data) + 1),
        random.choice((4, 40, 400)),
        random.randrange(len(data) + 1),
    )
    piece = data[at : at + size]
    del data[at : at + size]
    data[to:to] = piece


@_bytes
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


@_bytes
def other_number(data: bytearray, random: Random) -> bytearray:
    places = list(re.finditer(rb"[-+]?\d[\d.eE+-]*", data[:200_000]))
    for place in sorted(
        random.sample(places, min(len(places), random.choice((1, 1, 1, 2, 4)))), key=lambda m: -m.start()
    ):
        word = random.choice((*NUMBERS, str(random.choice(HUGE)), random.choice(places)[0].decode()))
        data[place.start() : place.end()] = word.encode()
    return data


@_bytes
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


@_bytes
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
    suffix = random.choice(
        (
            ".msh .inp .bdf .nas .fem .e .exo .vtu .vtk .xdmf .med .mesh .meshb .ugrid .cgns .h5m .dat .post .vol .node .ele .off .stl .ply .obj .svg .wkt .xml .hmf .mdpa .avs .su2 .tec .f3grid .f3 .txt .h5 .vol.gz .dato.gz ."
        ).split()
    )
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


# --- XML ---------------------------------------------------------------------------------------------------------------


def _in_xml(change: Callable[[str, Random], str]) -> Damage:
    def edit(data: bytearray, random: Random) -> bytearray:
        return bytearray(change(data.decode("latin-1"), random).encode("latin-1", "replace"))

    edit.__name__ = change.__name__
    return _bytes(edit)


def _declared(text: str, declarations: str, use: str, random: Random) -> str:
    """Declare entities before the root element, and use one in the place of a number."""
    root = re.search(r"<[A-Za-z]+", text)
    if root is None:
        return text
    start = root.start()
    head = f"<!DOCTYPE {root[0][1:]} [{declarations}]>"
    numbers = list(re.finditer(r'(?<=[>" ])\d+(?=[<" ])', text[start:]))
    if numbers:
        place = random.choice(numbers)
        text = text[: start + place.start()] + use + text[start + place.end() :]
    return text[:start] + head + text[start:]


@_in_xml
def entity_bomb(text: str, random: Random) -> str:
    depth = random.choice((3, 6, 9, 12))
    lines = ['<!ENTITY e0 "1">'] + [f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, depth)]
    return _declared(text, "".join(lines), f"&e{depth - 1};", random)


@_in_xml
def external_entity(text: str, random: Random) -> str:
    target = random.choice(("/etc/passwd", "file:///etc/passwd", "../../secret.txt", "http://127.0.0.1:9/x"))
    way = random.choice((f'<!ENTITY x SYSTEM "{target}">', f'<!ENTITY % x SYSTEM "{target}"> %x;'))
    return _declared(text, way, "&x;", random)


@_in_xml
def large_entity(text: str, random: Random) -> str:
    return _declared(text, f'<!ENTITY x "{"1 " * 20_000}">', "&x;" * 2000, random)


@_in_xml
def deep_xml(text: str, random: Random) -> str:
    at = text.find(">", text.find("<VTKFile") if "<VTKFile" in text else 0) + 1
    depth = random.choice((50, 5_000, 50_000))
    return text[:at] + "<a>" * depth + ("</a>" * depth if random.random() < 0.7 else "") + text[at:]


@_in_xml
def included_xml(text: str, random: Random) -> str:
    at = text.rfind("</")
    target = random.choice(("/etc/passwd", "../../secret.txt", "self.xdmf"))
    return f'{text[:at]}<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="{target}" parse="text"/>{text[at:]}'


@_in_xml
def other_reference(text: str, random: Random) -> str:
    """Where XDMF looks for its numbers."""
    places = list(re.finditer(r">\s*([^<>\s]+\.(?:h5|bin)[^<>\s]*)\s*<", text))
    if not places:
        return text
    place = random.choice(places)
    target = random.choice(
        (
            "/etc/passwd",
            "../../secret.h5:/data0",
            "/dev/zero",
            "/dev/zero:/data0",
            "nowhere.h5:/data0",
            "hdf.h5",
            "hdf.h5:",
            "hdf.h5:/",
            "hdf.h5:/nothing",
            "a:b:c:d",
            ":",
            ".",
            "hdf.xdmf:/data0",
            "hdf.h5:/data0/..",
            "http://127.0.0.1:9/a.h5:/x",
            "~/x.h5:/y",
        )
    )
    return text[: place.start(1)] + target + text[place.end(1) :]


@_bytes
def compressed_bomb(data: bytearray, random: Random) -> bytearray:
    """A block of VTU that unpacks to a thousand times its size."""
    import base64
    import struct

    places = list(re.finditer(rb">\s*([A-Za-z0-9+/=]{20,})\s*<", data))
    if not places:
        return data
    place = random.choice(places)
    size = random.choice((10**6, 5 * 10**7, 2 * 10**8))
    packed = zlib.compress(bytes(size), 9)
    count = random.choice((1, 1, 1, 2**31))
    head = struct.pack("<IIII", count, size, 0 if count == 1 else size, len(packed))
    data[place.start(1) : place.end(1)] = base64.b64encode(head) + base64.b64encode(packed)
    return data


# --- decks -------------------------------------------------------------------------------------------------------------


def included(folder: Path, main: Path, random: Random) -> None:
    """Decks that include themselves, each other, devices, folders, long chains."""
    line = "*INCLUDE, INPUT={}" if main.suffix == ".inp" else "INCLUDE '{}'"
    targets = (
        main.name,
        "/dev/zero",
        ".",
        "nowhere.inp",
        "pipe.inp",
        "link.inp",
        "chain0.inp",
        "wide0.inp",
        "/etc/passwd",
        "a" * 5000,
        "../../secret.txt",
        "",
    )
    target = random.choice(targets)
    if target == "pipe.inp":
        os.mkfifo(folder / target)
    elif target == "link.inp":
        (folder / target).symlink_to("/dev/zero")
    elif target == "chain0.inp":
        for k in range(1500):
            (folder / f"chain{k}.inp").write_text(line.format(f"chain{k + 1}.inp") + "\n")
    elif target == "wide0.inp":  # each includes the next ten times
        for k in range(9):
            (folder / f"wide{k}.inp").write_text((line.format(f"wide{k + 1}.inp") + "\n") * 10)
        (folder / "wide9.inp").write_text("** nothing\n" * 50)
    lines = main.read_bytes().split(b"\n")
    at = random.randrange(len(lines))
    main.write_bytes(b"\n".join([*lines[:at], line.format(target).encode(), *lines[at:]]))


def deep_deck(folder: Path, main: Path, random: Random) -> None:
    """Long chains of what refers to each other: coordinate systems, sets of sets."""
    del folder
    depth = random.choice((20, 900, 5000))
    if main.suffix == ".inp":
        sets = [f"*NSET, NSET=n{k}\nn{k + 1}" for k in range(depth)] + [f"*NSET, NSET=n{depth}\n7, 10"]
        if random.random() < 0.3:
            sets[-1] = f"*NSET, NSET=n{depth}\nn0"
        text = "\n".join(sets if random.random() < 0.5 else sets[::-1])
        main.write_bytes(main.read_bytes() + b"\n" + text.encode() + b"\n")
        return
    chain = [f"CORD2R,{k},{k + 1},0.,0.,0.,0.,0.,1.\n,1.,0.,0." for k in range(10, 10 + depth)]
    chain.append(f"CORD2R,{10 + depth},{random.choice((0, 10))},0.,0.,0.,0.,0.,1.\n,1.,0.,0.")
    text = "\n".join([*chain, "GRID,999,10,0.,0.,0."])
    data = main.read_bytes().replace(b"ENDDATA", b"")
    main.write_bytes(data + b"\n" + text.encode() + b"\nENDDATA\n")


BYTES: tuple[Damage, ...] = (
    truncated, flipped_bit, flipped_bit, other_bytes, huge_integer, removed_bytes, repeated_bytes, moved_bytes, empty, other_suffix, special_file,
)  # fmt: skip
TEXT: tuple[Damage, ...] = (
    other_number, other_number, other_number, other_word, removed_lines, repeated_lines, swapped_lines, foreign_lines, foreign_lines, long_line, other_encoding,
)  # fmt: skip
XML: tuple[Damage, ...] = (entity_bomb, external_entity, large_entity, deep_xml, included_xml)


def ways(kind: str) -> tuple[Damage, ...]:
    """All that fits a kind of file."""
    from fuzzing.datasets import HDF5, NETCDF

    more: dict[str, tuple[Damage, ...]] = {
        "msh_text": TEXT, "inp": (*TEXT, included, deep_deck), "bdf": (*TEXT, included, deep_deck), "vtu": (*TEXT, *XML, compressed_bomb),
        "vtk": TEXT, "xdmf": (*TEXT, *XML, other_reference, missing_companion, *HDF5), "med": HDF5, "medit": TEXT,
        "exodus": (*NETCDF, *HDF5), "other": (*TEXT, *HDF5, missing_companion, deep_xml, entity_bomb), "msh_binary": (other_number, foreign_lines),
        "results": (*TEXT, *HDF5, *HDF5, missing_companion),
    }  # fmt: skip
    return BYTES + more[kind]
