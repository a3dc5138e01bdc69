"""Named sets of nodes: chosen by geometry, found by name; the lines, surfaces and cells they stand for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.mesh.kinds import KINDS, part_kind, part_sizes
from ancf_petsc.mesh.mesh import Floats, Group, Integers, Mesh
from ancf_petsc.mesh.parts import outer_sides, rows_in, unique_rows

TOLERANCE = 1e-6
"""Nodes closer to a plane or a box than this times the mesh size are in it."""

Specification = dict[str, Any]


def choose_groups(
    mesh: Mesh, specifications: dict[str, Specification], *, file: str | Path | None = None
) -> dict[str, Group]:
    """The groups a case defines: name -> Group, in the order of the case.

    A specification is {plane, at}, {box}, {nearest} or {union}. Raises CaseError for a name the mesh file
    has too, an empty group, a point far from all nodes, a union of unknown groups or of itself.
    """
    for name in specifications:
        if name in mesh.groups:
            raise CaseError(
                "the mesh file has a group of this name too",
                file=file,
                key=f"groups.{name}",
                cure="give the group of the case another name",
            )
    chosen: dict[str, Group] = {}
    for name in specifications:
        _choose(mesh, name, specifications, chosen, (), file)
    return {name: chosen[name] for name in specifications}


def _choose(
    mesh: Mesh,
    name: str,
    specifications: dict[str, Specification],
    chosen: dict[str, Group],
    above: tuple[str, ...],
    file: str | Path | None,
) -> Group:
    """Group `name` of the case; `above` are the unions it is asked for by."""
    if name in chosen:
        return chosen[name]
    key = f"groups.{name}"
    if name in above:
        raise CaseError(
            "a union of itself", file=file, key=key, got=" -> ".join([*above, name]), cure="break the circle"
        )
    specification = specifications[name]
    if "union" not in specification:
        (shape,) = (shape for shape in CHOICES if shape in specification)
        nodes, sought = CHOICES[shape](mesh, specification, key, file)
        group = Group(name, nodes)
    else:
        known = {**mesh.groups, **dict.fromkeys(specifications)}
        members = []
        for member in specification["union"]:
            if member not in known:
                cure = did_you_mean(member, list(known))
                raise CaseError("no such group", file=file, key=f"{key}.union", got=member, cure=cure)
            own = mesh.groups.get(member)
            members.append(own or _choose(mesh, member, specifications, chosen, (*above, name), file))
        group, sought = _union(mesh, name, members), "its members hold no nodes"
    if not len(group.nodes):
        raise CaseError(f"the group is empty: {sought}", file=file, key=key, cure="choose nodes of the body")
    chosen[name] = group
    return group


def _on_plane(
    mesh: Mesh, specification: Specification, key: str, file: str | Path | None
) -> tuple[Integers, str]:
    """Nodes at a height along an axis or a normal, which is made a unit vector."""
    plane, at = specification["plane"], specification["at"]
    normal = np.eye(3)["xyz".index(plane)] if isinstance(plane, str) else np.array(plane, dtype=float)
    length = np.linalg.norm(normal)
    if not length > 0:
        raise CaseError("the normal has no length", file=file, key=f"{key}.plane", got=plane)
    height = mesh.points @ (normal / length)
    low, high = height[mesh.used].min(), height[mesh.used].max()
    level = {"min": low, "max": high}.get(at, at) if isinstance(at, str) else float(at)
    near = mesh.used & (np.abs(height - level) <= TOLERANCE * mesh.size)
    sought = f"no node at {level:.9g} along {plane}, where the mesh goes from {low:.9g} to {high:.9g}"
    return np.flatnonzero(near), sought


def _in_box(
    mesh: Mesh, specification: Specification, key: str, file: str | Path | None
) -> tuple[Integers, str]:
    """Nodes in a box given by two opposite corners."""
    low, high = np.sort(np.array(specification["box"], dtype=float), axis=0)
    slack = TOLERANCE * mesh.size
    inside = ((mesh.points >= low - slack) & (mesh.points <= high + slack)).all(axis=1) & mesh.used
    return np.flatnonzero(inside), f"no node between {_place(low)} and {_place(high)}; {_extent(mesh)}"


def _nearest(
    mesh: Mesh, specification: Specification, key: str, file: str | Path | None
) -> tuple[Integers, str]:
    """The nodes nearest to a point or to each of several."""
    nodes = np.flatnonzero(mesh.used)
    found = []
    for place in np.atleast_2d(np.array(specification["nearest"], dtype=float)):
        distances = np.linalg.norm(mesh.points[nodes] - place, axis=1)
        node = nodes[distances.argmin()]
        around = mesh.points[mesh.cells[(mesh.cells == node).any(axis=1)].ravel()]
        edge = np.linalg.norm(around - mesh.points[node], axis=1).max()
        if distances.min() > edge:
            raise CaseError(
                f"no node near {_place(place)}: the nearest, {mesh.node_numbers[node]} at "
                f"{_place(mesh.points[node])}, is {distances.min():.6g} away, farther than its longest edge "
                f"{edge:.6g}; {_extent(mesh)}",
                file=file,
                key=f"{key}.nearest",
                cure="give a point on the body",
            )
        found.append(node)
    return np.unique(np.array(found, dtype=np.int64)), "no point is given"


CHOICES: dict[str, Callable[..., tuple[Integers, str]]] = {
    "plane": _on_plane,
    "box": _in_box,
    "nearest": _nearest,
}


def _place(point: Floats) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ")"


def _extent(mesh: Mesh) -> str:
    body = mesh.points[mesh.used]
    return f"the mesh lies between {_place(body.min(axis=0))} and {_place(body.max(axis=0))}"


def _union(mesh: Mesh, name: str, members: Sequence[Group]) -> Group:
    """Nodes and parts of all members. Where some have parts, sets of nodes bring their boundary sides."""
    nodes = np.unique(np.concatenate([group.nodes for group in members]))
    if not any(group.parts for group in members):
        return Group(name, nodes)
    parts: dict[int, list[Integers]] = {}
    for group in members:
        own = group.parts or {_dimension(mesh) - 1: _sides_within(mesh, group.nodes)}
        for dimension, rows in own.items():
            parts.setdefault(dimension, []).append(rows)
    bound = len(mesh.points)
    joined = {d: unique_rows(np.concatenate(rows), bound) for d, rows in sorted(parts.items())}
    return Group(name, nodes, {d: _sorted(rows) for d, rows in joined.items() if len(rows)})


def _sorted(rows: Integers) -> Integers:
    """Rows in an order that does not depend on the order of the members of a union."""
    return rows[np.lexsort(np.sort(rows, axis=1).T[::-1])]


def find_group(mesh: Mesh, name: str, key: str, file: str | Path | None) -> Group:
    """The group of a name; CaseError about `key` where there is none or where it is empty."""
    if name in mesh.refused:
        raise CaseError(mesh.refused[name], file=file, key=key, got=name, cure="mend it in the mesh file")
    group = mesh.groups.get(name)
    if group is None:
        raise CaseError(
            "no such group", file=file, key=key, got=name, cure=did_you_mean(name, list(mesh.groups))
        )
    if not len(group.nodes):
        raise CaseError(
            "the group is empty: the mesh file names it and gives it no part of the body",
            file=file,
            key=key,
            got=name,
            cure="save the mesh with the elements of its physical groups",
        )
    return group


def boundary_faces(mesh: Mesh) -> Integers:
    """Sides (m, corners) of one cell only, oriented outwards: faces of a solid, lines of a plane body."""
    if mesh.boundary is None:
        mesh.boundary = outer_sides(mesh.kind, mesh.cells, len(mesh.points))
    return mesh.boundary


def parts_for_load(mesh: Mesh, group: Group) -> tuple[int, Integers]:
    """What a force on the group is shared over: dimension and parts (m, corners), each once.

    The group's own parts of the highest dimension it has; for a set of nodes the boundary sides whose nodes
    all belong to it; else dimension 0 and its nodes (k,).
    """
    dimension = max(group.parts, default=0)
    if dimension:
        return dimension, group.parts[dimension]
    sides = surface_of(mesh, group)
    return (0, group.nodes) if sides is None else (_dimension(mesh) - 1, sides)


def parts_for_support(mesh: Mesh, group: Group) -> dict[int, Integers]:
    """Parts by dimension that a constraint on the group holds: its own; for a set of nodes the boundary sides whose nodes
    all belong to it, else the edges of boundary sides, else nothing but its nodes."""
    if group.parts:
        return group.parts
    sides = _sides_within(mesh, group.nodes)
    if len(sides):
        return {_dimension(mesh) - 1: sides}
    boundary = boundary_faces(mesh)
    edges = np.stack([boundary, np.roll(boundary, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = edges[_belongs(mesh, group.nodes)[edges].all(axis=1)]
    return {1: unique_rows(edges, len(mesh.points))} if len(edges) and boundary.shape[1] > 2 else {}


def describe_set(mesh: Mesh, group: Group) -> str | None:
    """What a support on a set of nodes of the mesh file holds, in words; None for parts and for a single node."""
    if group.parts or len(group.nodes) < 2:
        return None
    parts = parts_for_support(mesh, group)
    covered = _belongs(
        mesh, np.concatenate([np.empty(0, np.int64), *(rows.ravel() for rows in parts.values())])
    )
    corners = _belongs(mesh, mesh.cells[:, : KINDS[KINDS[mesh.kind].linear or mesh.kind].nodes].ravel())
    loose = np.count_nonzero(corners[group.nodes] & ~covered[group.nodes])
    what = {0: "point", 1: "edge", 2: "face"}
    found = [f"{len(rows)} {what[dimension]}{'s' * (len(rows) > 1)}" for dimension, rows in parts.items()]
    said = f"{group.name}: a set of nodes, taken as the {' and '.join(found)} it covers" if found else ""
    if loose:
        count = (
            f"{loose} of its {len(group.nodes)} nodes belong to no whole face or edge in it: held as points"
        )
        said = f"{said}; {count}" if said else f"{group.name}: a set of nodes; {count}"
    return said or None


def surface_of(mesh: Mesh, group: Group) -> Integers | None:
    """Sides (m, corners) the group consists of, its own or boundary sides; None where it is no surface."""
    dimension = _dimension(mesh) - 1
    sides = group.parts.get(dimension)
    if sides is None and not group.parts:
        sides = _sides_within(mesh, group.nodes)
    return sides if sides is not None and len(sides) else None


def measure(mesh: Mesh, dimension: int, parts: Integers) -> float:
    """Undeformed length, area or volume of parts (m, corners) together."""
    return float(np.abs(part_sizes(mesh.points, parts, part_kind(dimension, parts.shape[1]))).sum())


def cells_of(mesh: Mesh, group: Group) -> Integers:
    """Ascending indices of the cells the name stands for, else that are the group's parts, else with all nodes in it."""
    if group.cells is not None:
        return group.cells
    own = group.parts.get(_dimension(mesh))
    if own is None:
        return np.flatnonzero(_belongs(mesh, group.nodes)[mesh.cells].all(axis=1))
    corners = mesh.cells[:, : own.shape[1]]
    return np.flatnonzero(rows_in(corners, own, len(mesh.points)) >= 0)


def _dimension(mesh: Mesh) -> int:
    return KINDS[mesh.kind].dimension


def _belongs(mesh: Mesh, nodes: Integers) -> np.ndarray:
    belongs = np.zeros(len(mesh.points), dtype=bool)
    belongs[nodes] = True
    return belongs


def _sides_within(mesh: Mesh, nodes: Integers) -> Integers:
    sides = boundary_faces(mesh)
    return sides[_belongs(mesh, nodes)[sides].all(axis=1)]
