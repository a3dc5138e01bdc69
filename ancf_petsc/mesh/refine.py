"""Uniform refinement: every cell divided at the middles of its edges, the body and its groups as they were.

Tetrahedra into 8: four at the corners, and four of the octahedron between them around its shortest diagonal, which
keeps their quality (Zhang, SIAM J. Sci. Comput. 16 (1995) 1). Bricks into 8, triangles and quadrilaterals into 4, lines into 2.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ancf_petsc.mesh.complete import straighten
from ancf_petsc.mesh.groups import cells_of, parts_for_support
from ancf_petsc.mesh.kinds import KINDS, Kind, part_kind
from ancf_petsc.mesh.mesh import Floats, Group, Integers, Mesh
from ancf_petsc.mesh.parts import row_keys, rows_in, unique_rows

# Children as places in a row of nodes: the corners of a cell, the middles of its edges, the centres of its faces, its own centre.
CHILDREN = {
    "vertex": ((0,),),
    "line": ((0, 2), (2, 1)),
    "triangle": ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    "quad": ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)),
    "hexahedron": (
        *((0, 8, 20, 11, 16, 22, 26, 25), (8, 1, 9, 20, 22, 17, 23, 26)),
        *((20, 9, 2, 10, 26, 23, 18, 24), (11, 20, 10, 3, 25, 26, 24, 19)),
        *((16, 22, 26, 25, 4, 12, 21, 15), (22, 17, 23, 26, 12, 5, 13, 21)),
        *((26, 23, 18, 24, 21, 13, 6, 14), (25, 26, 24, 19, 15, 21, 14, 7)),
    ),
}
CORNERS = ((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3))
DIAGONALS = ((4, 9), (6, 8), (7, 5))
"""Opposite corners of the octahedron that is left of a tetrahedron."""
AROUND = (
    ((4, 9, 5, 6), (4, 9, 6, 7), (4, 9, 7, 8), (4, 9, 8, 5)),
    ((6, 8, 4, 5), (6, 8, 5, 9), (6, 8, 9, 7), (6, 8, 7, 4)),
    ((7, 5, 4, 6), (7, 5, 6, 9), (7, 5, 9, 8), (7, 5, 8, 4)),
)
"""Four tetrahedra around each diagonal, oriented as their parent."""


class Between(NamedTuple):
    """New nodes (m,) at the means of edges or faces, whose corners are (m, k), each once."""

    corners: Integers
    nodes: Integers

    def of(self, rows: Integers, bound: int) -> Integers:
        """The node of each of rows (r, k), -1 where it has none."""
        places = rows_in(rows, self.corners, bound)
        return np.where(places >= 0, self.nodes[places], -1)


def refine(mesh: Mesh, times: int) -> None:
    """Refine a mesh in place, `times` times.

    Nodes keep their numbers, new ones follow the highest. Cells are numbered from 1, parent after parent: with c children
    each, cell n lies in the ((n - 1) // c + 1)-th cell of the file. Mid-nodes become corners, on the middle of their edge.
    """
    if not times:
        return
    before = len(mesh.cells)
    for _ in range(times):
        _refine_once(mesh)
    mesh.boundary = None
    mesh.notes.append(
        f"mesh refined {times} time{'s' * (times > 1)}: {len(mesh.cells) // before} elements for each of the file's {before}"
    )


def _refine_once(mesh: Mesh) -> None:
    kind = KINDS[KINDS[mesh.kind].linear or mesh.kind]
    mids = mesh.cells[:, kind.nodes : kind.nodes + len(kind.edges)]
    if mids.size:
        straighten(mesh, kind.edges)
    corners = mesh.cells[:, : kind.nodes]
    old = replace(mesh, kind=kind.name, cells=corners, boundary=None)
    edges = _between(mesh, corners[:, np.array(kind.edges)], mids)
    faces = _between(mesh, corners[:, np.array(_quadrilaterals(kind), np.int64).reshape(-1, 4)])
    inside = _between(mesh, corners[:, None, :]) if kind.nodes == 8 else Between(corners[:0], corners[:0, 0])
    children = _children(kind, corners, (edges, faces, inside), mesh.points)
    mesh.groups = {
        name: _divided(group, old, (edges, faces), children) for name, group in mesh.groups.items()
    }
    mesh.kind, mesh.cells = kind.name, children.reshape(-1, kind.nodes)
    mesh.cell_numbers = 1 + np.arange(len(mesh.cells))


def _quadrilaterals(kind: Kind) -> tuple[tuple[int, ...], ...]:
    """Places of the corners of faces that get a node at their centre."""
    if kind.name == "quad":
        return ((0, 1, 2, 3),)
    return kind.sides if kind.name == "hexahedron" else ()


def _between(mesh: Mesh, rows: Integers, known: Integers | None = None) -> Between:
    """Nodes at the means of rows (e, m, k) of corners; `known` (e, m) of a mesh that has them already, the others are added."""
    flat = rows.reshape(-1, rows.shape[-1])
    if not len(flat):
        return Between(flat, np.empty(0, np.int64))
    first = np.unique(row_keys(flat, len(mesh.points)), return_index=True)[1]
    corners = flat[first]
    if known is not None and known.size:
        return Between(corners, known.ravel()[first])
    new = len(mesh.points) + np.arange(len(corners))
    highest = mesh.node_numbers.max()
    mesh.points = np.concatenate((mesh.points, mesh.points[corners].mean(axis=1)))
    mesh.node_numbers = np.concatenate((mesh.node_numbers, highest + 1 + np.arange(len(new))))
    mesh.used = np.concatenate((mesh.used, np.ones(len(new), bool)))
    return Between(corners, new)


def _children(
    kind: Kind, corners: Integers, found: tuple[Between, Between, Between], points: Floats
) -> Integers:
    """Cells (e, c, k) from cells (e, k)."""
    rows, bound = [corners], len(points)
    for between, places in zip(
        found, (kind.edges, _quadrilaterals(kind), (tuple(range(8)),) * (kind.nodes == 8)), strict=True
    ):
        if places:
            wanted = corners[:, np.array(places)]
            rows.append(
                between.of(wanted.reshape(-1, wanted.shape[-1]), bound).reshape(len(corners), len(places))
            )
    nodes = np.hstack(rows)
    if kind.name != "tetra":
        return nodes[:, np.array(CHILDREN[kind.name])]
    ends = points[nodes[:, np.array(DIAGONALS)]]
    shortest = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1).argmin(axis=1)
    around = np.take_along_axis(
        nodes[:, None, :], np.array(AROUND)[shortest].reshape(len(nodes), 1, -1), axis=2
    )
    return np.concatenate((nodes[:, np.array(CORNERS)], around.reshape(-1, 4, 4)), axis=1)


def _divided(group: Group, old: Mesh, found: tuple[Between, Between], children: Integers) -> Group:
    """A group with the nodes between its corners, its parts divided. old: the mesh of corners it stood for."""
    count = children.shape[1]
    parts = {d: _divided_parts(rows, d, old, found, children) for d, rows in group.parts.items()}
    if group.parts:
        within = [rows.ravel() for rows in parts.values()]
    else:  # a set of nodes takes what lies between those of the faces and cells it covers
        within = [_middles(rows, d, found) for d, rows in parts_for_support(old, group).items()]
        if group.cells is None:
            within.append(children[cells_of(old, group)].ravel())
    cells = None if group.cells is None else (group.cells[:, None] * count + np.arange(count)).ravel()
    return Group(group.name, np.unique(np.concatenate([group.nodes, *within])), parts, cells)


def _middles(rows: Integers, dimension: int, found: tuple[Between, Between]) -> Integers:
    """Nodes on lines or faces (m, corners) between their corners."""
    kind = part_kind(dimension, rows.shape[1])
    bound = 1 + max(int(rows.max(initial=0)), *(int(b.corners.max(initial=0)) for b in found))
    nodes = [np.empty(0, np.int64)]
    for between, places in zip(found, (kind.edges, _quadrilaterals(kind)), strict=True):
        if places and len(between.nodes):
            wanted = rows[:, np.array(places)]
            nodes.append(between.of(unique_rows(wanted.reshape(-1, wanted.shape[-1]), bound), bound))
    every = np.concatenate(nodes)
    return every[every >= 0]


def _divided_parts(
    rows: Integers, dimension: int, old: Mesh, found: tuple[Between, Between], children: Integers
) -> Integers:
    """Parts (m, corners) of the refined cells; parts that are none of a cell stay as they are."""
    kind = part_kind(dimension, rows.shape[1])
    bound = old_bound = len(old.points)
    if dimension == KINDS[old.kind].dimension:
        place = rows_in(rows, old.cells, old_bound)
        return np.concatenate((children[place[place >= 0]].reshape(-1, rows.shape[1]), rows[place < 0]))
    nodes = [rows]
    for between, places in zip(found, (kind.edges, _quadrilaterals(kind)), strict=True):
        if places:
            wanted = rows[:, np.array(places)]
            nodes.append(
                between.of(wanted.reshape(-1, wanted.shape[-1]), bound).reshape(len(rows), len(places))
            )
    every = np.hstack(nodes)
    whole = (every >= 0).all(axis=1)
    table = np.array(CHILDREN[kind.name])
    return np.concatenate((every[whole][:, table].reshape(-1, rows.shape[1]), rows[~whole]))
