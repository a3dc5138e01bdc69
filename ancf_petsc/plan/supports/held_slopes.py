"""`slopes`: components of the slopes of a group's nodes that are held."""

from __future__ import annotations

from ancf_petsc.axes import AXES
from ancf_petsc.input.schema import ConstraintSpec
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.slopes import slopes_at
from ancf_petsc.plan.supports.table import SupportTable


def enter(spec: ConstraintSpec, part: Part, table: SupportTable) -> None:
    """Hold the components named."""
    group = part.group(spec.group, f"constraint.{spec.group}.group")
    for axis in spec.slopes:
        table.hold(slopes_at(part.space, group.nodes), AXES.index(axis))
