"""Generalised alpha: Chung and Hulbert, J. Appl. Mech. 60 (1993) 371, in the notation of Jansen, Whiting
and Hulbert (2000).

The balance holds between the steps: accelerations at alpha_m, the rest at alpha_f. Second order; what the
step does not resolve is damped, to the spectral radius. Starting accelerations come from the equations of
motion. A small body whose driven degrees of freedom rest moves in compiled loops, unless an option speaks of
PETSc's solvers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.kernel.implicit import Scheme
from ancf_petsc.model.matrix import Matrix
from ancf_petsc.motion.compiled_newton import CompiledNewton
from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.increment import Forces
from ancf_petsc.motion.integrators.base import Integrator, Settings, Step, steps_in
from ancf_petsc.motion.integrators.one_step import OneStep
from ancf_petsc.parallel.fields import field


class GeneralizedAlpha(OneStep):
    """Carries a: x, v and a continue a motion exactly."""

    name = "generalized_alpha"

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        radius = settings.option
        self.alpha_m, self.alpha_f = (2 - radius) / (1 + radius), 1 / (1 + radius)
        self.gamma = 0.5 + self.alpha_m - self.alpha_f
        self.beta = 0.25 * (1 + self.alpha_m - self.alpha_f) ** 2
        super().__init__(equations, settings, x, v)
        self._still = np.zeros((0, 3))
        self._newton: CompiledNewton | None = None
        if self.compiled is not None and CompiledNewton.fits(self.solver):
            self._newton = CompiledNewton(self.compiled, equations, self.solver)
        self.restart()

    @property
    def is_compiled(self) -> bool:
        return self._newton is not None

    @property
    def leaps(self) -> bool:
        return self.is_compiled

    def advance(self, goal: float) -> Step:
        return super().advance(goal) if self._newton is None else self._leap(goal, self._newton)

    def state(self) -> dict[str, Any]:
        aged = self._newton.aged if self._newton is not None else None
        return {**super().state(), "a": field(self.a), "factor_aged": aged}

    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state)
        self.a = state["a"].copy()
        if self._newton is not None and state["factor_aged"] is not None:
            self._newton.restore(aged=state["factor_aged"])

    def restart(self) -> None:
        self.a = self.equations.acceleration(self.time, self.x, self.v.array_r.reshape(-1, 3))

    def _ends(self, d: NDArray) -> tuple[NDArray, NDArray]:
        """Velocity and acceleration (n, 3) at the end of the step."""
        h, v = self.h, self.v.array_r.reshape(-1, 3)
        a1 = (d - h * v) / (self.beta * h * h) - (0.5 / self.beta - 1) * self.a
        v1 = v + h * ((1 - self.gamma) * self.a + self.gamma * a1)
        if self.equations.is_driven:
            driven = self.equations.assembly.driven
            a1.ravel()[driven] = self.equations.driven_accelerations(self.goal)
            v1.ravel()[driven] = self.equations.driven_velocities(self.goal)
        return v1, a1

    def guess(self) -> NDArray:
        self._still = self._carried_by(np.zeros_like(self.a))
        h = self.h
        return h * self.v.array_r.reshape(-1, 3) + h * h / 2 * self.a

    def forces(self, d: PETSc.Vec) -> Forces:
        part, time = self.alpha_f, self.time + self.alpha_f * self.h
        carried = self._inertia * d.array_r.reshape(-1, 3)
        if self.equations.is_driven:
            carried.ravel()[self.equations.assembly.driven] = 0.0
        carried += self._still
        values, squared = self.unbalance(time, d, part, carried)
        return Forces(values / part, squared / part**2)

    def _carried_by(self, d: NDArray) -> NDArray:
        """What the mass is multiplied with, (n, 3); it grows with `_inertia` times the increment."""
        damping, part = self.equations.damping, self.alpha_f
        v1, a1 = self._ends(d)
        carried = (1 - self.alpha_m) * self.a + self.alpha_m * a1
        return carried + damping * ((1 - part) * self.v.array_r.reshape(-1, 3) + part * v1)

    @property
    def _inertia(self) -> float:
        inertia = self.alpha_m / (self.beta * self.h**2)
        return inertia + self.equations.damping * self.alpha_f * self.gamma / (self.beta * self.h)

    def tangent(self, d: PETSc.Vec, matrix: Matrix) -> None:
        part = self.alpha_f
        self.equations.assembly.add_tangent(self.between(d, part), matrix)
        self.equations.mass.add_to(matrix, self._inertia / part)

    def finish(self, d: NDArray) -> None:
        v1, self.a = self._ends(d)
        self.v.array[:] = v1.ravel()

    def _leap(self, goal: float, loop: CompiledNewton) -> Step:
        """Equal steps towards the goal: one where loss or work is summed up after each, else many."""
        start, parts = self.time, steps_in(goal - self.time, self.settings.step)
        size = (goal - start) / parts
        alone = self.equations.damping or not loop.compiled.steady
        count = 1 if alone else min(parts, max(1, loop.compiled.at_once // 4))
        if abs(size - self._size) > 1e-9 * size:
            loop.aged, self._size = True, size
        self.h, self.a, before = size, self.a.copy(), self.x.array_r.reshape(-1, 3).copy()
        scheme = Scheme(size, self.alpha_m, self.alpha_f, self.beta, self.gamma, self.equations.damping)
        state = (self.x.array.reshape(-1, 3), self.v.array.reshape(-1, 3), self.a)
        done, newton, good = loop.steps(state, start + size * (np.arange(count) + self.alpha_f), scheme)
        self.time = goal if done == parts else start + size * done
        if good:
            known = None if alone else (loop.compiled.work(before, state[0]), 0.0)
            return Step(self.time, size * done, newton, newton, known=known, count=done)
        self.solver.test.aged = True
        last = super().advance(goal if done + 1 == parts else start + size * (done + 1))
        newton, linear = newton + last.newton, newton + last.linear
        return Step(self.time, size * (done + 1), newton, linear, count=done + 1)

    def describe(self) -> str:
        if self._newton is not None:
            how = f"{Integrator.describe(self)}, compiled Newton + cholesky, {self.solver.linear.dof} degrees of freedom"
            return f"{how}, spectral radius {self.settings.option:g}"
        return f"{super().describe()}, spectral radius {self.settings.option:g}"
