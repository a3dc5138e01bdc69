"""The tables of a smaller case: what of a case's supports, loads and outputs goes on, and with what amounts."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.input import toml
from ancf_petsc.input.load import Case
from ancf_petsc.mesh.groups import cells_of, parts_for_load, parts_for_support, surface_of
from ancf_petsc.mesh.kinds import KINDS, part_kind, part_sizes
from ancf_petsc.mesh.mesh import Group, Integers, Mesh
from ancf_petsc.reduce.shape import CLOSE, Floats
from ancf_petsc.reduce.symmetry import MirrorPlane

HALF = 0.5


@dataclass
class SmallerCase:
    """data: tables of the smaller case. mesh: of it. notes: what is no longer what it was."""

    data: dict[str, Any]
    mesh: Mesh
    notes: list[str] = field(default_factory=list)

    def text(self, mesh_file: str) -> str:
        """The case as TOML, with its mesh in a file beside it."""
        own = self.data["mesh"]
        table = {
            "file": mesh_file,
            **{name: own[name] for name in ("element", "rule", "duplicates") if name in own},
        }
        return toml.write({**self.data, "mesh": table}).rstrip() + "\n"


def tables_and_mesh(case: Case, mesh: Mesh) -> SmallerCase:
    """A case's tables on its own mesh: its groups are groups of the mesh; what materials and forces take of them gets its own.

    A set of nodes may be edges to a support and points to a force.
    """
    data = deepcopy(toml.parse(case.text))
    data.pop("groups", None)
    groups = {name: Group(name, group.nodes, _parts_of(mesh, group)) for name, group in mesh.groups.items()}
    dimension = KINDS[mesh.kind].dimension
    for row in data["material"] if isinstance(data["material"], list) else [data["material"]]:
        group = mesh.groups.get(row.get("group", ""))
        if group is not None and (dimension not in group.parts or group.cells is not None):
            cells = mesh.cells[cells_of(mesh, group), : KINDS[mesh.kind].nodes]
            row["group"] = free_name(mesh, f"elements of {group.name}")
            groups[row["group"]] = Group(row["group"], np.unique(cells), {dimension: cells})
    for load in data.get("load", []):
        group = mesh.groups.get(load.get("group", ""))
        if group is not None and not group.parts and not parts_for_load(mesh, group)[0]:
            load["group"] = free_name(mesh, f"points of {group.name}")
            groups[load["group"]] = Group(load["group"], group.nodes, {0: group.nodes[:, None]})
    return SmallerCase(data, replace(mesh, groups=groups))


def _parts_of(mesh: Mesh, group: Group) -> dict[int, Integers]:
    """What a group is taken for on the whole body: faces that a cut makes shall not be of a set of nodes."""
    if group.parts:
        return group.parts
    dimension, rows = parts_for_load(mesh, group)
    return {dimension: rows} if dimension else parts_for_support(mesh, group) or {0: group.nodes[:, None]}


def free_name(mesh: Mesh, name: str) -> str:
    """A name that no group has."""
    return next(word for word in (name, *(f"{name}_{k}" for k in range(2, 10**6))) if word not in mesh.groups)


def halve(smaller: SmallerCase, before: Mesh, plane: MirrorPlane, name: str, support: dict[str, Any]) -> None:
    """Let the tables be those of the part of `before` on the side of a plane's normal, with the group `name` on the plane."""
    data = smaller.data
    data["load"] = [
        entry for load in data.get("load", []) for entry in _halved(smaller, before, plane, name, load)
    ]
    data["constraint"] = [
        row
        for row in data.get("constraint", [])
        if _left(smaller, row["group"], f"constraint.{row['group']}")
    ]
    data["constraint"].append({"group": name, **support})
    _outputs(smaller, before, plane)
    if isinstance(data["material"], list):
        data["material"] = [
            row for row in data["material"] if "group" not in row or _left(smaller, row["group"], "")
        ]
    for key in ("load", "constraint"):
        if not data[key]:
            del data[key]


def _left(smaller: SmallerCase, name: str, key: str) -> bool:
    """Whether anything of a group is left."""
    if len(smaller.mesh.groups[name].nodes):
        return True
    if key:
        smaller.notes.append(f"{key}: nothing of {name} is in the part that is kept")
    return False


def _halved(
    smaller: SmallerCase, before: Mesh, plane: MirrorPlane, name: str, load: dict[str, Any]
) -> list[dict[str, Any]]:
    """A load on the part: forces in proportion to what is left of the group; what lies on the plane itself counts half."""
    if load["type"] != "force":
        return [load]
    group, size = load["group"], CLOSE * before.size
    if group not in smaller.mesh.groups:
        raise CaseError(
            "a force acts in a plane of symmetry, and the part is meshed anew",
            key="--to",
            got=group,
            expected="faces of elements on the plane",
            cure="mesh the body in two halves",
        )
    whole = sum(_measures(before, before.groups[group], plane, size))
    kept, on_plane = _measures(smaller.mesh, smaller.mesh.groups[group], plane, size)
    total = np.array(load["total"], dtype=float)
    found = []
    if kept > 0:
        found.append({**load, "total": (total * (kept / whole)).tolist()})
    if on_plane > 0:
        within = total - (total @ plane.normal) * plane.normal
        beside, own = _split(smaller.mesh, group, plane, size, name)
        if 0 in own.parts and surface_of(smaller.mesh, Group(own.name, own.nodes)) is not None:
            raise CaseError(
                "points in the plane of symmetry carry a force, and together they are faces of the part that is kept",
                key="--to",
                got=group,
                expected="a force that is not on points of the whole plane",
                cure="give the force to a surface or a line",
            )
        smaller.mesh.groups |= {part.name: part for part in (beside, own)}
        if kept > 0:
            found[0]["group"] = beside.name
        found.append({**load, "group": own.name, "total": (within * (HALF * on_plane / whole)).tolist()})
    if not found:
        smaller.notes.append(f"a force on {group}: nothing of it is in the part that is kept")
    return found


def _measures(mesh: Mesh, group: Group, plane: MirrorPlane, slack: float) -> tuple[float, float]:
    """Length, area or number of what a force on the group is shared over: of what is not on the plane, and of what is."""
    if not len(group.nodes):
        return 0.0, 0.0
    dimension, parts = parts_for_load(mesh, group)
    sizes = _sizes(mesh.points, dimension, parts)
    flat = (np.abs(plane.heights(mesh.points)[parts].reshape(len(parts), -1)) <= slack).all(axis=1)
    return float(sizes[~flat].sum()), float(sizes[flat].sum())


def _sizes(points: Floats, dimension: int, parts: Any) -> Floats:
    if dimension == 0:
        return np.ones(len(parts))
    return np.abs(part_sizes(points, parts, part_kind(dimension, parts.shape[1])))


def _split(mesh: Mesh, name: str, plane: MirrorPlane, slack: float, on: str) -> tuple[Group, Group]:
    """What a force on a group is shared over, beside the plane and on it, as groups."""
    dimension, parts = parts_for_load(mesh, mesh.groups[name])
    parts = parts.reshape(len(parts), -1)
    flat = (np.abs(plane.heights(mesh.points)[parts]) <= slack).all(axis=1)
    one, other = (
        Group(own, np.unique(rows), {dimension: rows})
        for own, rows in ((f"{name} off {on}", parts[~flat]), (f"{name} on {on}", parts[flat]))
    )
    return one, other


def _outputs(smaller: SmallerCase, before: Mesh, plane: MirrorPlane) -> None:
    """output.symmetry doubles where the curve's force is of a group that the plane divides; probes go on where their group does."""
    data, slack = smaller.data, CLOSE * before.size
    output = data.setdefault("output", {})
    curve = output.get("curve")
    divided = True
    if curve:
        group, _, axis = curve["force"].rpartition(".")
        divided = _is_halved(before, group, plane, slack)
        if divided and plane.axis == AXES.index(axis):
            smaller.notes.append(
                f"output.curve.force: along {axis}, across the plane, forces of both parts cancel in the whole body"
            )
    if divided:
        output["symmetry"] = 2 * output.get("symmetry", 1)
    else:
        smaller.notes.append(
            "output.symmetry stays: the group of output.curve.force does not go on beyond the plane; energies and work are those "
            "of the part, and of what the group has on the plane itself only half the force is counted"
        )
    kept = [row for row in data.get("probe", []) if _left(smaller, row["group"], f"probe.{row['name']}")]
    smaller.notes.extend(
        f"probe {row['name']}: the mean of the part of {row['group']} that is kept, whose component across the plane is its own"
        for row in kept
        if _is_divided(before, row["group"], plane, slack)
    )
    if kept:
        data["probe"] = kept
    else:
        data.pop("probe", None)


def _is_halved(mesh: Mesh, group: str, plane: MirrorPlane, slack: float) -> bool:
    """Whether the part has half of a group's reaction: of one that goes on beyond the plane, or that lies on it."""
    heights = plane.heights(mesh.points[mesh.groups[group].nodes])
    return _is_divided(mesh, group, plane, slack) or bool(np.abs(heights).max() <= slack)


def _is_divided(mesh: Mesh, group: str, plane: MirrorPlane, slack: float) -> bool:
    """Whether a group has nodes on both sides of a plane."""
    heights = plane.heights(mesh.points[mesh.groups[group].nodes])
    return bool(heights.min() < -slack and heights.max() > slack)
