"""The surface of a body: its boundary faces, which of them are free, and edges at which stresses are singular.

A rank sees the faces that one of its own nodes is a corner of. All cells at such a node are here, so that faces of one cell are
those of the boundary, and all boundary faces at the node are here too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.mesh.faces import sharing
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]
SHARP = np.radians(45.0)
"""Of the angle that two faces turn inwards: facets of a rounded groove turn less."""
FACING = 0.5
"""Of the squared components of a face's normal: held along more of it, a face is not free."""


@dataclass(frozen=True)
class BodySurface:
    """Boundary faces (f,) of this rank: cell (f,), facet (f,) of the reference cell, corners (f, c) as local nodal vectors.

    free (f,): whether nothing holds it. pairs (p, 2): faces that share an edge, in the plane a corner. singular (v,): nodal
    vectors on edges that turn inwards, or where a bonded face meets a free one.
    """

    cell: Integers
    facet: Integers
    corners: Integers
    free: NDArray[np.bool_]
    pairs: Integers
    singular: NDArray[np.bool_]


def surface_of(assembly: Assembly) -> BodySurface:
    """Of a body of solids or plane elements. Collective."""
    model = assembly.model
    facets = np.array(model.element.cell.facets)
    corners = model.position_cells()[:, : len(model.element.cell.corners)].astype(np.int64)
    sides = np.ascontiguousarray(corners[:, facets].reshape(-1, facets.shape[1]))
    count, _ = sharing(sides, len(model.reference))
    rows = np.flatnonzero((count == 1) & (sides < model.owned).any(axis=1))
    cell, facet, sides = rows // len(facets), rows % len(facets), sides[rows]
    normals = _normals(model.reference, corners[cell], sides)
    held = (model.drive >= 0)[sides].all(axis=1)
    free = (held * normals**2).sum(axis=1) < FACING
    bonded = held.all(axis=1)
    pairs, edges = _pairs(sides)
    singular = _singular(model.reference, sides, normals, pairs, free, bonded)
    marks = np.zeros((model.owned, 3))
    on_edge = edges[singular].ravel()
    marks[on_edge[on_edge < model.owned], 0] = 1.0
    everywhere = assembly.with_ghosts(marks, np.zeros_like(model.reference))[:, 0] > 0.0
    return BodySurface(cell, facet, sides, free, pairs, everywhere)


def is_planar(assembly: Assembly) -> bool:
    """Whether no node moves along one of the axes. Collective."""
    model = assembly.model
    moving = (model.drive[: model.owned] < 0).sum(axis=0)
    return bool((combined(assembly.comm, moving) == 0).any())


def _normals(points: Floats, cells: Integers, sides: Integers) -> Floats:
    """Unit normals (f, 3) out of cells (f, corners), undeformed."""
    edges = points[sides[:, 1:]] - points[sides[:, :1]]
    inwards = points[cells].mean(axis=1) - points[sides].mean(axis=1)
    if sides.shape[1] > 2:
        normals = np.cross(edges[:, 0], edges[:, -1])
        normals *= -np.sign(np.einsum("fi,fi->f", normals, inwards))[:, None]
    else:
        along = edges[:, 0] / np.linalg.norm(edges[:, 0], axis=1, keepdims=True)
        normals = np.einsum("fi,fi->f", inwards, along)[:, None] * along - inwards
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _pairs(sides: Integers) -> tuple[Integers, Integers]:
    """Faces (p, 2) that share an edge with one other, and this edge's ends (p, 2); in the plane the edge is a corner."""
    c = sides.shape[1]
    ends = (
        np.stack((sides, np.roll(sides, -1, axis=1)), axis=2)
        if c > 2
        else np.repeat(sides[..., None], 2, axis=2)
    )
    ends = np.sort(ends.reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=1)
    alone = ~(np.append(False, same[:-1]) | np.append(same[1:], False)) if len(same) else same
    first, second = order[:-1][same & alone], order[1:][same & alone]
    return np.stack((first // c, second // c), axis=1), ends[first]


def _singular(points, sides, normals, pairs, free, bonded) -> NDArray[np.bool_]:
    """Which pairs of faces (p,) meet at an edge where stresses are singular."""
    one, other = pairs[:, 0], pairs[:, 1]
    turn = np.arccos(np.clip(np.einsum("pi,pi->p", normals[one], normals[other]), -1.0, 1.0))
    apart = points[sides[other]].mean(axis=1) - points[sides[one]].mean(axis=1)
    inwards = np.einsum("pi,pi->p", apart, normals[one]) > -1e-9 * np.linalg.norm(apart, axis=1)
    sharp = free[one] & free[other] & inwards & (turn > SHARP)
    rim = (bonded[one] & free[other]) | (free[one] & bonded[other])
    return sharp | rim
