"""Setting a motion up: mass, damping, the state it starts from, the integrator."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
from petsc4py import PETSc

from ancf_petsc.analysis.build import Built
from ancf_petsc.analysis.damping import damping_of
from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.motion_run import MotionRun
from ancf_petsc.analysis.record import Record
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case
from ancf_petsc.input.schema import InitialSpec
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.mass import Mass
from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.integration import warn_of_long_step
from ancf_petsc.motion.integrators import Settings, integrator, steps_in
from ancf_petsc.plan.outputs import motion_times

log = logging.getLogger("ancf")


class MotionAnalysis:
    """A body ready to move. times: of the outputs after the start."""

    def __init__(self, case: Case, built: Built) -> None:
        spec = case.spec.dynamics
        assert spec is not None
        self.spec, self.built = spec, built
        self.assembly = Assembly(built.model)
        self.comm = self.assembly.comm
        self.mass = Mass(self.assembly, lumped=spec.mass == "lumped")
        self.damping = damping_of(case, self.assembly, self.mass)
        self.times = motion_times(spec)
        self._run: MotionRun | None = None
        self.equations = Equations(self.assembly, self.mass, self.damping.alpha, spec.duration, self.times)
        x, v = self.assembly.reference_vector(), self.assembly.vector()
        set_velocity(v, self.mass, case.spec.initial or InitialSpec())
        self.equations.place(x, v, 0.0)
        try:
            self.integrator = integrator(spec.integrator)(self.equations, self._settings(), x, v)
        except CaseError as error:
            error.file = error.file or case.file
            raise

    def _settings(self) -> Settings:
        """What the case says of the integrator, the step shortened so that equal ones fill an output's
        interval.
        """
        spec, interval = self.spec, self.spec.duration / self.spec.outputs
        if spec.step is None:
            return Settings(0.0, interval, spec.tolerance or 0.0, spec.option)
        size = interval / steps_in(interval, spec.step)
        if abs(size - spec.step) > 1e-9 * spec.step:
            log.info(
                "step %.6g shortened to %.6g: %d equal steps fill the interval of outputs, %.6g",
                spec.step,
                size,
                round(interval / size),
                interval,
            )
        return Settings(size, interval, 0.0, spec.option)

    def prepare(self) -> None:
        """Set the solvers up, so that every option has been asked for."""
        self.integrator.set_solver_up()

    def describe(self) -> str:
        """One line: method, mass, damping."""
        warn_of_long_step(self.integrator, self.integrator.settings.step)
        loss = (
            f"damping {self.damping.alpha:.6g} {self.damping.source}".strip()
            if self.damping.alpha
            else "no damping"
        )
        return f"{self.integrator.describe()}, {self.spec.mass} mass, {loss}"

    def facts(self) -> dict[str, Any]:
        """What the summary holds beside what it has of every run."""
        facts: dict[str, Any] = {"damping": self.equations.damping}
        if self._run is not None:
            facts |= {"end": self._run.end, **self._run.control.facts()}
        longest = self.integrator.longest_stable
        return facts if longest is None else {**facts, "longest_stable_step": longest}

    def begin(
        self, record: Record, clock: Clock, watch: Callable[[float], None], stop: Callable[[], bool]
    ) -> MotionRun:
        """The run, ready to go."""
        self._run = MotionRun(self.integrator, self.times, record, clock, watch, stop)
        return self._run

    def destroy(self) -> None:
        """Free PETSc's objects."""
        self.integrator.destroy()


def set_velocity(v: PETSc.Vec, mass: Mass, spec: InitialSpec) -> None:
    """A rigid motion of the undeformed body: uniform velocity and spin about a point. Collective."""
    model = mass.assembly.model
    centre = mass.centre() if spec.centre == "mass" else np.array(spec.centre)
    arm, uniform = model.reference[: model.owned].copy(), np.zeros((model.owned, 3))
    arm[model.own_positions] -= centre - model.origin
    uniform[model.own_positions] = spec.velocity
    v.array[:] = model.frames.to_frames(uniform + np.cross(spec.spin, arm)).ravel()
