"""Prescribed displacements."""

from __future__ import annotations

from dataclasses import dataclass

from ancf_petsc.model.ramp import Ramp


@dataclass(frozen=True)
class Drive:
    """A prescribed displacement: amplitude times ramp. Held degrees of freedom have amplitude 0."""

    amplitude: float
    ramp: Ramp

    def value(self, s: float) -> float:
        """The displacement at pseudo-time s."""
        return self.amplitude * self.ramp.value(s)

    def describe(self) -> str:
        """In words."""
        return f"moved by {self.amplitude:g} ({self.ramp.kind})" if self.amplitude else "held"


HELD = Drive(0.0, Ramp("constant"))
