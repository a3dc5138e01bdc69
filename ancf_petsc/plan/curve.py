"""output.curve: what the columns force and stroke follow."""

from __future__ import annotations

from dataclasses import dataclass

from ancf_petsc.mesh.groups import surface_of
from ancf_petsc.mesh.mesh import Group
from ancf_petsc.plan.part import Floats, Part

STROKE = "stroke"
"""What the mean position that the stroke follows is called in the model."""


@dataclass(frozen=True)
class CurveChoice:
    """Which group and component the columns `force` and `stroke` follow; area: undeformed, None for no surface."""

    force_group: str
    force_axis: int
    stroke_group: str
    stroke_axis: int
    area: float | None


def choose_curve(part: Part) -> CurveChoice | None:
    """What the case asks for, None if for nothing. Raises CaseError."""
    chosen = part.spec.output.curve
    if chosen is None:
        return None
    group = part.group(chosen.force.group, "output.curve.force")
    part.group(chosen.stroke.group, "output.curve.stroke")
    return CurveChoice(
        chosen.force.group,
        chosen.force.component,
        chosen.stroke.group,
        chosen.stroke.component,
        _area(part, group),
    )


def enter_stroke(part: Part, curve: CurveChoice | None) -> dict[str, Floats]:
    """Weights (v,) of the mean position that the stroke follows."""
    return {STROKE: part.node_mean(part.mesh.groups[curve.stroke_group])} if curve else {}


def _area(part: Part, group: Group) -> float | None:
    """Undeformed area of a group that is a surface; of a plane body the length of its sides times the thickness, of a body of
    revolution what they sweep."""
    d = part.element.cell.dimension
    faces = surface_of(part.mesh, group) if d > 1 else None
    if faces is None:
        return None
    section = part.spec.section
    thickness = section.thickness if section and section.thickness else 1.0
    return part.total(float(part.space.sizes(d - 1, faces).sum())) * thickness
