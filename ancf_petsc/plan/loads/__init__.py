"""Loads: what [[load]] says, a file for each type of it."""

from __future__ import annotations

from typing import Any, Protocol

from ancf_petsc.model.body import Body, Floats
from ancf_petsc.model.load import Load
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.plan.loads import force, gravity
from ancf_petsc.plan.part import Part


class LoadKind(Protocol):
    """A module of this folder. spec: the entry's table, from input/loads.py."""

    def enter(self, spec: Any, part: Part, key: str) -> Floats | None:
        """Check the entry, whose key is given, on a part of the mesh. Returns numbers (v,) over its nodal vectors, or None."""

    def share(self, spec: Any, body: Body, entered: Floats | None, ramp: Ramp) -> Load:
        """The load on this rank's part of the body. entered (n,): what `enter` returned, of owned nodal vectors."""


KINDS: dict[str, LoadKind] = {"force": force, "gravity": gravity}


def enter_loads(part: Part) -> dict[int, Floats]:
    """What the loads enter, by their number in the case."""
    entered = {
        number: KINDS[spec.type].enter(spec, part, f"load.{number}")
        for number, spec in enumerate(part.spec.load)
    }
    return {number: table for number, table in entered.items() if table is not None}
