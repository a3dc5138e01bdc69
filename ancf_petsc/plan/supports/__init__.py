"""Supports: what [[constraint]] says, a file for each kind of it."""

from __future__ import annotations

from collections.abc import Callable

from ancf_petsc.errors import CaseError
from ancf_petsc.input.schema import ConstraintSpec
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.supports import displacement, held_slopes
from ancf_petsc.plan.supports.table import SupportTable

KINDS: list[Callable[[ConstraintSpec, Part, SupportTable], None]] = [displacement.enter, held_slopes.enter]
"""enter(spec, part, table): each looks for its own keys in one [[constraint]]."""


def enter_supports(part: Part) -> SupportTable:
    """All supports in one table. Raises CaseError where two contradict each other."""
    table = SupportTable(part)
    try:
        for spec in part.spec.constraint:
            for enter in KINDS:
                enter(spec, part, table)
        table.finish()
    except CaseError as error:
        error.file = error.file or part.file
        raise
    return table
