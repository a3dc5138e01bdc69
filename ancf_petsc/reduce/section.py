"""The section of a body of revolution as a mesh, and the axisymmetric case on it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.gmsh_session import gmsh_session
from ancf_petsc.mesh.kinds import KINDS, determinants
from ancf_petsc.mesh.mesh import Group, Integers, Mesh
from ancf_petsc.reduce.caps import nested
from ancf_petsc.reduce.profile import Profile, profile_of
from ancf_petsc.reduce.revolution import Ring, ring_of
from ancf_petsc.reduce.shape import CLOSE, Floats
from ancf_petsc.reduce.symmetry import Scene
from ancf_petsc.reduce.tables import SmallerCase, tables_and_mesh

STRAIGHT = 0.02
"""Of an edge: points of the section nearer than this to the straight line between others are left out."""
LINEAR = "2312"
ELEMENTS = {"3413": LINEAR}
OTHERWISE = "2-6-1-2"
"""The element of the section for that of the body."""


def reduced_to_section(scene: Scene, size: float | None) -> SmallerCase:
    """The axisymmetric case. size: length of edges, that of the body's by default. Raises CaseError where there is no axis."""
    ring, why = ring_of(scene)
    if ring is None:
        raise CaseError(
            f"the scene is not one of revolution {why}",
            file=scene.case.file,
            key="--to",
            got="section",
            cure="ancf advise lists what it is",
        )
    profile = simplified(profile_of(scene, ring))
    radial, axial = axes_of_section(ring)
    smaller = replace(tables_and_mesh(scene.case, scene.mesh), mesh=meshed(profile, radial, axial, size))
    _fill_tables(smaller, scene, ring, radial, axial)
    return smaller


def axes_of_section(ring: Ring) -> tuple[int, int]:
    """The axes of the smaller case along the radius and along the axis of the ring, which stays what it is where it is one."""
    along = np.abs(ring.axis)
    axial = int(along.argmax()) if along.max() > 1.0 - CLOSE else 2
    return (1 if axial == 0 else 0), axial


def simplified(profile: Profile) -> Profile:
    """A profile without the points that straight lines can do without, and that no group ends at."""
    loops = traced(profile)
    ends = np.zeros(len(profile.points), bool)
    for marks in profile.marks.values():
        ends[marks] = True
    kept, segments, parents = [], [], []
    for points, own in loops:
        labels = (
            np.stack([inside[own] for inside in profile.lines.values()], axis=1)
            if profile.lines
            else np.zeros((len(own), 0), bool)
        )
        fixed = ends[points] | (labels != np.roll(labels, 1, axis=0)).any(axis=1)
        chosen = _corners(profile.points[points], fixed, STRAIGHT * profile.sizes[points])
        first = sum(len(rows) for rows in kept)
        kept.append(points[chosen])
        numbers = first + np.arange(len(chosen))
        segments.append(np.stack((numbers, np.roll(numbers, -1)), axis=1))
        parents.append(own[chosen])
    every, parent = np.concatenate(kept), np.concatenate(parents)
    number = np.full(len(profile.points), -1)
    number[every] = np.arange(len(every))
    return Profile(
        profile.points[every],
        np.concatenate(segments),
        profile.sizes[every],
        {name: inside[parent] for name, inside in profile.lines.items()},
        {name: number[marks] for name, marks in profile.marks.items()},
    )


def traced(profile: Profile) -> list[tuple[Integers, Integers]]:
    """Closed lines: their points (k,) in order, and the segments (k,) from each to the next. Raises CaseError where they branch."""
    n = len(profile.points)
    around = np.bincount(profile.segments.ravel(), minlength=n)
    if (around[around > 0] != 2).any():
        raise CaseError("the section of the body is bounded by no closed lines", key="--to", got="section")
    order = np.argsort(profile.segments.ravel(), kind="stable")
    at = np.full((n, 2), -1)
    at[around > 0] = (order // 2).reshape(-1, 2)
    left = np.ones(len(profile.segments), bool)
    loops = []
    while left.any():
        segment = int(left.argmax())
        node = int(profile.segments[segment, 0])
        points, own = [], []
        while left[segment]:
            left[segment] = False
            points.append(node)
            own.append(segment)
            a, b = profile.segments[segment]
            node = int(b if a == node else a)
            one, other = at[node]
            segment = int(other if one == segment else one)
        loops.append((np.array(points), np.array(own)))
    return loops


def _corners(points: Floats, fixed: Floats, slack: Floats) -> Integers:
    """Indices of the points (k, 2) of a closed line that are kept: fixed ones, and between them (Douglas and Peucker) what departs."""
    start = int(fixed.argmax()) if fixed.any() else int(np.lexsort(points.T)[0])
    order = (start + np.arange(len(points) + 1)) % len(points)
    stops = [0, *(k for k in range(1, len(points)) if fixed[order[k]]), len(points)]
    if len(stops) == 2:
        stops.insert(1, int(np.linalg.norm(points[order] - points[start], axis=1).argmax()))
    kept = {0}
    spans = list(zip(stops, stops[1:], strict=False))
    kept |= set(stops[:-1])
    while spans:
        a, b = spans.pop()
        if b - a < 2:
            continue
        along = points[order[b]] - points[order[a]]
        arms = points[order[a + 1 : b]] - points[order[a]]
        length = max(float(np.linalg.norm(along)), 1e-300)
        off = np.abs(along[0] * arms[:, 1] - along[1] * arms[:, 0]) / length
        k = a + 1 + int(off.argmax())
        if off.max() > slack[order[k]]:
            kept.add(k)
            spans += [(a, k), (k, b)]
    return order[sorted(kept)]


def meshed(profile: Profile, radial: int, axial: int, size: float | None) -> Mesh:
    """Triangles of a profile, radius and height along axes, with its groups. size: length of edges; None: what the profile says."""
    loops = traced(profile)
    sizes = profile.sizes if size is None else np.full(len(profile.points), size)
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
        ends = [int(mesh.getNodes(0, k + 1)[0][0]) for k in range(len(profile.points))]
    order = np.argsort(tags)
    used, cells = np.unique(np.searchsorted(tags[order], corners), return_inverse=True)
    compact = np.full(len(tags), -1)
    compact[used] = np.arange(len(used))

    def index(found: Any) -> Integers:
        return compact[np.searchsorted(tags[order], found)].astype(np.int64)

    flat = places.reshape(-1, 3)[order[used], :2]
    points = np.zeros((len(used), 3))
    points[:, radial], points[:, axial] = flat.T
    groups = {}
    for name, inside in profile.lines.items():
        rows = np.concatenate([index(lines[k]).reshape(-1, 2) for k in np.flatnonzero(inside)])
        groups[name] = Group(name, np.unique(rows), {1: rows})
    for name, marks in profile.marks.items():
        nodes = np.unique(index(np.array(ends)[marks]))
        groups[name] = Group(name, nodes, {0: nodes[:, None]})
    return Mesh(
        points=points,
        kind="triangle",
        cells=_oriented(points, cells.reshape(-1, 3)),
        groups=groups,
        node_numbers=1 + np.arange(len(used)),
        cell_numbers=1 + np.arange(cells.size // 3),
        used=np.ones(len(used), bool),
    )


def _oriented(points: Floats, cells: Integers) -> Integers:
    """Triangles (e, 3) seen counterclockwise from the positive side of the axis across them."""
    back = determinants(points, cells, KINDS["triangle"])[:, 0] < 0
    return np.where(back[:, None], cells[:, [0, 2, 1]], cells)


def _fill_tables(smaller: SmallerCase, scene: Scene, ring: Ring, radial: int, axial: int) -> None:
    data, spec = smaller.data, scene.case.spec
    data["title"] = f"{data['title']}, section"
    data["mesh"] = {"element": ELEMENTS.get(spec.mesh.element, OTHERWISE)}
    data["section"] = {"plane": "axisymmetric", "axis": AXES[axial]}
    if not ring.is_whole:
        data["section"]["angle"] = float(np.degrees(ring.angle))
    data["constraint"] = _supports(scene, ring, radial, axial)
    loads = []
    for load in data.get("load", []):
        key = "total" if load["type"] == "force" else "acceleration"
        amount = [0.0, 0.0, 0.0]
        amount[axial] = float(np.array(load[key]) @ ring.axis)
        loads.append({**load, key: amount})
    data["load"] = loads
    if spec.initial:
        velocity = [0.0, 0.0, 0.0]
        velocity[axial] = float(np.array(spec.initial.velocity) @ ring.axis)
        data["initial"] = {"velocity": velocity}
    _outputs(smaller, ring, axial)
    for key in ("load", "constraint"):
        if not data[key]:
            del data[key]


def _supports(scene: Scene, ring: Ring, radial: int, axial: int) -> list[dict[str, Any]]:
    """What the supports hold and move along the radius and the axis; those on the planes of the sector are no longer needed."""
    across = np.linalg.svd(ring.axis[None])[2][1]
    rows = []
    for action in scene.actions:
        if action.kind != "support" or action.key in ring.walls:
            continue
        amount = float(action.amount @ ring.axis)
        fix = [AXES[radial]] if np.linalg.norm(action.held @ across) > CLOSE else []
        move = {}
        if np.linalg.norm(action.held @ ring.axis) > CLOSE:
            fix, move = (fix, {AXES[axial]: amount}) if amount else ([*fix, AXES[axial]], {})
        for name in action.groups:
            row: dict[str, Any] = {"group": name, "fix": sorted(fix)} if fix else {"group": name}
            if move:
                row |= {"move": move, "ramp": action.ramp}
            if row not in rows:
                rows.append(row)
    return rows


def _outputs(smaller: SmallerCase, ring: Ring, axial: int) -> None:
    """The curve where it follows the axis, probes of groups that the section has."""
    data, groups = smaller.data, smaller.mesh.groups
    curve = data.get("output", {}).get("curve")
    if curve:
        for key, direction in curve.items():
            group, _, axis = direction.rpartition(".")
            if group not in groups or abs(ring.axis[AXES.index(axis)]) < 1.0 - CLOSE:
                smaller.notes.append(
                    f"output.curve.{key}: {direction} is no direction along the axis of a group of the section: left out"
                )
                data["output"].pop("curve", None)
            else:
                curve[key] = f"{group}.{AXES[axial]}"
    probes = data.pop("probe", [])
    kept = [row for row in probes if row["group"] in groups]
    smaller.notes.extend(
        f"probe {row['name']}: {row['group']} is none of the section's groups: left out"
        for row in probes
        if row not in kept
    )
    smaller.notes.extend(
        f"probe {row['name']}: the mean over the section, of radius and height" for row in kept
    )
    if kept:
        data["probe"] = kept
