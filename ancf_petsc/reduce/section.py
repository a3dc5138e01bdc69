"""The section of a body of revolution as a mesh, and the axisymmetric case on it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.reduce.profile import profile_of
from ancf_petsc.reduce.profile_lines import simplified
from ancf_petsc.reduce.profile_mesh import meshed
from ancf_petsc.reduce.revolution import Ring, acting_on, ring_of
from ancf_petsc.reduce.shape import CLOSE
from ancf_petsc.reduce.symmetry import SceneModel
from ancf_petsc.reduce.tables import SmallerCase, tables_and_mesh

LINEAR = "2312"
ELEMENTS = {"3413": LINEAR}
OTHERWISE = "2-6-1-2"
"""The element of the section for that of the body."""
MEANS = {"section": "of radius and height", "wedge": "whose components across the axis are its own"}


def reduced_to_section(scene: SceneModel, size: float | None) -> SmallerCase:
    """The axisymmetric case. size: length of edges, that of the body's by default. Raises CaseError where there is no axis."""
    ring = ring_or_refuse(scene, "section")
    profile = simplified(profile_of(scene, ring))
    radial, axial = axes_of_section(ring)
    smaller = replace(tables_and_mesh(scene.case, scene.mesh), mesh=meshed(profile, radial, axial, size))
    _fill_tables(smaller, scene, ring, radial, axial)
    require_groups(smaller, scene)
    return smaller


def ring_or_refuse(scene: SceneModel, to: str) -> Ring:
    """The ring that a scene is a sector of. Raises CaseError, with the reason, where it is none."""
    ring, why = ring_of(scene)
    if ring is None:
        raise CaseError(
            f"the scene is not one of revolution {why}",
            file=scene.case.file,
            key="--to",
            got=to,
            cure="ancf advise lists what it is",
        )
    return ring


def require_groups(smaller: SmallerCase, scene: SceneModel) -> None:
    """Raise CaseError where something acts on a group that the new mesh lacks: points on the axis, of which it need have none."""
    for name, rows in (
        ("constraint", smaller.data.get("constraint", [])),
        ("load", smaller.data.get("load", [])),
    ):
        for number, row in enumerate(rows):
            group = row.get("group")
            if group is not None and (
                group not in smaller.mesh.groups or not len(smaller.mesh.groups[group].nodes)
            ):
                raise CaseError(
                    "it acts on points, and the part is meshed anew",
                    file=scene.case.file,
                    key=f"{name}.{group if name == 'constraint' else number}",
                    got=group,
                    expected="faces, or edges around the axis",
                    cure="give it to a face, or take --to quarter",
                )


def axes_of_section(ring: Ring) -> tuple[int, int]:
    """The axes of the smaller case along the radius and along the axis of the ring, which stays what it is where it is one."""
    along = np.abs(ring.axis)
    axial = int(along.argmax()) if along.max() > 1.0 - CLOSE else 2
    return (1 if axial == 0 else 0), axial


def _fill_tables(smaller: SmallerCase, scene: SceneModel, ring: Ring, radial: int, axial: int) -> None:
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
    follow_axis(smaller, ring, axial, "section")
    for key in ("load", "constraint"):
        if not data[key]:
            del data[key]


def _supports(scene: SceneModel, ring: Ring, radial: int, axial: int) -> list[dict[str, Any]]:
    """What the supports hold and move along the radius and the axis; those on the planes of the sector are no longer needed."""
    across = np.linalg.svd(ring.axis[None])[2][1]
    rows = []
    for action in acting_on(scene, ring):
        if action.kind != "support":
            continue
        amount = float(action.amount @ ring.axis)
        fix = [AXES[radial]] if np.linalg.norm(action.held @ across) > CLOSE else []
        move: dict[str, float] = {}
        if np.linalg.norm(action.held @ ring.axis) > CLOSE:
            fix, move = (fix, {AXES[axial]: amount}) if amount else ([*fix, AXES[axial]], {})
        for name in action.groups:
            row: dict[str, Any] = {"group": name, "fix": sorted(fix)} if fix else {"group": name}
            if move:
                row |= {"move": move, "ramp": action.ramp}
            if row not in rows:
                rows.append(row)
    return rows


def follow_axis(smaller: SmallerCase, ring: Ring, axial: int, part: str) -> None:
    """The curve where it follows the axis, probes of groups that the part, a section or a wedge, has."""
    data, groups = smaller.data, smaller.mesh.groups
    curve = data.get("output", {}).get("curve")
    if curve:
        for key, direction in curve.items():
            group, _, axis = direction.rpartition(".")
            if group not in groups or abs(ring.axis[AXES.index(axis)]) < 1.0 - CLOSE:
                smaller.notes.append(
                    f"output.curve.{key}: {direction} is no direction along the axis of a group of the {part}: left out"
                )
                data["output"].pop("curve", None)
            else:
                curve[key] = f"{group}.{AXES[axial]}"
    probes = data.pop("probe", [])
    kept = [row for row in probes if row["group"] in groups]
    smaller.notes.extend(
        f"probe {row['name']}: {row['group']} is none of the {part}'s groups: left out"
        for row in probes
        if row not in kept
    )
    smaller.notes.extend(f"probe {row['name']}: the mean over the {part}, {MEANS[part]}" for row in kept)
    if kept:
        data["probe"] = kept
