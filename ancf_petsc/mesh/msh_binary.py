"""Binary files of Gmsh, versions 2 and 4.1: read in this process.

Gmsh's own reader loses the physical groups of partitioned files and does not know $ParametricNodes as a section of nodes.
Source: Gmsh reference manual, "MSH file format version 2".
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ancf_petsc.mesh.kinds import BY_GMSH
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.msh_binary_41 import read_41
from ancf_petsc.mesh.msh_text import CURE, Names, NotOrdinary, Rows, group_of, physical_names, raw_mesh
from ancf_petsc.mesh.raw import RawMesh, mesh_error
from ancf_petsc.mesh.text import decoded

PARAMETERS = {0: 0, 1: 1, 2: 2, 3: 0}
"""How many parameters a node has on an entity of a dimension."""


def read_binary(path: Path) -> RawMesh | None:
    """The mesh in a binary file of version 2 or 4.1, else None. Raises MeshError where it is cut off or its counts do not fit."""
    data = path.read_bytes()
    head = re.match(rb"\$MeshFormat\r?\n(2(?:\.[0-2])?|4\.1) 1 8\r?\n", data)
    if head is None:
        return None
    order = "<" if data[head.end() : head.end() + 4] == b"\x01\0\0\0" else ">"
    notes: list[str] = []
    named = re.search(rb"\$PhysicalNames\s(.*?)\$EndPhysicalNames", data, re.DOTALL)
    try:
        names = physical_names(decoded(named[1], notes).replace("\r", "") if named else "")
        read = read_41 if head[1] == b"4.1" else _read_2
        numbers, points, rows = read(data, order, names)
    except NotOrdinary:
        return None
    except (ValueError, IndexError, OverflowError) as error:
        raise mesh_error(path)(f"a section is cut off ({error})", cure=CURE) from None
    return raw_mesh(numbers, points, rows, names, path, notes)


def _read_2(data: bytes, order: str, names: Names) -> tuple[Integers, Floats, Rows]:
    numbers, points = _nodes(data, order)
    rows: Rows = defaultdict(list)
    for number, tags, table in _runs(data, order):
        kind, groups = BY_GMSH[number], table[:, 1] if tags else np.zeros(len(table), np.int64)
        for tag in np.unique(groups):
            own = np.delete(table[groups == tag], np.s_[1 : 1 + tags], axis=1)
            rows[kind.name, group_of(names, kind.dimension, int(tag))].append(own)
    return numbers, points, rows


def _section(data: bytes, name: str) -> tuple[int, int]:
    """Number a section begins with, and where its binary part begins."""
    start = re.search(rb"^\$" + name.encode() + rb"[ \t]*\r?\n[ \t]*(\d+)[ \t]*\r?\n", data, re.MULTILINE)
    if start is None:
        raise ValueError(f"${name} is missing")
    return int(start[1]), start.end()


def _end(data: bytes, name: str, at: int) -> None:
    if re.match(rb"\s*\$End" + name.encode(), data[at : at + 64]) is None:
        raise ValueError(f"${name} does not end where its count says")


def _nodes(data: bytes, order: str) -> tuple[Integers, Floats]:
    name = "Nodes" if b"\n$Nodes" in data else "ParametricNodes"
    count, at = _section(data, name)
    plain = [("number", order + "i4"), ("point", order + "f8", 3)]
    if name == "Nodes":
        table = np.frombuffer(data, np.dtype(plain), count, at)
        _end(data, name, at + table.nbytes)
        return table["number"].astype(np.int64), table["point"].astype(float)
    numbers, points = [np.empty(0, np.int64)], [np.empty((0, 3))]
    left = count
    while left:
        dimension = int(np.frombuffer(data, order + "i4", 1, at + 28)[0])
        row = np.dtype(
            [*plain, ("place", order + "i4", 2), ("u", order + "f8", (PARAMETERS.get(dimension, 0),))]
        )
        run = np.frombuffer(data, row, min(left, (len(data) - at) // row.itemsize), at)
        same = run["place"][:, 0] == dimension
        run = run if same.all() else run[: np.argmin(same)]
        if not len(run):
            raise ValueError("$ParametricNodes")
        numbers.append(run["number"].astype(np.int64))
        points.append(run["point"].astype(float))
        at, left = at + len(run) * row.itemsize, left - len(run)
    _end(data, name, at)
    return np.concatenate(numbers), np.concatenate(points)


def _runs(data: bytes, order: str) -> Iterator[tuple[int, int, Integers]]:
    """Gmsh's kind, number of tags and rows (m, 1 + tags + nodes) of elements under one header."""
    count, at = _section(data, "Elements")
    left = count
    integer = np.dtype(order + "i4")
    while left > 0:
        number, size, tags = (int(value) for value in np.frombuffer(data, integer, 3, at))
        if number not in BY_GMSH:
            raise NotOrdinary
        if size < 1 or size > left or tags < 0:
            raise ValueError("$Elements")
        width = 1 + tags + BY_GMSH[number].nodes
        table = np.frombuffer(data, integer, size * width, at + 12).reshape(size, width).astype(np.int64)
        yield number, tags, table
        at, left = at + 12 + table.size * 4, left - size
    _end(data, "Elements", at)
