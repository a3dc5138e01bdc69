"""The section of a body as a mesh of triangles, by Gmsh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ancf_petsc.mesh.gmsh_session import gmsh_session
from ancf_petsc.mesh.kinds import KINDS, determinants
from ancf_petsc.mesh.mesh import Group, Integers, Mesh
from ancf_petsc.reduce.caps import nested
from ancf_petsc.reduce.profile import Profile
from ancf_petsc.reduce.profile_lines import traced
from ancf_petsc.reduce.shape import Floats


class _Triangles(NamedTuple):
    """points (n, 2). cells (e, 3). lines: of each segment of the profile, its parts (m, 2). ends (k,): nodes at its points."""

    points: Floats
    cells: Integers
    lines: list[Integers]
    ends: Integers


def meshed(profile: Profile, radial: int, axial: int, size: float | None) -> Mesh:
    """Triangles of a profile, radius and height along axes, with its groups. size: of edges; None: what the profile says."""
    found = _triangles(profile, profile.sizes if size is None else np.full(len(profile.points), size))
    points = np.zeros((len(found.points), 3))
    points[:, radial], points[:, axial] = found.points.T
    groups = {}
    for name, inside in profile.lines.items():
        rows = np.concatenate([found.lines[k] for k in np.flatnonzero(inside)])
        groups[name] = Group(name, np.unique(rows), {1: rows})
    for name, marks in profile.marks.items():
        nodes = np.unique(found.ends[marks])
        groups[name] = Group(name, nodes, {0: nodes[:, None]})
    return Mesh(
        points=points,
        kind="triangle",
        cells=_oriented(points, found.cells),
        groups=groups,
        node_numbers=1 + np.arange(len(points)),
        cell_numbers=1 + np.arange(len(found.cells)),
        used=np.ones(len(points), bool),
    )


def _triangles(profile: Profile, sizes: Floats) -> _Triangles:
    """By Gmsh. sizes (k,): lengths of edges at the points of the profile."""
    loops = traced(profile)
    with gmsh_session() as gmsh:
        geo, mesh = gmsh.model.geo, gmsh.model.mesh
        for k, ((radius, height), length) in enumerate(zip(profile.points, sizes, strict=True)):
            geo.addPoint(radius, height, 0.0, float(length), k + 1)
        for k, (a, b) in enumerate(profile.segments):
            geo.addLine(int(a) + 1, int(b) + 1, k + 1)
        curves = []
        for points, own in loops:
            sign = np.where(profile.segments[own, 0] == points, 1, -1)
            curves.append(geo.addCurveLoop((sign * (own + 1)).tolist()))
        for outer, *holes in nested([profile.points[points] for points, _ in loops]):
            geo.addPlaneSurface([curves[outer], *(curves[hole] for hole in holes)])
        geo.synchronize()
        mesh.generate(2)
        tags, places, _ = mesh.getNodes()
        _, corners = mesh.getElementsByType(KINDS["triangle"].gmsh)
        lines = [mesh.getElementsByType(KINDS["line"].gmsh, k + 1)[1] for k in range(len(profile.segments))]
        ends = np.array([int(mesh.getNodes(0, k + 1)[0][0]) for k in range(len(profile.points))])
    order = np.argsort(tags)
    used, cells = np.unique(np.searchsorted(tags[order], corners), return_inverse=True)
    number = np.full(len(tags), -1)
    number[used] = np.arange(len(used))
    parts = [number[np.searchsorted(tags[order], own)].reshape(-1, 2) for own in lines]
    points = places.reshape(-1, 3)[order[used], :2]
    return _Triangles(points, cells.reshape(-1, 3), parts, number[np.searchsorted(tags[order], ends)])


def _oriented(points: Floats, cells: Integers) -> Integers:
    """Triangles (e, 3) seen counterclockwise from the positive side of the axis across them."""
    back = determinants(points, cells, KINDS["triangle"])[:, 0] < 0
    return np.where(back[:, None], cells[:, [0, 2, 1]], cells)
