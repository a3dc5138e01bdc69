"""Kinds of cells and of the parts groups are meshed with: one row each.

Names and the order of corners and mid-nodes are meshio's, which are VTK's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ancf_petsc.element.cell import CELLS, Cell
from ancf_petsc.mesh.mesh import Floats, Integers

Corners = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Kind:
    """One kind of cell.

    nodes: how many a cell has; the first `corners` of them are its corners.
    linear: the kind of its corners alone.
    frames: a corner and its neighbours, right-handed: their determinants are positive in a good cell.
    mirrored: the order of nodes that mirrors the cell.
    simplices, fold: simplices that cover the cell `fold` times (both diagonals of every quadrilateral).
    gmsh: Gmsh's number of the kind; gmsh_order: its nodes in our order, where that differs.
    """

    name: str
    dimension: int
    nodes: int
    linear: str = ""
    frames: Corners = ()
    mirrored: tuple[int, ...] = ()
    simplices: Corners = ()
    fold: int = 1
    gmsh: int = 0
    gmsh_order: tuple[int, ...] = ()
    ideal: Floats = field(default_factory=lambda: np.eye(3))

    @property
    def cell(self) -> Cell | None:
        """The reference cell of its corners, where elements are made of such cells."""
        return CELLS.get(self.linear or self.name)

    @property
    def sides(self) -> Corners:
        """Parts one dimension lower, seen from outside counterclockwise; none where there is no reference cell."""
        return self.cell.facets if self.cell else ()

    @property
    def edges(self) -> Corners:
        """Pairs of corners; none where there is no reference cell."""
        return self.cell.edges if self.cell else ()

    @property
    def corners(self) -> int:
        return KINDS[self.linear].nodes if self.linear else self.nodes


KUHN = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
"""Six tetrahedra of a brick that share its diagonal from corner 0 to corner 6."""

_ACROSS = (1, 0, 3, 2, 5, 4, 7, 6)
_KUHN_MIRRORED = tuple((_ACROSS[a], _ACROSS[c], _ACROSS[b], _ACROSS[d]) for a, b, c, d in KUHN)

_REGULAR_TRIANGLE = np.array([[1, 0.5], [0, np.sqrt(3) / 2]])
_REGULAR_TETRAHEDRON = np.array([[1, 0.5, 0.5], [0, np.sqrt(3) / 2, np.sqrt(3) / 6], [0, 0, np.sqrt(2 / 3)]])
_TETRA: dict[str, Any] = {
    "dimension": 3,
    "frames": ((0, 1, 2, 3),),
    "simplices": ((0, 1, 2, 3),),
    "ideal": _REGULAR_TETRAHEDRON,
}
_TRIANGLE: dict[str, Any] = {
    "dimension": 2,
    "frames": ((0, 1, 2),),
    "simplices": ((0, 1, 2),),
    "ideal": _REGULAR_TRIANGLE,
}
_HEXAHEDRON: dict[str, Any] = {
    "dimension": 3,
    "frames": (
        *((0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7)),
        *((4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)),
    ),
    "simplices": KUHN + _KUHN_MIRRORED,
    "fold": 2,
}

KINDS = {
    kind.name: kind
    for kind in (
        Kind("vertex", 0, 1, gmsh=15),
        Kind(
            "line",
            1,
            2,
            frames=((0, 1),),
            mirrored=(1, 0),
            simplices=((0, 1),),
            gmsh=1,
            ideal=np.eye(1),
        ),
        Kind("triangle", nodes=3, mirrored=(0, 2, 1), gmsh=2, **_TRIANGLE),
        Kind(
            "quad",
            2,
            4,
            frames=((0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2)),
            mirrored=(0, 3, 2, 1),
            simplices=((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3)),
            fold=2,
            gmsh=3,
            ideal=np.eye(2),
        ),
        Kind("tetra", nodes=4, mirrored=(0, 2, 1, 3), gmsh=4, **_TETRA),
        Kind("hexahedron", nodes=8, mirrored=(0, 3, 2, 1, 4, 7, 6, 5), gmsh=5, **_HEXAHEDRON),
        Kind("wedge", 3, 6, gmsh=6),
        Kind("pyramid", 3, 5, gmsh=7),
        Kind("line3", 1, 3, linear="line", gmsh=8),
        Kind("triangle6", nodes=6, linear="triangle", mirrored=(0, 2, 1, 5, 4, 3), gmsh=9, **_TRIANGLE),
        Kind("quad8", 2, 8, linear="quad", gmsh=16),
        Kind("quad9", 2, 9, linear="quad", gmsh=10),
        Kind(
            "tetra10",
            nodes=10,
            linear="tetra",
            mirrored=(0, 2, 1, 3, 6, 5, 4, 7, 9, 8),
            gmsh=11,
            gmsh_order=(0, 1, 2, 3, 4, 5, 6, 7, 9, 8),
            **_TETRA,
        ),
        Kind(
            "hexahedron20",
            nodes=20,
            linear="hexahedron",
            mirrored=(0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17),
            gmsh=17,
            gmsh_order=(*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15),
            **_HEXAHEDRON,
        ),
        Kind("hexahedron27", 3, 27, linear="hexahedron", gmsh=12),
        Kind("wedge15", 3, 15, linear="wedge", gmsh=18),
        Kind("wedge18", 3, 18, linear="wedge", gmsh=13),
        Kind("pyramid13", 3, 13, linear="pyramid", gmsh=19),
        Kind("pyramid14", 3, 14, linear="pyramid", gmsh=14),
    )
}

BY_GMSH = {kind.gmsh: kind for kind in KINDS.values()}

_PARTS = {
    (KINDS[name].dimension, KINDS[name].nodes): KINDS[name]
    for name in ("vertex", "line", "triangle", "quad", "tetra", "hexahedron")
}


def part_kind(dimension: int, corners: int) -> Kind:
    """The kind of parts of a dimension with so many corners."""
    return _PARTS[dimension, corners]


def determinants(points: Floats, cells: Integers, kind: Kind) -> Floats:
    """Determinants (e, s) of the frames s of cells (e, k).

    Plane cells are seen from the positive side of the axis they face most; lines give lengths.
    """
    edges = _frame_edges(points, cells, kind)
    if kind.dimension == 3:
        return np.einsum("esi,esi->es", edges[:, :, 0], np.cross(edges[:, :, 1], edges[:, :, 2]))
    if kind.dimension == 2:
        normals = np.cross(edges[:, :, 0], edges[:, :, 1])
        return normals[..., int(np.abs(normals).sum(axis=(0, 1)).argmax())]
    return np.linalg.norm(edges[:, :, 0], axis=-1)


def _frame_edges(points: Floats, cells: Integers, kind: Kind) -> Floats:
    """Edges (e, s, d, i) from the corner of each frame to its neighbours."""
    frames = np.array(kind.frames)
    corners = points[cells[:, frames]]
    return corners[:, :, 1:] - corners[:, :, :1]


def qualities(points: Floats, cells: Integers, kind: Kind) -> Floats:
    """Mean ratio (e,) of each cell, the worst of its frames: 1 for a regular cell, 0 for a flat one.

    d det(T)^(2/d) / |T|^2 with T the map from the regular cell, after Liu and Joe, BIT 34 (1994) 268.
    """
    d = kind.dimension
    edges = _frame_edges(points, cells, kind)
    ideal = kind.ideal
    stretched = np.einsum("esji,jk->eski", edges, np.linalg.inv(ideal))
    squares = np.einsum("esji,esji->es", stretched, stretched)
    volume = np.abs(determinants(points, cells, kind)) / np.linalg.det(ideal)
    return (d * volume ** (2 / d) / np.where(squares > 0, squares, 1)).min(axis=1)


def part_sizes(points: Floats, parts: Integers, kind: Kind) -> Floats:
    """Length, area or volume (m,) of parts (m, corners); volumes carry the sign of the orientation."""
    if kind.dimension == 0:
        return np.zeros(len(parts))
    sizes = np.zeros(len(parts))
    for simplex in kind.simplices:
        origin, *others = (points[parts[:, corner]] for corner in simplex)
        edges = [other - origin for other in others]
        if kind.dimension == 1:
            sizes += np.linalg.norm(edges[0], axis=1)
        elif kind.dimension == 2:
            sizes += np.linalg.norm(np.cross(*edges), axis=1) / 2
        else:
            sizes += np.einsum("ei,ei->e", edges[0], np.cross(edges[1], edges[2])) / 6
    return sizes / kind.fold


def edge_lengths(points: Floats, cells: Integers, kind: Kind) -> tuple[Floats, Floats]:
    """Shortest and longest edge (e,) of each cell."""
    shortest = np.full(len(cells), np.inf)
    longest = np.zeros(len(cells))
    for first, second in kind.edges:
        length = np.linalg.norm(points[cells[:, second]] - points[cells[:, first]], axis=1)
        np.minimum(shortest, length, out=shortest)
        np.maximum(longest, length, out=longest)
    return shortest, longest
