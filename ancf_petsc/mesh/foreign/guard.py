"""What a file may not hold: XML with entities, names of files elsewhere, HDF5 that leads out of the file or is not there.

Libraries would follow such links to any file of the user's, or take memory without end.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

XML = (".vtu", ".xdmf", ".xmf", ".xml", ".svg")
XDMF = (".xdmf", ".xmf")
EMPTY, RATIO = 64 * 2**20, 2000
"""Bytes of a data set that need no place in its file, and times its place there that it may have unpacked: gzip reaches 1032."""


class Refused(Exception):
    """Why a file is not read, in words."""


class _Enough(Exception):
    """The root element has begun: no declarations follow."""


def check(path: Path) -> int:
    """Look a file through before a library reads it; the bytes of all files that belong to it. Raises Refused, OSError."""
    files = [path]
    if path.suffix.lower() in XML:
        files += _data_files(path)
    for file in files:
        with open(file, "rb") as opened:
            signed = any(_signed(opened, at) for at in (0, 512, 1024, 2048, 4096))
        if signed:
            check_hdf5(file)
    return sum(file.stat().st_size for file in files)


def _signed(opened: Any, at: int) -> bool:
    opened.seek(at)
    return opened.read(8) == b"\x89HDF\r\n\x1a\n"


def _data_files(path: Path) -> list[Path]:
    """The files that hold the numbers of an XDMF file, beside it; of other XML none, only its declarations are looked at."""
    whole = path.suffix.lower() in XDMF
    parser = expat.ParserCreate()
    found: dict[str, None] = {}
    text: list[str] = []

    def entity(*given: Any) -> NoReturn:
        raise Refused(f"it declares the entity {given[0]!r}: entities are not expanded")

    def start(name: str, attributes: dict[str, str]) -> None:
        if not whole:
            raise _Enough
        text.clear()
        outside = name == "DataItem" and attributes.get("Format", "").upper() in ("HDF", "BINARY")
        parser.CharacterDataHandler = text.append if outside else None

    def end(name: str) -> None:
        if parser.CharacterDataHandler:
            found["".join(text).strip().partition(":")[0]] = None
            parser.CharacterDataHandler = None

    parser.EntityDeclHandler = entity
    parser.StartElementHandler, parser.EndElementHandler = start, end
    try:
        with open(path, "rb") as file:
            parser.ParseFile(file)
    except _Enough:
        return []
    except expat.ExpatError as error:
        if whole:
            raise Refused(f"it is not XML: {error}") from None
    return [_beside(path, name) for name in found]


def _beside(path: Path, name: str) -> Path:
    """A file in the folder of another or below it. Raises Refused."""
    place = Path(name)
    if not name or place.is_absolute() or ".." in place.parts or name.startswith("~"):
        raise Refused(f"it names a data file that is not beside it: {name!r}")
    file = path.parent / place
    if not os.path.isfile(file):
        raise Refused(f"its data file {name!r} is missing")
    return file


def check_hdf5(path: Path) -> None:
    """Walk through a file of HDF5. Raises Refused for what leads out of it and for data sets that are not there."""
    import h5py

    with h5py.File(path, "r") as file:
        seen: set[int] = set()
        groups = [file["/"]]
        while groups:
            group = groups.pop()
            for name in group:
                link = group.get(name, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    raise Refused(f"{group.name.rstrip('/')}/{name} is a link to the file {link.filename!r}")
                one = group.get(name) if isinstance(link, h5py.HardLink) else None
                if isinstance(one, h5py.Group):
                    if (address := h5py.h5o.get_info(one.id).addr) not in seen:
                        seen.add(address)
                        groups.append(one)
                elif isinstance(one, h5py.Dataset):
                    check_dataset(one)


def check_dataset(data: Any) -> None:
    """Raises Refused for a data set whose numbers are in other files or not there."""
    if data.external or data.is_virtual:
        raise Refused(f"{data.name} has its numbers in another file")
    stored = data.id.get_storage_size()
    if data.size and data.size * data.dtype.itemsize > EMPTY + RATIO * stored:
        shape = " x ".join(map(str, data.shape))
        raise Refused(f"{data.name} is announced with {shape} numbers, and {stored} bytes are there")


def one_line(error: BaseException) -> str:
    """An exception in words."""
    return re.sub(r"\s+", " ", f"{type(error).__name__}: {error}").strip()
