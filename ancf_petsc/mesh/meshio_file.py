"""Meshes in the other formats, read by meshio.

Named groups come from cell and point sets, from the families of MED, from Gmsh's tags with their names in
the field data, and from the integer data into which meshio turns sets when it writes VTU, VTK and XDMF.
These formats lose or hide their own numbers: nodes and cells are numbered from 1 as they stand in the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.mesh.foreign.process import LONGEST_REASON, contents
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.raw import Block, RawMesh, mesh_error

TAGS = ("gmsh:physical", "medit:ref", "nastran:ref", "netgen:index", "su2:tag", "abaqus:material")
SAME = {"tetra4": "tetra"}
CURE = "write it again, or in another format such as .msh, .vtu or .inp"
HARMLESS = re.compile(
    r"RequiredVertices|Tangent|Ridges|Gmf(?:Required|Corners|Ridges|Tang|Norm)|some time data|debugging"
)
"""What meshio may skip: marks of points and edges that make no group."""
ALL = ".msh .vtu .vtk .xdmf .inp .med .bdf .mesh"


def read_meshio(path: Path) -> RawMesh:
    """The mesh in a file of any format meshio reads."""
    mesh, notes = _read(path)
    points = _points(mesh["points"], path)
    numbers = np.arange(1, len(points) + 1)
    kinds = [SAME.get(kind, kind) for kind, _ in mesh["cells"]]
    cells = [_nodes(nodes, kind) for (_, nodes), kind in zip(mesh["cells"], kinds, strict=True)]
    first = np.cumsum([1, *map(len, cells)])
    blocks = [
        Block(kind, np.arange(start, start + len(nodes)), nodes.astype(np.int64) + 1)
        for kind, nodes, start in zip(kinds, cells, first[:-1], strict=True)
    ]
    listed = [
        Block(block.kind, block.numbers[rows], block.nodes[rows], (name,))
        for name, number, rows in _cell_sets(mesh, kinds, path)
        for block in (blocks[number],)
        if len(rows)
    ]
    node_sets = {name: _rows(rows, len(points), name, path) + 1 for name, rows in _point_sets(mesh)}
    names = [
        *(name for name, _ in mesh["cell_sets"]),
        *(name for block in listed for name in block.names),
        *node_sets,
    ]
    _check_widths(blocks, path)
    return RawMesh(numbers, points, blocks + listed, list(dict.fromkeys(names)), node_sets, notes=notes)


def _points(given: Any, path: Path) -> Floats:
    """Points (n, 3); missing coordinates are 0."""
    points = np.zeros((len(given) if given.ndim else 0, 3))
    if len(points):
        if given.ndim != 2 or given.shape[1] > 3:
            raise mesh_error(path)(
                f"its points are a table of shape {given.shape}",
                expected="up to three coordinates a point",
                cure=CURE,
            )
        points[:, : given.shape[1]] = given
    return points


def _check_widths(blocks: list[Block], path: Path) -> None:
    """Every cell has as many nodes as its kind."""
    for block in blocks:
        kind = KINDS.get(block.kind)
        if kind and len(block.nodes) and block.nodes.shape[1] != kind.nodes:
            raise mesh_error(path)(
                f"{len(block.nodes)} {block.kind} cells with {block.nodes.shape[1]} nodes",
                expected=f"{kind.nodes} nodes",
                cure="write the mesh again",
            )


def _rows(rows: Any, count: int, name: str, path: Path) -> Integers:
    """The members of a set, all of which must be there."""
    found = np.asarray(rows).ravel()
    if not np.issubdtype(found.dtype, np.integer):
        found = found.astype(np.int64) if not len(found) or np.array_equal(found, np.floor(found)) else found
    outside = found[(found < 0) | (found >= count)]
    if len(outside):
        raise mesh_error(path)(
            f"the set {name} names {len(outside)} members that are not there, first {outside[0] + 1}",
            expected=f"1 to {count}",
            cure="write the mesh again",
        )
    return found.astype(np.int64)


def _read(path: Path) -> tuple[dict[str, Any], list[str]]:
    """What `foreign.by_meshio` finds, and what meshio leaves out without harm.

    Raises MeshError also where it leaves out what may belong to the mesh.
    """
    wrong = mesh_error(path)
    found = contents(path, "meshio")
    if not found["known"]:
        raise wrong(
            "not a format meshes are read from",
            got=path.suffix,
            expected=f"one of {ALL} or what meshio reads",
        )
    lines = found["said"]
    if lines and not HARMLESS.search(lines):
        raise wrong(f"meshio leaves out part of it ({lines[:LONGEST_REASON]})", cure=CURE)
    return found, [f"left out of the mesh file: {lines[:LONGEST_REASON]}"] if lines else []


def _nodes(nodes: np.ndarray, kind: str) -> np.ndarray:
    """Rows (m, k) of points, also where there are none."""
    return nodes if nodes.shape[1] else np.empty((len(nodes), KINDS[kind].nodes if kind in KINDS else 0))


def _cell_sets(mesh: Any, kinds: list[str], path: Path) -> Iterator[tuple[str, int, Integers]]:
    """Name, number of the cell block, rows of it."""
    for name, by_block in mesh["cell_sets"]:
        if len(by_block) > len(kinds):
            raise mesh_error(path)(
                f"the set {name} speaks of {len(by_block)} blocks of cells",
                expected=f"{len(kinds)}",
                cure=CURE,
            )
        for block, rows in enumerate(by_block):
            if rows is not None:
                yield name, block, _rows(rows, len(mesh["cells"][block][1]), name, path)
    yield from _tagged_cells(mesh, kinds, path)


def _tagged_cells(mesh: Any, kinds: list[str], path: Path) -> Iterator[tuple[str, int, Integers]]:
    """The same of data that number sets."""
    sizes = [len(nodes) for _, nodes in mesh["cells"]]
    for key, by_block in mesh["cell_data"]:
        if [len(tags) for tags in by_block] != sizes:
            raise mesh_error(path)(f"the data {key} do not fit the cells", cure=CURE)
        if key == "cell_tags" and mesh["cell_tags"] is not None:
            names = dict(mesh["cell_tags"])
        elif key in TAGS:
            names = None
        else:
            names = _set_names(key, by_block)
            if not names:
                continue
        for block, tags in enumerate(by_block):
            dimension = KINDS[kinds[block]].dimension if kinds[block] in KINDS else 3
            for tag in np.unique(tags):
                every = _tag_names(mesh, dimension, int(tag)) if names is None else names.get(int(tag), ())
                for name in every:
                    yield name, block, np.flatnonzero(tags == tag)


def _point_sets(mesh: Any) -> Iterator[tuple[str, Integers]]:
    """Name, rows of the points."""
    yield from mesh["point_sets"]
    for key, (tags,) in mesh["point_data"]:
        if len(tags) != len(mesh["points"]):
            continue
        families = dict(mesh["point_tags"] or {}) if key == "point_tags" else _set_names(key, [tags])
        rows: dict[str, list[Integers]] = {}
        for tag, names in families.items():
            for name in names:
                rows.setdefault(name, []).append(np.flatnonzero(tags == tag))
        for name, parts in rows.items():
            yield name, np.unique(np.concatenate(parts))


def _tag_names(mesh: Any, dimension: int, tag: int) -> list[str]:
    """The names field data gives to a tag of a dimension; 0 is no group."""
    if tag == 0:
        return []
    named = [
        name for name, value in mesh["field_data"] if len(value) == 2 and tuple(value) == (tag, dimension)
    ]
    return named or [f"physical_{dimension}_{tag}"]


def _set_names(key: str, data: list[np.ndarray]) -> dict[int, list[str]]:
    """Tag -> name where `key` is the names of sets joined by "-" and the data number them, -1 for none."""
    if not data:
        return {}
    names = key.split("-")
    tags = np.unique(np.concatenate([np.ravel(part) for part in data]))
    counted = tags.dtype.kind in "iu" and len(tags) and tags.min() >= -1 and tags.max() == len(names) - 1
    return {tag: [name] for tag, name in enumerate(names)} if counted and ":" not in key else {}
