"""What may be wrong with a mesh that can be computed with: sides that do not match, cells that overlap, groups inside.

The cost is that of a few passes over the cells.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ancf_petsc.mesh.check import number_pieces
from ancf_petsc.mesh.coincident import TOLERANCE, coincident_pairs, representatives
from ancf_petsc.mesh.faces import sharing, sides_of
from ancf_petsc.mesh.inside import other_cells
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Floats, Integers, Mesh
from ancf_petsc.mesh.parts import row_keys, rows_in

INWARDS = 0.25
"""A cell overlaps another when a point this share of the way from the middle of a side to its own middle lies in it."""
OUTWARDS = 1e-3
"""A side touches another body when a point this share of the same way beyond it lies in a cell there."""
SIDES = {3: ("faces", "face"), 2: ("edges", "edge")}


def doubts(mesh: Mesh, boundary_only: Collection[str] = ()) -> list[str]:
    """Sentences about what looks wrong. Enters `mesh.boundary`, and into `mesh.refused` groups that must be on it and are not."""
    kind = KINDS[mesh.kind]
    if kind.dimension < 2:
        return []
    corners = mesh.cells[:, : kind.corners]
    sides = sides_of(mesh.kind, corners)
    count, other = sharing(sides, len(mesh.points))
    outer = np.flatnonzero(count == 1)
    mesh.boundary = sides[outer]
    per_cell = len(kind.sides)
    notes = [
        *_crowded(mesh, sides, count, per_cell),
        *_joined_by_edges(mesh, corners, other, per_cell),
        *_groups_inside(mesh, kind.dimension - 1, boundary_only),
    ]
    return notes + _misplaced(mesh, corners, sides[outer], outer // per_cell)


def face_pieces(mesh: Mesh) -> tuple[int, Integers]:
    """How many pieces the cells form through sides they share, and the piece of each cell (e,), numbered by lowest cell."""
    kind = KINDS[mesh.kind]
    sides = sides_of(mesh.kind, mesh.cells[:, : kind.corners])
    _, other = sharing(sides, len(mesh.points))
    return _pieces(other, len(kind.sides))


def _pieces(other: Integers, per_cell: int) -> tuple[int, Integers]:
    cells = np.arange(len(other)) // per_cell
    pairs = np.stack([cells, np.where(other < 0, cells, other // per_cell)], axis=1)
    return number_pieces(pairs, len(other) // per_cell)


def _place(point: Floats) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ")"


def _crowded(mesh: Mesh, sides: Integers, count: Integers, per_cell: int) -> list[str]:
    """Sides that more than two cells share."""
    crowded = np.flatnonzero(count > 2)
    if not len(crowded):
        return []
    many, one = SIDES[KINDS[mesh.kind].dimension]
    which = len(np.unique(row_keys(sides[crowded], len(mesh.points))))
    first = crowded[0]
    return [
        f"{which} {many} belong to more than two elements, first {one} at {_place(mesh.points[sides[first]].mean(axis=0))} of "
        f"element {mesh.cell_numbers[first // per_cell]}: elements overlap"
    ]


def _joined_by_edges(mesh: Mesh, corners: Integers, other: Integers, per_cell: int) -> list[str]:
    """Pieces that hang together by edges or corners alone."""
    pieces, label = _pieces(other, per_cell)
    if pieces == 1:
        return []
    whole = number_pieces(np.ascontiguousarray(corners), len(mesh.points))[0]
    if pieces == whole:
        return []
    small = np.bincount(label).argmin()
    centre = _place(mesh.points[corners[label == small]].mean(axis=(0, 1)))
    what = "edges or corners" if KINDS[mesh.kind].dimension == 3 else "corners"
    return [
        f"{pieces} pieces of the body are joined by {what} only, the smallest around {centre}: joints may turn there"
    ]


def _groups_inside(mesh: Mesh, dimension: int, boundary_only: Collection[str]) -> list[str]:
    """Groups of sides that are not on the boundary."""
    assert mesh.boundary is not None
    notes = []
    many = SIDES[dimension + 1][0]
    for name, group in mesh.groups.items():
        parts = group.parts.get(dimension)
        if parts is None or dimension + 1 in group.parts:
            continue
        inside = np.count_nonzero(rows_in(parts, mesh.boundary, len(mesh.points)) < 0)
        if inside and name in boundary_only:
            mesh.refused[name] = f"{inside} of the {len(parts)} {many} of this surface lie within the body"
        elif inside:
            notes.append(
                f"{name}: {inside} of its {len(parts)} {many} lie within the body, not on its boundary"
            )
    return notes


def _misplaced(mesh: Mesh, corners: Integers, sides: Integers, owners: Integers) -> list[str]:
    """Cells in others, and boundary sides that lie on others without being the same."""
    points = mesh.points
    if KINDS[mesh.kind].dimension == 2:
        flat = int(np.ptp(points[mesh.used], axis=0).argmin())
        points = np.ascontiguousarray(points[:, [(flat + 1) % 3, (flat + 2) % 3, flat]])
        points[:, 2] = 0.0
    middle = points[sides].mean(axis=1)
    way = points[corners[owners]].mean(axis=1) - middle
    kind = KINDS[mesh.kind].linear or mesh.kind
    within = other_cells(points, kind, corners, middle + INWARDS * way, owners)
    notes = []
    if (within >= 0).any():
        row = np.flatnonzero(within >= 0)[0]
        own, holder = mesh.cell_numbers[owners[row]], mesh.cell_numbers[within[row]]
        count = len(np.unique(owners[within >= 0]))
        place = _place(mesh.points[corners[owners[row]]].mean(axis=0))
        notes.append(
            f"{count} elements lie in others, first element {own} at {place} in element {holder}: bodies overlap"
        )
    left = np.flatnonzero(within < 0)
    touched = left[other_cells(points, kind, corners, (middle - OUTWARDS * way)[left], owners[left]) >= 0]
    touched = touched[_alone(points[sides[touched]], mesh.size)]
    if len(touched):
        many, one = SIDES[KINDS[mesh.kind].dimension]
        place = _place(mesh.points[sides[touched[0]]].mean(axis=0))
        notes.append(
            f"{len(touched)} {many} of the boundary lie on others that they do not match, first {one} at {place} of element "
            f"{mesh.cell_numbers[owners[touched[0]]]}: the body is not joined there"
        )
    return notes


def _alone(places: Floats, size: float) -> np.ndarray:
    """Whether no other of sides with corners at places (m, c, 3) has its corners at the same ones."""
    if not len(places):
        return np.empty(0, dtype=bool)
    flat = places.reshape(-1, 3)
    same = representatives(coincident_pairs(flat, TOLERANCE * size), len(flat)).reshape(places.shape[:2])
    _, which, count = np.unique(row_keys(same, len(flat)), return_inverse=True, return_counts=True)
    return count[which] == 1
