"""Supports: what [[constraint]] says, a file for each kind of it."""

from __future__ import annotations

from collections.abc import Callable

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.input.schema import ConstraintSpec
from ancf_petsc.mesh.groups import describe_set
from ancf_petsc.model.drive import HELD
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.revolution import axis_group
from ancf_petsc.plan.supports import displacement, held_slopes, normal
from ancf_petsc.plan.supports.table import SupportTable

KINDS: list[Callable[[ConstraintSpec, Part, SupportTable], None]] = [
    displacement.enter,
    normal.enter,
    held_slopes.enter,
]
"""enter(spec, part, table): each looks for its own keys in one [[constraint]]."""


def enter_supports(part: Part) -> SupportTable:
    """All supports in one table. Raises CaseError where two contradict each other."""
    table = SupportTable(part)
    _hold_axis(part, table)
    try:
        for spec in part.spec.constraint:
            for enter in KINDS:
                enter(spec, part, table)
            _note_set(spec, part)
        table.finish()
    except CaseError as error:
        error.file = error.file or part.file
        raise
    return table


def _hold_axis(part: Part, table: SupportTable) -> None:
    """Nodes on the axis of a body of revolution stay on it: their radius would leave a hole or turn inside out."""
    group = axis_group(part.space, part.revolution) if part.revolution else None
    if group is not None:
        assert part.revolution
        table.prescribe(group, {part.revolution.radial: HELD})
        part.mesh.notes.append(
            f"{len(group.nodes)} nodes lie on the axis of revolution: their component {AXES[part.revolution.radial]} is held"
        )


def _note_set(spec: ConstraintSpec, part: Part) -> None:
    """Say what a set of nodes of the mesh file is taken for, where the element has more than corners to hold."""
    row = part.element
    if spec.group in part.spec.groups or not (row.has_slopes or len(row.nodes) > len(row.cell.corners)):
        return
    note = describe_set(part.mesh, part.group(spec.group, f"constraint.{spec.group}.group"))
    if note and note not in part.mesh.notes:
        part.mesh.notes.append(note)
