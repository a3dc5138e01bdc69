"""Damage of what has a structure: XML with entities and links, packed data, decks that include and refer to each other."""

from __future__ import annotations

import base64
import os
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random

from fuzzing.damage import Damage, in_bytes


def _in_xml(change: Callable[[str, Random], str]) -> Damage:
    def edit(data: bytearray, random: Random) -> bytearray:
        return bytearray(change(data.decode("latin-1"), random).encode("latin-1", "replace"))

    edit.__name__ = change.__name__
    return in_bytes(edit)


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


@in_bytes
def compressed_bomb(data: bytearray, random: Random) -> bytearray:
    """A block of VTU that unpacks to a thousand times its size."""
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


XML: tuple[Damage, ...] = (entity_bomb, external_entity, large_entity, deep_xml, included_xml)
