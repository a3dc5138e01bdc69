"""Explicit Runge-Kutta methods of PETSc: 5dp (Dormand and Prince 1980, the paper's ode45) and the classical
one of order 4. Under loads that stay, steps of a pair that adapt are made in one compiled loop where the body is simple
enough and no option speaks of TS; it is PETSc's pair with PETSc's control.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.kernel.adaptive import NOT_FINITE, TOO_SHORT
from ancf_petsc.kernel.explicit import EXPLICIT
from ancf_petsc.motion.compiled import CompiledMotion
from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.integrators.base import Settings, Step
from ancf_petsc.motion.integrators.first_order import SPEED_CHANGE, FirstOrder, joined
from ancf_petsc.solve.petsc import begins_a_given_option, default_options


class RungeKutta5dp(FirstOrder):
    """Order 5; grows the motion of undamped bodies by less than 1e-3 a step up to omega h = 1.3."""

    name = "runge_kutta_5dp"
    table = "5dp"
    highest_stable = 1.0

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        super().__init__(equations, settings, x, v)
        self.ts.setType(PETSc.TS.Type.RK)
        self.ts.setRKType(self.table)
        self.ts.setRHSFunction(self._rates, self.y.duplicate())
        self.highest_frequency = equations.highest_frequency(x)
        with default_options({"ts_adapt_type": "basic" if self.adaptive else "none"}):
            self.ts.setFromOptions()
        self.begin(self.longest_stable)
        pair = EXPLICIT[self.table].lower is not None
        free = self.adaptive and pair and not begins_a_given_option("ts_")
        self._last, self._steps = self.y.duplicate(), 0
        self._first: NDArray | None = None
        self._leaping = self.compiled if free and self.compiled is not None and self.compiled.steady else None

    @property
    def is_compiled(self) -> bool:
        return self._leaping is not None

    def advance(self, goal: float) -> Step:
        if self._leaping is not None:
            return self._leap(goal, self._leaping)
        step = super().advance(goal)
        self._first, self._steps = None, self._steps + 1
        return step

    def destroy(self) -> None:
        super().destroy()
        self._last.destroy()

    def _leap(self, goal: float, compiled: CompiledMotion) -> Step:
        tolerance, before = self.settings.tolerance, self.time
        position = tolerance * self.equations.assembly.model.size
        span = (self.time, goal, self.reach)
        control = (self._proposed, self._speed, position, tolerance, SPEED_CHANGE)
        done = compiled.leap(self.y.array, EXPLICIT[self.table], span, control)
        if done.status == NOT_FINITE:
            raise self.failed(goal, "numbers are not finite any more")
        if done.status == TOO_SHORT:
            raise self.failed(goal, "steps have become too short to move on")
        self.time, self._proposed, self._speed = done.time, done.proposed, done.speed
        self._store()
        known, count = (done.work, done.loss), done.steps
        return Step(self.time, self.time - before, rejected=done.rejected, known=known, count=count)

    @property
    def longest_stable(self) -> float:
        """The longest stable fixed step, by the largest frequency of the undeformed body."""
        omega = self.highest_frequency
        return self.highest_stable / omega if omega else self.equations.duration

    def state(self) -> dict[str, Any]:
        last = self._last.array_r if self._carries and self._steps else None
        return {**super().state(), "last": None if last is None else self._halves(last)}

    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state)
        if state["last"] is not None:
            self._first = joined(state["last"])

    def restart(self) -> None:
        super().restart()
        self._steps = 0

    @property
    def _carries(self) -> bool:
        """Whether a step begins with the rates that the one before ended with, which hold what it rounded."""
        return EXPLICIT[self.table].reuses_last and self._leaping is None

    def _rates(self, ts: PETSc.TS, t: float, y: PETSc.Vec, f: PETSc.Vec) -> None:
        if self._first is not None and t == self.time:  # of all attempts at the first step
            f.array[:] = self._first
        else:
            self._compute_rates(t, y, f)
        if self._carries:
            f.copy(self._last)

    def _compute_rates(self, t: float, y: PETSc.Vec, f: PETSc.Vec) -> None:
        if self.compiled is not None:
            self.compiled.rates(t, y.array_r, f.array_w)
            return
        x, v = self.stage(y, t)
        a = self.equations.acceleration(t, x, v)
        rates = f.array
        rates[: self._own], rates[self._own :] = v.ravel(), a.ravel()
        if self.equations.is_driven:
            driven = self.equations.assembly.driven
            rates[driven] = rates[self._own + driven] = 0.0


class RungeKutta4(RungeKutta5dp):
    """Order 4, four stages; the wider limit of the two."""

    name = "runge_kutta_4"
    table = "4"
    highest_stable = 2.8
