"""Closing a surface that was cut by a plane, and filling a closed surface with tetrahedra, both by Gmsh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.gmsh_session import gmsh_session
from ancf_petsc.mesh.kinds import KINDS, part_sizes
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.reduce.symmetry import MirrorPlane

FILLED = 1e-6
"""Relative difference of volumes up to which tetrahedra fill a surface."""


def cap(points: Floats, facets: Integers, plane: MirrorPlane) -> tuple[Integers, Floats]:
    """Triangles (c, 3) that close facets (t, 3) in a plane, seen from outside counterclockwise, and the points (k, 3) they add."""
    loops = _loops(facets)
    axes = np.linalg.svd(plane.normal[None])[2][1:].T
    flat = [(points[loop] - plane.point) @ axes for loop in loops]
    boundary = np.concatenate(loops)
    with gmsh_session() as gmsh:
        geo, mesh = gmsh.model.geo, gmsh.model.mesh
        for node, (u, v) in zip(boundary.tolist(), np.concatenate(flat), strict=True):
            geo.addPoint(u, v, 0.0, tag=node + 1)
        curves = []
        for loop in loops:
            ends = zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
            lines = [geo.addLine(a + 1, b + 1) for a, b in ends]
            for line in lines:
                geo.mesh.setTransfiniteCurve(line, 2)
            curves.append(geo.addCurveLoop(lines))
        for outer, *holes in nested(flat):
            geo.addPlaneSurface([curves[outer], *(curves[hole] for hole in holes)])
        geo.synchronize()
        mesh.generate(2)
        _, corners = mesh.getElementsByType(KINDS["triangle"].gmsh)
        tags, places, _ = mesh.getNodes()
        own = np.concatenate([mesh.getNodes(0, node + 1)[0] for node in boundary.tolist()])
    number = np.zeros(int(tags.max()) + 1, np.int64)
    inner = ~np.isin(tags, own)
    number[tags[inner]] = len(points) + np.arange(inner.sum())
    number[own] = boundary
    new = plane.point + places.reshape(-1, 3)[inner, :2] @ axes.T
    covers = number[corners.astype(np.int64)].reshape(-1, 3)
    a, b, c = (np.concatenate((points, new))[covers[:, k]] for k in range(3))
    inwards = np.cross(b - a, c - a) @ plane.normal > 0
    covers[inwards] = covers[inwards][:, ::-1]
    return covers, new


def _loops(facets: Integers) -> list[Integers]:
    """Closed lines of nodes along the edges that one facet only has. Raises CaseError where there are none or they branch."""
    edges = np.stack([facets, np.roll(facets, -1, axis=1)], axis=-1).reshape(-1, 2)
    bound = int(facets.max()) + 1
    keys, reverse = edges[:, 0] * bound + edges[:, 1], edges[:, 1] * bound + edges[:, 0]
    free = edges[~np.isin(keys, reverse)]
    order = np.argsort(free[:, 0], kind="stable")
    starts, ends = free[order].T
    same = len(np.unique(starts)) == len(starts) and np.array_equal(np.sort(ends), starts)
    if not len(free) or not same:
        raise CaseError(
            "the cut through the body is no set of closed lines",
            key="--to",
            cure="mesh the body in two halves",
        )
    after = np.searchsorted(starts, ends)
    loops, left = [], np.ones(len(starts), bool)
    while left.any():
        first = place = int(left.argmax())
        loop = []
        while left[place]:
            left[place] = False
            loop.append(place)
            place = int(after[place])
        assert place == first
        loops.append(starts[np.array(loop)])
    return loops


def nested(polygons: Sequence[Floats]) -> list[list[int]]:
    """Which of polygons (k, 2) that do not cross bound a region: its outer one, then those of its holes."""
    inside = np.array(
        [[i != j and _contains(b, a[0]) for j, b in enumerate(polygons)] for i, a in enumerate(polygons)]
    )
    depth = inside.sum(axis=1)
    return [
        [i, *(j for j in range(len(polygons)) if depth[j] == depth[i] + 1 and inside[j, i])]
        for i in range(len(polygons))
        if depth[i] % 2 == 0
    ]


def _contains(polygon: Floats, point: Floats) -> bool:
    """Whether a point (2,) is in a polygon (k, 2): a ray from it crosses an odd number of sides."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    across = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[across], b[across]
    left = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool((left > point[0]).sum() % 2)


def fill(points: Floats, facets: Integers, longest: float, volume: float) -> tuple[Floats, Integers]:
    """Points after those given, and tetrahedra (e, 4) that fill a closed surface. longest: edge. Raises CaseError."""
    used, corners = np.unique(facets, return_inverse=True)
    options = {"Mesh.MeshSizeMax": longest, "Mesh.OptimizeNetgen": 1.0, "Mesh.Renumber": 0.0}
    with gmsh_session(**options) as gmsh:
        gmsh.model.addDiscreteEntity(2, 1)
        gmsh.model.mesh.addNodes(2, 1, used + 1, points[used].ravel())
        gmsh.model.mesh.addElementsByType(1, KINDS["triangle"].gmsh, [], (used[corners.ravel()] + 1))
        gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([1])])
        gmsh.model.geo.synchronize()
        try:
            gmsh.model.mesh.generate(3)
            tags, places, _ = gmsh.model.mesh.getNodes(3, -1)
            _, nodes = gmsh.model.mesh.getElementsByType(KINDS["tetra"].gmsh)
        except Exception as error:
            raise CaseError(
                f"Gmsh cannot fill the part that is kept ({error})", key="--to", cure="refine the mesh"
            ) from None
    number = np.zeros(max(int(tags.max(initial=0)), len(points)) + 1, np.int64)
    number[1 : len(points) + 1] = np.arange(len(points))
    number[tags.astype(np.int64)] = len(points) + np.arange(len(tags))
    everything = np.concatenate((points, places.reshape(-1, 3)))
    cells = number[nodes.astype(np.int64)].reshape(-1, 4)
    filled = float(np.abs(part_sizes(everything, cells, KINDS["tetra"])).sum()) if len(cells) else 0.0
    if abs(filled - volume) > FILLED * volume:
        raise CaseError(
            "Gmsh does not fill the part that is kept", key="--to", cure="mesh the body in two halves"
        )
    return everything, cells
