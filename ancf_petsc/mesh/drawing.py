"""Cells as they are drawn: quadratic where deformed edges are curved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ancf_petsc.element.element import Element
from ancf_petsc.mesh.mesh import Floats, Integers, Mesh
from ancf_petsc.mesh.parts import row_keys

QUADRATIC = {
    "line": "line3",
    "triangle": "triangle6",
    "quad": "quad8",
    "tetra": "tetra10",
    "hexahedron": "hexahedron20",
}


@dataclass(frozen=True)
class Drawing:
    """Cells (e, k) of a kind, by meshio's name, on points (m, 3): those of the mesh and, after them, middles of edges.

    middles (e, edges): the point that a cell knows how to place as the middle of its edge, -1 where it need not; None where
    all points are nodes.
    """

    kind: str
    points: Floats
    cells: Integers
    middles: Integers | None = None


def draw_cells(mesh: Mesh, element: Element) -> Drawing:
    """The drawing of a complete mesh of an element."""
    cell = element.cell
    corners = mesh.cells[:, : len(cell.corners)]
    if not element.is_curved:
        return Drawing(cell.name, mesh.points, corners)
    kind = QUADRATIC[cell.name]
    if element.edge:
        return Drawing(kind, mesh.points, mesh.cells[:, : len(cell.corners) + len(cell.edges)])
    edges = corners[:, np.array(cell.edges)].reshape(-1, 2)
    _, first, which = np.unique(row_keys(edges, len(mesh.points)), return_index=True, return_inverse=True)
    middles = mesh.points[edges[first]].mean(axis=1)
    numbers = len(mesh.points) + np.arange(len(first))
    places = np.full(len(edges), -1, np.int64)
    places[first] = numbers
    cells = np.hstack((corners, numbers[which].reshape(len(corners), -1)))
    return Drawing(kind, np.concatenate((mesh.points, middles)), cells, places.reshape(len(corners), -1))
