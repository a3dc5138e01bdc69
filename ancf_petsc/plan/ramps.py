"""The ramps of a case on its time points: corners and outputs that differ by rounding are one point."""

from __future__ import annotations

from pathlib import Path

from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.model.ramp import CLOSE, Ramp, make_ramp, nearest_points
from ancf_petsc.plan.outputs import output_points


class Ramps:
    """Makes the ramps of a case, with their corners on the outputs and on each other. Raises CaseError as `output_points` does."""

    def __init__(self, spec: CaseSpec, file: Path | None) -> None:
        points = output_points(spec, file)
        tables = [row.ramp for row in (*spec.constraint, *spec.load) if not isinstance(row.ramp, str)]
        self._places = nearest_points((s for table in tables for s, _ in table), points, CLOSE / len(points))
        self._of_loads = "linear" if spec.statics else "constant"

    def of_support(self, given: str | tuple | None) -> Ramp:
        """The ramp of a [[constraint]]."""
        return make_ramp(given, "linear").moved(self._places)

    def of_load(self, given: str | tuple | None) -> Ramp:
        """The ramp of a [[load]]."""
        return make_ramp(given, self._of_loads).moved(self._places)
