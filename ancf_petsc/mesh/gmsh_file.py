"""Gmsh's files (.msh 1 to 4.1, text and binary), read by Gmsh itself, in a process of its own.

Two things Gmsh loses in files older than version 4 are kept here: which elements of one entity are in which
physical group (the two tags are swapped, so that its entities are the physical groups), and nodes no element
uses.
"""

from __future__ import annotations

import mmap
import re
from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ancf_petsc.mesh.foreign.process import CURES, contents
from ancf_petsc.mesh.kinds import BY_GMSH
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.raw import Block, RawMesh, mesh_error
from ancf_petsc.mesh.text import decoded

CURE = CURES["gmsh"]

Names = dict[tuple[int, int], str]


class Header(NamedTuple):
    """What $MeshFormat says; `order` is the byte order of binary numbers."""

    version: float
    binary: bool
    order: str


def read_gmsh(path: Path) -> RawMesh:
    """The mesh in a .msh file."""
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        header = _checked_header(data, path)
        notes: list[str] = []
        names = _physical_names(data, notes)
        old = header.version < 4
        found = contents(path, "gmsh", str(int(old)))
        numbers, coordinates = found["nodes"]
        numbers, points = numbers.astype(np.int64), coordinates.reshape(-1, 3)
        if old:
            numbers, points = _with_lost_nodes(data, header, numbers, points, path)
        announced = _announced(data, header)
    blocks = _blocks(found, names, old=old)
    read = sum(len(block.numbers) for block in blocks)
    if announced is not None and read < announced:
        raise mesh_error(path)(
            f"Gmsh reads {read} of the {announced} elements that $Elements announces", cure=CURE
        )
    groups = [*names.values(), *(name for block in blocks for name in block.names)]
    return RawMesh(numbers, points, blocks, list(dict.fromkeys(groups)), notes=notes)


def _checked_header(data: mmap.mmap, path: Path) -> Header:
    """The header of a file whose sections are whole; an error where one is missing or unfinished."""
    wrong = mesh_error(path)
    start = re.match(
        rb"\s*(?:\$Comments.*?\$EndComments\s*)?\$(MeshFormat|NOD)\s*?\n(.*?)\n", data, re.DOTALL
    )
    if start is None:
        raise wrong(
            "not a Gmsh mesh: it does not begin with $MeshFormat", cure="write it again as .msh 2.2 or 4.1"
        )
    for section, old in ((b"Nodes", b"NOD"), (b"Elements", b"ELM")):
        parametric = section == b"Nodes" and data.find(b"$ParametricNodes") >= 0
        begun = parametric or data.find(b"$" + section) >= 0 or data.find(b"$" + old) >= 0
        endings = (b"$End" + section, b"$END" + old, b"$EndParametric" + section)
        ended = any(data.find(ending) >= 0 for ending in endings)
        if not (begun and ended):
            state = "is not finished" if begun else "is missing"
            raise wrong(f"the section ${section.decode()} {state}", cure=CURE)
    if not re.search(rb"\$End\w+\s*\Z", data[-200:], re.IGNORECASE):
        raise wrong("the file ends inside a section", cure=CURE)
    if start[1] == b"NOD":
        return Header(1, binary=False, order="<")
    line = start[2].decode("latin-1").strip()
    header = re.fullmatch(r"(\d+(?:\.\d+)?)\s+([01])\s+\d+", line)
    if header is None:
        raise wrong("the line after $MeshFormat", got=line, expected="like 4.1 0 8", cure=CURE)
    return Header(float(header[1]), header[2] == "1", "<" if data[start.end()] == 1 else ">")


def _physical_names(data: mmap.mmap, notes: list[str]) -> Names:
    """(dimension, tag) -> name, in the order of the file."""
    section = re.search(rb"\$PhysicalNames\s(.*?)\$EndPhysicalNames", data, re.DOTALL)
    lines = decoded(section[1], notes) if section else ""
    entries = re.findall(r'\b([0-9]{1,9})\s+(-?[0-9]{1,18})\s+"([^"\n]*)"', lines)
    return {(int(dimension), abs(int(tag))): name for dimension, tag, name in entries}


def _announced(data: mmap.mmap, header: Header) -> int | None:
    """How many elements the section begins with; None where it does not begin with numbers."""
    start = re.search(rb"\$(?:Elements|ELM)[ \t]*\r?\n", data)
    if start is None:
        return None
    if header.version >= 4 and header.binary:
        return int(np.frombuffer(data[start.end() + 8 : start.end() + 16], header.order + "u8")[0])
    words = data[start.end() : start.end() + 200].split()
    place = 1 if header.version >= 4 else 0
    return (
        int(words[place])
        if len(words) > place and len(words[place]) < 19 and words[place].isdigit()
        else None
    )


def _blocks(found: dict[str, Any], names: Names, *, old: bool) -> list[Block]:
    """Cells by entity and kind, mid-nodes in meshio's order."""
    membership: dict[tuple[int, int], list[str]] = defaultdict(list)
    for dimension, tag, entities in found["groups"] if not old else ():
        for entity in entities:
            membership[dimension, abs(entity)].append(_name(names, dimension, tag))
    blocks = []
    for dimension, entity, number, title, cells, nodes in found["elements"]:
        physical = [_name(names, dimension, abs(entity))] if entity else []
        groups = physical if old else membership[dimension, abs(entity)]
        kind = BY_GMSH.get(number)
        nodes = nodes.astype(np.int64).reshape(len(cells), -1)
        if kind and kind.gmsh_order:
            nodes = nodes[:, kind.gmsh_order]
        name = kind.name if kind else title
        blocks.append(Block(name, cells.astype(np.int64), nodes, tuple(dict.fromkeys(groups))))
    return blocks


def _name(names: Names, dimension: int, tag: int) -> str:
    return names.get((dimension, tag)) or f"physical_{dimension}_{tag}"


def _with_lost_nodes(
    data: mmap.mmap, header: Header, numbers: Integers, points: Floats, path: Path
) -> tuple[Integers, Floats]:
    """All nodes of an old file: Gmsh forgets those no element uses."""
    wrong = mesh_error(path)
    start = re.search(rb"\$(?:Nodes|NOD)\s*?\n\s*(\d{1,18})[^\n]*\n", data)
    if start is None:
        raise wrong("the section $Nodes does not begin with a number", cure=CURE)
    count = int(start[1])
    if count == len(numbers):
        return numbers, points
    if header.binary:
        row = np.dtype([("number", header.order + "i4"), ("point", header.order + "f8", 3)])
        table = np.frombuffer(data[start.end() : start.end() + count * row.itemsize], dtype=row)
        every, places = table["number"].astype(np.int64), table["point"].astype(float)
    else:
        lines = data[start.end() : data.find(b"$", start.end())].decode("latin-1")
        values = np.fromstring(lines, sep=" ")
        if len(values) != 4 * count:
            raise wrong(f"the section $Nodes holds {len(values) / 4:g} of {count} nodes", cure=CURE)
        every, places = values.reshape(-1, 4)[:, 0].astype(np.int64), values.reshape(-1, 4)[:, 1:]
    if len(np.unique(every)) < count:
        raise wrong("a node number is given twice", cure=CURE)
    return every, places
