"""Setting a quasi-static case up: Newton, and the outputs on the load path."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ancf_petsc.analysis.build import Built
from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.record import Record
from ancf_petsc.analysis.static_run import StaticRun
from ancf_petsc.input.load import Case
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.plan.outputs import output_times
from ancf_petsc.solve.newton import Newton


class StaticAnalysis:
    """A body ready to be loaded."""

    def __init__(self, case: Case, built: Built) -> None:
        assert case.spec.statics is not None
        self.spec = case.spec.statics
        self.times = output_times(case.spec, case.file)
        self.assembly = Assembly(built.model)
        self.newton = Newton(self.assembly, self.spec.tolerance)
        self._run: StaticRun | None = None

    def prepare(self) -> None:
        """Set the solvers up, so that every option has been asked for."""
        self.newton.prepare()

    def describe(self) -> str:
        """One line: the solver."""
        return self.newton.linear.describe()

    def facts(self) -> dict[str, Any]:
        """What the summary holds beside what it has of every run."""
        run = self._run
        if run is None:
            return {}
        return {
            "critical_points": run.events,
            "jumps": run.jumps,
            "doubts": run.doubts,
            "end": run.end,
            **run.control.facts(),
        }

    def begin(
        self, record: Record, clock: Clock, watch: Callable[[float], None], stop: Callable[[], bool]
    ) -> StaticRun:
        """The run, ready to go."""
        self._run = StaticRun(self.newton, record, self.times, self.spec, clock, watch, stop)
        return self._run

    def destroy(self) -> None:
        """Free PETSc's objects."""
        self.newton.destroy()
