"""A mesh cut along a plane that consists of faces of its cells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.mesh.groups import boundary_faces
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Group, Mesh
from ancf_petsc.mesh.parts import outer_sides, rows_in
from ancf_petsc.reduce.shape import CLOSE
from ancf_petsc.reduce.symmetry import MirrorPlane


def crossing_cells(mesh: Mesh, plane: MirrorPlane) -> int:
    """How many cells a plane goes through: none where it can be cut along faces."""
    low, high = _ranges(mesh, plane)
    slack = CLOSE * mesh.size
    return int(((low < -slack) & (high > slack)).sum())


def cut(mesh: Mesh, plane: MirrorPlane, name: str) -> Mesh:
    """The part of a mesh on the side of the plane's normal. Its faces on the plane, where the body went on, are the group `name`.

    Numbers of nodes and cells stay. Groups keep what of them lies on that side.
    """
    _, high = _ranges(mesh, plane)
    slack = CLOSE * mesh.size
    kept = high > slack
    cells = mesh.cells[kept]
    inside = np.zeros(len(mesh.points), bool)
    inside[cells] = True
    sides = outer_sides(mesh.kind, cells, len(mesh.points))
    on_plane = (np.abs(plane.heights(mesh.points)) <= slack)[sides].all(axis=1)
    sides = sides[on_plane & (rows_in(sides, boundary_faces(mesh), len(mesh.points)) < 0)]
    part = replace(
        mesh,
        cells=cells,
        cell_numbers=mesh.cell_numbers[kept],
        used=inside,
        boundary=None,
        notes=[],
        groups={},
    )
    for group in mesh.groups.values():
        part.groups[group.name] = _part_of(group, inside)
    part.groups[name] = Group(name, np.unique(sides), {KINDS[mesh.kind].dimension - 1: sides})
    return part


def _ranges(mesh: Mesh, plane: MirrorPlane) -> tuple[NDArray, NDArray]:
    """The lowest and the highest node (e,) of each cell over the plane."""
    heights = plane.heights(mesh.points)[mesh.cells]
    return heights.min(axis=1), heights.max(axis=1)


def _part_of(group: Group, inside: NDArray[np.bool_]) -> Group:
    """What is left of a group where nodes are inside."""
    parts = {d: rows[inside[rows].all(axis=1)] for d, rows in group.parts.items()}
    nodes = group.nodes[inside[group.nodes]]
    return Group(group.name, nodes, {d: rows for d, rows in parts.items() if len(rows)})
