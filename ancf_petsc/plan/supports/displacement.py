"""`fix` and `move`: components of a group's positions that are held or follow a ramp."""

from __future__ import annotations

from ancf_petsc.axes import AXES
from ancf_petsc.input.schema import ConstraintSpec
from ancf_petsc.model.drive import Drive
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.supports.table import SupportTable


def enter(spec: ConstraintSpec, part: Part, table: SupportTable) -> None:
    """Prescribe the components named."""
    ramp = part.ramps.of_support(spec.ramp)
    drives = {AXES.index(axis): Drive(0.0, ramp) for axis in spec.fix if axis != "normal"}
    drives |= {AXES.index(axis): Drive(amount, ramp) for axis, amount in spec.move.items()}
    if drives:
        table.prescribe(part.group(spec.group, f"constraint.{spec.group}.group"), drives)
