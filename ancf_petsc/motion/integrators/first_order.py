"""Motion as a system of first order, y = (x, v), for PETSc's methods of ordinary differential equations.

The driven degrees of freedom of y rest: wherever forces are computed the ramps' own values at the time of
the stage stand in their place, so every method keeps its order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.integrators.base import Integrator, Settings, Step
from ancf_petsc.parallel.fields import Field, field

NOT_FINITE = 72  # PETSC_ERR_FP
SPEED_CHANGE = 1.1  # a largest speed grown by this factor widens the tolerance of velocities


class FirstOrder(Integrator):
    """A subclass sets the type of `self.ts` and its functions, then calls `begin`."""

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        super().__init__(equations, settings, x, v)
        self._own = 3 * equations.assembly.model.owned
        self.y = PETSc.Vec().createMPI((2 * self._own, None), comm=equations.comm)
        self._stage_x, self._stage_v = equations.assembly.vector(), equations.assembly.vector()
        self._speed, self._proposed = 0.0, 0.0
        self._counts = (0, 0, 0)

    def begin(self, first_size: float) -> None:
        """Options and tolerances; first_size: of the first step, where the method adapts."""
        self.ts.setTime(0.0)
        self.ts.setSolution(self.y)
        self.ts.setMaxStepRejections(-1)
        self._proposed = first_size
        self._load()
        self._adjust_tolerance()
        self.ts.setTimeStep(first_size)

    def stage(self, y: PETSc.Vec, t: float) -> tuple[PETSc.Vec, NDArray]:
        """Positions and velocities (n, 3) of a stage, driven degrees of freedom where they belong at t."""
        x, v = self._stage_x, self._stage_v
        both = y.array_r
        x.array[:], v.array[:] = both[: self._own], both[self._own :]
        if self.equations.is_driven:
            self.equations.place(x, v, t)
        return x, v.array_r.reshape(-1, 3)

    def advance(self, goal: float) -> Step:
        left = goal - self.time
        size = min(left, self._proposed) if self.adaptive else left
        if size < left < 2 * size:
            size = left / 2
        self.ts.setTimeStep(size)
        try:
            self.ts.step()
        except PETSc.Error as error:
            if error.ierr != NOT_FINITE:
                raise
            raise self.failed(goal, "numbers are not finite any more") from error
        if self.ts.getConvergedReason() < 0:
            raise self.failed(goal, "Newton does not converge or no step is short enough")
        before, now = self.time, self.ts.getTime()
        if abs(now - goal) <= self.reach:
            now = goal
            self.ts.setTime(goal)
        if now - before <= self.reach:
            raise self.failed(goal, "steps have become too short to move on")
        self.time = now
        self._store()
        self._propose(size, now - before)
        return self._report(now - before)

    def state(self) -> dict[str, Any]:
        return {
            **super().state(),
            "y": self._halves(self.y.array_r),
            "speed": self._speed,
            "proposed": self._proposed,
        }

    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state)
        self.y.array[:] = joined(state["y"])
        self._speed, self._proposed = state["speed"], state["proposed"]
        if self.adaptive:
            self._set_tolerances()
        self.ts.setTime(self.time)

    def _halves(self, y: NDArray) -> list[Field]:
        """Of a vector as y: the positions' and the velocities'."""
        return [field(y[: self._own]), field(y[self._own :])]

    def restart(self) -> None:
        self._load()
        super().restart()

    def destroy(self) -> None:
        super().destroy()
        for item in (self.y, self._stage_x, self._stage_v):
            item.destroy()

    def _load(self) -> None:
        """The present state into y."""
        self.y.array[: self._own], self.y.array[self._own :] = self.x.array_r, self.v.array_r

    def _store(self) -> None:
        """The state from y."""
        both = self.y.array_r
        self.x.array[:], self.v.array[:] = both[: self._own], both[self._own :]
        if self.equations.is_driven:
            self.equations.place(self.x, self.v, self.time)

    def _propose(self, asked: float, done: float) -> None:
        """The size of the next step: what PETSc proposes, not less for having been cut short."""
        if not self.adaptive:
            return
        proposed, cut = self.ts.getTimeStep(), asked < self._proposed
        self._proposed = max(self._proposed, proposed) if cut and done >= asked * (1 - 1e-9) else proposed
        self._adjust_tolerance()

    def _adjust_tolerance(self) -> None:
        """Positions are weighed by the size of the body, velocities by the largest speed so far."""
        if not self.adaptive:
            return
        size = self.equations.assembly.model.size
        speed = max(self.v.norm(PETSc.NormType.INFINITY), size / self.equations.duration)
        if speed > SPEED_CHANGE * self._speed:
            self._speed = speed
            self._set_tolerances()

    def _set_tolerances(self) -> None:
        weights = self.y.duplicate()
        weights.array[: self._own] = self.settings.tolerance * self.equations.assembly.model.size
        weights.array[self._own :] = self.settings.tolerance * self._speed
        self.ts.setTolerances(rtol=0.0, atol=weights)
        weights.destroy()

    def _counted(self) -> tuple[int, int, int]:
        """PETSc's counts so far: Newton's and linear iterations, rejected steps."""
        return self.ts.getSNESIterations(), self.ts.getKSPIterations(), self.ts.getStepRejections()

    def _report(self, size: float) -> Step:
        counts = self._counted()
        newton, linear, rejected = (now - then for now, then in zip(counts, self._counts, strict=True))
        self._counts = counts
        return Step(self.time, size, newton, linear, rejected)


def joined(halves: list[NDArray]) -> NDArray:
    """A vector as y of its halves (n, 3)."""
    return np.concatenate([half.ravel() for half in halves])
