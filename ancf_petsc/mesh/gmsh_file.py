"""Gmsh's files (.msh 1 to 4.1, text and binary), read by Gmsh itself.

Gmsh is handed only files whose sections are whole. Two things it loses in files older than version 4 are
kept here: elements of one entity in different physical groups (the two tags are swapped, so that its
entities are the physical groups), and nodes no element uses.
"""

from __future__ import annotations

import mmap
import re
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ancf_petsc.mesh.kinds import BY_GMSH
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.raw import Block, RawMesh, mesh_error

CURE = "the file may be truncated or damaged: write it again"


class Header(NamedTuple):
    """What $MeshFormat says; `order` is the byte order of binary numbers."""

    version: float
    binary: bool
    order: str


@contextmanager
def gmsh_session(**options: float) -> Iterator[Any]:
    """The gmsh module with an empty model and silent; afterwards all is as it was before."""
    import gmsh

    running = gmsh.isInitialized()
    if not running:
        gmsh.initialize(interruptible=False, readConfigFiles=False)
    current = gmsh.model.getCurrent()
    wanted = {"General.Terminal": 0, **options}
    before = {name: gmsh.option.getNumber(name) for name in wanted}
    try:
        for name, value in wanted.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.add("ancf")
        yield gmsh
    finally:
        if running:
            gmsh.model.remove()
            gmsh.model.setCurrent(current)
            for name, value in before.items():
                gmsh.option.setNumber(name, value)
        else:
            gmsh.finalize()


def read_gmsh(path: Path) -> RawMesh:
    """The mesh in a .msh file."""
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        header = _checked_header(data, path)
        names = _physical_names(data)
        old = header.version < 4
        with gmsh_session(**{"Mesh.SwitchElementTags": float(old)}) as gmsh:
            _merge(gmsh, path)
            membership = _old_membership(gmsh, names) if old else _membership(gmsh, names)
            numbers, points = _nodes(gmsh)
            blocks = _blocks(gmsh, membership)
        if old:
            numbers, points = _with_lost_nodes(data, header, numbers, points, path)
    groups = [*names.values(), *(name for block in blocks for name in block.names)]
    return RawMesh(numbers, points, blocks, list(dict.fromkeys(groups)))


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
    for section, old in (("Nodes", "NOD"), ("Elements", "ELM")):
        begun = data.find(b"$%b" % section.encode()) >= 0 or data.find(b"$%b" % old.encode()) >= 0
        ended = data.find(b"$End%b" % section.encode()) >= 0 or data.find(b"$END%b" % old.encode()) >= 0
        if not (begun and ended):
            state = "is not finished" if begun else "is missing"
            raise wrong(f"the section ${section} {state}", cure=CURE)
    if not re.search(rb"\$End\w+\s*\Z", data[-200:], re.IGNORECASE):
        raise wrong("the file ends inside a section", cure=CURE)
    if start[1] == b"NOD":
        return Header(1, binary=False, order="<")
    header = re.fullmatch(r"(\d+(?:\.\d+)?)\s+([01])\s+\d+", start[2].decode("latin-1").strip())
    if header is None:
        raise wrong(
            "the line after $MeshFormat is none",
            got=start[2].decode("latin-1"),
            expected="like 4.1 0 8",
            cure=CURE,
        )
    return Header(float(header[1]), header[2] == "1", "<" if data[start.end()] == 1 else ">")


def _physical_names(data: mmap.mmap) -> dict[tuple[int, int], str]:
    """(dimension, tag) -> name, in the order of the file."""
    section = re.search(rb"\$PhysicalNames\s(.*?)\$EndPhysicalNames", data, re.DOTALL)
    entries = (
        re.findall(r'(\d+)\s+(-?\d+)\s+"([^"\n]*)"', section[1].decode("utf-8", "replace")) if section else []
    )
    return {(int(dimension), abs(int(tag))): name for dimension, tag, name in entries}


def _merge(gmsh: Any, path: Path) -> None:
    """Gmsh reads the file into its current model."""
    gmsh.logger.start()
    try:
        gmsh.merge(str(path))
    except Exception as error:
        said = [line.partition(": ")[2] for line in gmsh.logger.get() if line.startswith("Error")]
        reason = " ".join((said[-1] if said else str(error)).split())
        raise mesh_error(path)(f"Gmsh cannot read it ({reason or 'no reason given'})", cure=CURE) from None
    finally:
        gmsh.logger.stop()


def _name(names: dict[tuple[int, int], str], dimension: int, tag: int) -> str:
    return names.get((dimension, tag)) or f"physical_{dimension}_{tag}"


def _membership(gmsh: Any, names: dict[tuple[int, int], str]) -> dict[tuple[int, int], list[str]]:
    """(dimension, entity) -> names of the physical groups it is in."""
    groups = defaultdict(list)
    for dimension, tag in gmsh.model.getPhysicalGroups():
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
            groups[dimension, abs(int(entity))].append(_name(names, dimension, tag))
    return groups


def _old_membership(gmsh: Any, names: dict[tuple[int, int], str]) -> dict[tuple[int, int], list[str]]:
    """The same where physical groups were read as entities; 0 is none."""
    entities = [(dimension, abs(tag)) for dimension, tag in gmsh.model.getEntities()]
    return {entity: [_name(names, *entity)] for entity in entities if entity[1]}


def _nodes(gmsh: Any) -> tuple[Integers, Floats]:
    numbers, coordinates, _ = gmsh.model.mesh.getNodes()
    return numbers.astype(np.int64), coordinates.reshape(-1, 3)


def _blocks(gmsh: Any, membership: dict[tuple[int, int], list[str]]) -> list[Block]:
    """Cells by entity and kind, mid-nodes in meshio's order."""
    blocks = []
    for dimension, entity in gmsh.model.getEntities():
        names = tuple(dict.fromkeys(membership.get((dimension, abs(entity)), ())))
        kinds, numbers, nodes = gmsh.model.mesh.getElements(dimension, entity)
        for kind, cells, corners in zip(kinds, numbers, nodes, strict=True):
            corners = corners.astype(np.int64).reshape(len(cells), -1)
            known = BY_GMSH.get(kind)
            if known and known.gmsh_order:
                corners = corners[:, known.gmsh_order]
            name = known.name if known else gmsh.model.mesh.getElementProperties(kind)[0]
            blocks.append(Block(name, cells.astype(np.int64), corners, names))
    return blocks


def _with_lost_nodes(
    data: mmap.mmap, header: Header, numbers: Integers, points: Floats, path: Path
) -> tuple[Integers, Floats]:
    """All nodes of an old file: Gmsh forgets those no element uses."""
    start = re.search(rb"\$(?:Nodes|NOD)\s*?\n\s*(\d+)[^\n]*\n", data)
    assert start, "Gmsh has read this section"
    count = int(start[1])
    if count == len(numbers):
        return numbers, points
    if header.binary:
        row = np.dtype([("number", header.order + "i4"), ("point", header.order + "f8", 3)])
        table = np.frombuffer(data[start.end() : start.end() + count * row.itemsize], dtype=row)
        every, places = table["number"].astype(np.int64), table["point"].astype(float)
    else:
        lines = data[start.end() : data.find(b"$", start.end())].decode("latin-1")
        values = np.fromstring(lines, sep=" ").reshape(-1, 4)
        every, places = values[:, 0].astype(np.int64), values[:, 1:]
    if len(np.unique(every)) < count:
        raise mesh_error(path)("a node number is given twice", cure=CURE)
    return every, places
