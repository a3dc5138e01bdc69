"""Implicit methods of one step and one unknown, the increment of positions: PETSc's TS of type python with
a SNES of its own.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.model.matrix import Matrix
from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.increment import Forces, IncrementSolver
from ancf_petsc.motion.integrators.base import Integrator, Settings, Step


class _Context:
    """What PETSc calls."""

    def __init__(self, step: Callable[[PETSc.TS], None]) -> None:
        self.step = step


class OneStep(Integrator):
    """A subclass gives the forces of a step, their derivative, and the state after it.

    h, goal: size and end of the step at work. d: its increment of positions (n, 3).
    """

    symmetric = True
    relative = 1e-7

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        super().__init__(equations, settings, x, v)
        self.h = self.goal = self._made_with = 0.0
        self._between = equations.assembly.vector()
        self.solver = IncrementSolver(
            equations, x, self.forces, self._add_tangent, symmetric=self.symmetric, relative=self.relative
        )
        self.ts.createPython(_Context(self._step), comm=equations.comm)
        self.ts.setMaxTime(1e300)
        self.ts.setMaxSteps(2**31 - 1)
        self.ts.setExactFinalTime(PETSc.TS.ExactFinalTime.STEPOVER)
        self.ts.setErrorIfStepFails(False)
        self.ts.setSolution(x)
        self.ts.setFromOptions()
        self._why: str | None = None
        self._known: tuple[float, float] | None = None
        self._size = 0.0

    @abstractmethod
    def forces(self, d: PETSc.Vec) -> Forces:
        """Out-of-balance forces of the step at work for an increment."""

    @abstractmethod
    def tangent(self, d: PETSc.Vec, matrix: Matrix) -> None:
        """Add the derivative of `forces` to a matrix that is not finished yet."""

    @abstractmethod
    def finish(self, d: NDArray) -> tuple[float, float] | None:
        """Enter velocities (and accelerations) after the increment d (n, 3), positions unchanged yet.

        Returns external work and loss where the method has them exactly.
        """

    def advance(self, goal: float) -> Step:
        self.goal, self.h = goal, goal - self.time
        if abs(self.h - self._size) > 1e-9 * self.h:
            self.solver.test.aged, self._size = True, self.h
        self.ts.setTimeStep(self.h)
        self.ts.step()
        if self._why is not None:
            raise self.failed(goal, self._why)
        self.time = goal
        return Step(goal, self.h, self.solver.newton, self.solver.linear_iterations, known=self._known)

    def state(self) -> dict[str, Any]:
        sizes = [self._size, self._made_with]
        return {**super().state(), "sizes": sizes, "solver": self.solver.state()}

    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state)
        self._size, self.h = state["sizes"]
        self.solver.restore(state["solver"])

    def set_solver_up(self) -> None:
        self.h = self.goal = self.settings.step
        self.solver.set_up()
        self.solver.test.aged = True

    def describe(self) -> str:
        return f"{super().describe()}, {self.solver.linear.describe()}"

    def destroy(self) -> None:
        super().destroy()
        self.solver.destroy()
        self._between.destroy()

    def guess(self) -> NDArray:
        """Increment (n, 3) that Newton starts from."""
        return self.h * self.v.array_r.reshape(-1, 3)

    def unbalance(self, t: float, d: PETSc.Vec, part: float, carried: NDArray) -> tuple[NDArray, float]:
        """M carried + Q(x + part d) - Q_e(t) (n, 3), and the sum of squares of the three on this rank."""
        eq = self.equations
        if self.compiled is not None:
            states = (self.x.array_r.reshape(-1, 3), d.array_r.reshape(-1, 3))
            return self.compiled.unbalance(t, *states, part, carried)
        inertia, loads = eq.mass.times(carried), eq.loads(t)
        internal, _ = eq.assembly.internal_force(self.between(d, part))
        return inertia + internal - loads, self.squared(inertia, internal, loads)

    def _add_tangent(self, d: PETSc.Vec, matrix: Matrix) -> None:
        self._made_with = self.h  # equal steps differ by rounding
        self.tangent(d, matrix)

    def between(self, d: PETSc.Vec, part: float) -> PETSc.Vec:
        """The state x + part d."""
        self._between.waxpy(part, d, self.x)
        return self._between

    def _step(self, ts: PETSc.TS) -> None:
        guess = self.guess()
        driven = self.equations.assembly.driven
        if self.equations.is_driven:
            before = self.x.array_r[driven]
            guess.ravel()[driven] = self.equations.driven_positions(self.goal) - before
        self._why = self.solver.solve(guess)
        if self._why is not None:
            ts.setConvergedReason(PETSc.TS.ConvergedReason.DIVERGED_NONLINEAR_SOLVE)
            return
        self._known = self.finish(self.solver.d.array_r.reshape(-1, 3))
        self.x.axpy(1.0, self.solver.d)
        if self.equations.is_driven:
            self.x.array[driven] = self.equations.driven_positions(self.goal)
        ts.setTime(self.goal)

    @staticmethod
    def squared(*forces: NDArray) -> float:
        """Sum of squares of force fields on this rank."""
        return float(sum(np.vdot(force, force) for force in forces))
