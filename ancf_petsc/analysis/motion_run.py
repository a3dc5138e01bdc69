"""A motion's run: steps with their work, log lines and outputs."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.record import COUNTS, Record
from ancf_petsc.axes import AXES
from ancf_petsc.errors import Interrupted, MotionStopped
from ancf_petsc.log import STEPS
from ancf_petsc.model.measures import conjugates
from ancf_petsc.model.motion_work import MotionWork, Powers
from ancf_petsc.motion.integration import TimeIntegration
from ancf_petsc.motion.integrators import Integrator, Step
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.step_control import StepControl
from ancf_petsc.solve.weakest import weakest_cell

MOTION_COUNTS = (*COUNTS, "rejected_steps")
log = logging.getLogger(STEPS)


class MotionRun:
    """Follows a motion and records it. times: of the outputs after the start. watch(part): called with the part done,
    0 to 1. stop(): whether to end after this step.
    """

    def __init__(
        self,
        integrator: Integrator,
        times: Sequence[float],
        record: Record,
        clock: Clock,
        watch: Callable[[float], None],
        stop: Callable[[], bool],
    ) -> None:
        self.record, self.clock, self.watch = record, clock, watch
        self.integrator, self.equations = integrator, integrator.equations
        self.mass, self.assembly = self.equations.mass, self.equations.assembly
        self.duration = self.equations.duration
        self.times = set(times)
        self.totals = dict.fromkeys(MOTION_COUNTS, 0)
        self.control = StepControl("time")
        self.end: dict[str, Any] = {}
        self._since = dict.fromkeys(MOTION_COUNTS, 0)
        model = self.assembly.model
        self.work = MotionWork(model.drives, model.loads, self.duration)
        self._ramped = any(load.ramp.kind != "constant" for load in model.loads)
        self._work_is_due = False  # dead loads: their work since the last output is still to be added
        self._kinetic = 0.0
        self._start_energy = 0.0
        self._begun = time.perf_counter()
        self._from: float | None = None  # time of the state that the run goes on from
        self.path = TimeIntegration(integrator, times, self._on_step, self._on_corner, stop)

    @property
    def is_ready(self) -> bool:
        """Whether `state` says all."""
        return self.integrator.is_ready

    @property
    def place(self) -> str:
        """Where it is, in words."""
        return f"time {self.integrator.time:.6g}"

    def state(self) -> dict[str, Any]:
        """All that the rest of the run hangs on, between two steps. Collective."""
        return {
            "totals": self.totals,
            "since": self._since,
            "row": self.record.row,
            "written": self._written,
            "work": self.work.state(),
            "work_is_due": self._work_is_due,
            "kinetic": self._kinetic,
            "start_energy": self._start_energy,
            "control": self.control.state(),
            "integrator": self.integrator.state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Let `go` go on from a state. Collective."""
        self.totals, self._since = dict(state["totals"]), dict(state["since"])
        self.record.row, self._written = dict(state["row"]), state["written"]
        self.work.restore(state["work"])
        self._work_is_due, self._kinetic = state["work_is_due"], state["kinetic"]
        self._start_energy = state["start_energy"]
        self.control.restore(state["control"])
        self.integrator.restore(state["integrator"])
        self._from = self.integrator.time

    def go(self) -> None:
        """To the end. Raises MotionStopped or Interrupted, with the last good state saved."""
        if self._from is None:
            self.work.start(0.0, self._powers())
            self._start_energy = self.assembly.strain_energy(self.integrator.x) + self._kinetic_energy()
            self._write()
        try:
            self.path.run()
        except (MotionStopped, Interrupted):
            if self.integrator.time != self._written:
                if self._work_is_due:
                    self.work.add(self.integrator.time, self._powers())
                self._write()
            raise
        finally:
            self.end = {
                "time": self.integrator.time,
                **weakest_cell(self.assembly, self.integrator.x).facts(),
            }
            self.path.destroy()

    # --- steps

    def _on_step(self, step: Step) -> None:
        for name, count in zip(
            MOTION_COUNTS, (step.newton, step.linear, step.count, step.rejected), strict=True
        ):
            self.totals[name] += count
            self._since[name] += count
        if step.rejected:
            self.control.note(
                "rejected", "its error is above the tolerance", step.time, step.size, count=step.rejected
            )
        log.debug(
            "    t %.9g: steps %d, newton %d, linear %d, rejected %d",
            step.time, step.count, step.newton, step.linear, step.rejected,
        )  # fmt: skip
        if step.time in self.path.corners:
            self._kinetic = self._kinetic_energy()
        self._add_work(step)
        if step.time in self.times:
            self._write()
        self.watch(step.time / self.duration)

    def _add_work(self, step: Step) -> None:
        """Every step where something changes along it; dead loads that stay need ends of intervals."""
        if step.known is not None:
            self.work.add_known(*step.known)
            return
        often = self.equations.damping or self.equations.is_driven or self._ramped
        self._work_is_due = not (often or step.time in self.times or step.time in self.path.corners)
        if not self._work_is_due:
            self.work.add(step.time, self._powers())

    def _on_corner(self, now: float) -> None:
        """The work of an impulse is what it adds to the kinetic energy: positions stay."""
        self.work.start(now, self._powers(), self._kinetic_energy() - self._kinetic)

    def _powers(self) -> Powers:
        """Loss, and what loads and driven nodes see; accelerations only where they are needed."""
        equations, v, model = self.equations, self._velocity(), self.assembly.model
        loss, loss_rate, balance = 0.0, 0.0, np.zeros_like(v)
        if equations.damping or equations.is_driven:
            a, carried = self._acceleration(), self.mass.times(v)
            loss, loss_rate = float(np.vdot(v, carried)), 2 * float(np.vdot(a, carried))
            if equations.is_driven:
                balance = equations.out_of_balance(self.integrator.time, self.integrator.x, v, a)
        rates = [float(np.vdot(load.pattern, v)) for load in model.loads]
        loss, loss_rate, *rates = combined(self.assembly.comm, np.array([loss, loss_rate, *rates]))
        reactions, seen = conjugates(self.assembly, self.integrator.x, balance)
        alpha = equations.damping
        return Powers(alpha * loss, alpha * loss_rate, seen, np.array(rates), reactions)

    def _velocity(self) -> NDArray[np.float64]:
        return self.integrator.v.array_r.reshape(-1, 3)

    def _acceleration(self) -> NDArray[np.float64]:
        return self.equations.acceleration(self.integrator.time, self.integrator.x, self._velocity())

    def _kinetic_energy(self) -> float:
        return self.mass.kinetic_energy(self._velocity())

    # --- outputs

    def _write(self) -> None:
        with self.clock.part("output"):
            x, v, now = self.integrator.x, self._velocity(), self.integrator.time
            balance = self.equations.out_of_balance(now, x, v, self._acceleration())
            more = {**self._energies(), **self._momenta(), **self._since}
            row = self.record.write(
                {"time": now}, x, balance, more, {"velocity": self.assembly.along_axes(v)}
            )
            self._log_output(row)
        self._since = dict.fromkeys(MOTION_COUNTS, 0)
        self._written = now

    def _energies(self) -> dict[str, float]:
        kinetic, strain = self._kinetic_energy(), self.assembly.strain_energy(self.integrator.x)
        total = kinetic + strain + self.work.dissipated - self.work.external
        return {
            "kinetic_energy": kinetic,
            "potential_energy": self._potential_energy(),
            "dissipated_energy": self.work.dissipated,
            "external_work": self.work.external,
            "energy_drift": total - self._start_energy,
        }

    def _potential_energy(self) -> float:
        """- sum m g . r with gravity as it is now."""
        model = self.assembly.model
        shift = np.zeros((model.owned, 3))
        shift[model.own_positions] = model.origin
        positions = self.integrator.x.array_r.reshape(-1, 3) + model.frames.to_frames(shift)
        s = self.integrator.time / self.duration
        own = sum(
            -load.ramp.value(s) * float(np.vdot(load.pattern, positions))
            for load in model.loads
            if load.acceleration is not None
        )
        return combined(self.assembly.comm, own)

    def _momenta(self) -> dict[str, float]:
        linear, angular = self.mass.momenta(self.integrator.x, self._velocity())
        columns = {f"momentum.{axis}": linear[i] for i, axis in enumerate(AXES)}
        return columns | {f"angular_momentum.{axis}": angular[i] for i, axis in enumerate(AXES)}

    def _log_output(self, row: dict[str, float]) -> None:
        now, spent = self.integrator.time, time.perf_counter() - self._begun
        rate = (now - (self._from or 0.0)) / spent if spent else 0.0
        left = (self.duration - now) / rate if rate else 0.0
        log.info(
            "t %-10.6g energies: kinetic %10.4g  strain %10.4g  drift %9.2g  steps %5d  newton %5d  "
            "rejected %3d  %.3g of time a second, %.0f s left",
            now,
            row["kinetic_energy"],
            row["strain_energy"],
            row["energy_drift"],
            *(self._since[name] for name in ("steps", "newton_iterations", "rejected_steps")),
            rate,
            left,
        )
