"""Meshes of the ladders of `element_ladder`: boxes of bricks, and the PVC block as a polyhedron."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import meshio
import numpy as np

from ancf_petsc.mesh.bodies import GROOVE_DEPTH, HEIGHT, INNER, LOWER, OUTER, UPPER
from ancf_petsc.mesh.generate import bricks
from ancf_petsc.mesh.gmsh_session import gmsh_session
from ancf_petsc.mesh.kinds import KINDS, KUHN

AROUND = 8  # flat faces around the quarter of the block, on every mesh
SECTION = (
    *((INNER, 0.0), (OUTER, 0.0), (OUTER, LOWER), (OUTER - GROOVE_DEPTH, HEIGHT / 2)),
    *((OUTER, UPPER), (OUTER, HEIGHT), (INNER, HEIGHT)),
)
ROOT = 3


class Lengths(NamedTuple):
    """Metres of edges: away from rims, at the bonded rims, at the root of the groove; growth with the distance from both."""

    size: float
    rim: float
    root: float
    growth: float

    def finer(self, factor: float) -> Lengths:
        """Edges shorter by `factor` in the volume, by its square at the rims, by its third power at the root.

        The singularities are about r^0.76 and r^0.5: errors from there and from the volume then fall alike.
        """
        return Lengths(self.size * factor, self.rim * factor**2, self.root * factor**3, self.growth * factor)


def box(path: Path, axes: Sequence[Sequence[float]], kind: str) -> Path:
    """A box of bricks between the planes of each axis, or of six tetrahedra a brick."""
    z, y, x = np.meshgrid(*(np.array(axis, float) for axis in axes[::-1]), indexing="ij")
    points, cells = bricks(np.stack((x, y, z), axis=-1))
    if kind == "tetra":
        cells = cells[:, np.array(KUHN)].reshape(-1, 4)
    meshio.Mesh(points, [(kind, cells)]).write(path)
    return path


def block(path: Path, lengths: Lengths) -> Path:
    """Tetrahedra of the quarter of the PVC block with flat faces around: the same body whatever the lengths of edges."""
    sizes = {"Mesh.MeshSizeMin": min(lengths[:3]), "Mesh.MeshSizeMax": lengths.size}
    with gmsh_session(**sizes) as gmsh:
        rings = _polyhedron(gmsh.model.geo)
        gmsh.model.geo.synchronize()
        rims = [line for corner, ring in enumerate(rings) if _bonded(corner, corner) for line in ring]
        _grade(gmsh, {lengths.rim: rims, lengths.root: rings[ROOT]}, lengths)
        gmsh.model.mesh.generate(3)
        numbers, coordinates, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(KINDS["tetra"].gmsh)
    order = np.argsort(numbers)
    used, cells = np.unique(np.searchsorted(numbers[order], nodes), return_inverse=True)
    points = coordinates.reshape(-1, 3)[order[used]]
    meshio.Mesh(points, [("tetra", cells.reshape(-1, 4))]).write(path)
    return path


def _bonded(corner: int, other: int) -> bool:
    """Whether an edge of the section lies on a bonded face."""
    z = SECTION[corner][1]
    return z == SECTION[other][1] and z in (0.0, HEIGHT)


def _polyhedron(geo: Any) -> list[list[int]]:
    """The section turned in AROUND straight strides. Returns the lines around of each corner of the section."""
    corners = range(len(SECTION))
    after = [*corners[1:], 0]
    angles = np.linspace(0, np.pi / 2, AROUND + 1)
    points = [[geo.addPoint(r * np.cos(a), r * np.sin(a), z) for r, z in SECTION] for a in angles]
    rings = [[geo.addLine(points[i][c], points[i + 1][c]) for i in range(AROUND)] for c in corners]
    sections: list[dict[int, int]] = []
    for i in range(AROUND + 1):
        drawn = [c for c in corners if i in (0, AROUND) or not _bonded(c, after[c])]
        sections.append({c: geo.addLine(points[i][c], points[i][after[c]]) for c in drawn})

    def face(lines: Iterable[int]) -> int:
        return geo.addPlaneSurface([geo.addCurveLoop(list(lines))])

    faces = [face(sections[i].values()) for i in (0, AROUND)]
    for c in corners:
        ahead, back = rings[after[c]], [-line for line in rings[c]]
        if _bonded(c, after[c]):
            faces.append(face([sections[0][c], *ahead, -sections[AROUND][c], *back[::-1]]))
        else:
            for i in range(AROUND):
                faces.append(face([sections[i][c], ahead[i], -sections[i + 1][c], back[i]]))
    geo.addVolume([geo.addSurfaceLoop(faces)])
    return rings


def _grade(gmsh: Any, curves: dict[float, list[int]], lengths: Lengths) -> None:
    """Let edges grow from the length at some curves with the distance from them."""
    field, found = gmsh.model.mesh.field, []
    for length, lines in curves.items():
        distance, edge = field.add("Distance"), field.add("Threshold")
        field.setNumbers(distance, "CurvesList", lines)
        field.setNumber(distance, "Sampling", 100)
        reach = max((lengths.size - length) / lengths.growth, length)
        values = {"InField": distance, "SizeMin": length, "SizeMax": lengths.size}
        for name, value in {**values, "DistMin": 0, "DistMax": reach}.items():
            field.setNumber(edge, name, value)
        found.append(edge)
    least = field.add("Min")
    field.setNumbers(least, "FieldsList", found)
    field.setAsBackgroundMesh(least)
    for source in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0)
