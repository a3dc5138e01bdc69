"""The central difference with fixed steps, explicit, of order 2: one evaluation of forces a step.

    v at half a step = v + h/2 a,    x = x + h v,    v = (v + h/2 M^-1 (Q_e - Q)) / (1 + alpha h/2)

with velocities reported at whole steps (T. Belytschko, W. K. Liu, B. Moran, *Nonlinear Finite Elements for
Continua and Structures*, Wiley 2000, section 6.2). Stable up to omega h = 2. A small body whose driven degrees of
freedom rest moves in compiled loops, many steps a call; any other step after step, with one exchange of
positions between ranks for each and those of the mass solve.
"""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

from ancf_petsc.motion.compiled import CompiledMotion
from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.integrators.base import Integrator, Settings, Step, steps_in
from ancf_petsc.parallel.fields import field


class CentralDifference(Integrator):
    """Second order; keeps linear and angular momenta, its energy swings with h^2 about the true one."""

    name = "central_difference"
    highest_stable = 2.0

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        super().__init__(equations, settings, x, v)
        self.highest_frequency = equations.highest_frequency(x)
        self._begun = False

    @property
    def is_compiled(self) -> bool:
        return self.compiled is not None

    @property
    def leaps(self) -> bool:
        return self.is_compiled

    @property
    def longest_stable(self) -> float:
        """The longest stable step, by the largest frequency of the undeformed body."""
        omega = self.highest_frequency
        return self.highest_stable / omega if omega else self.equations.duration

    def advance(self, goal: float) -> Step:
        if not self._begun:
            self.restart()
        return self._step(goal) if self.compiled is None else self._leap(goal, self.compiled)

    def state(self) -> dict[str, Any]:
        a = self.a if self._begun else self.x.array_r
        return {**super().state(), "a": field(a), "begun": self._begun}

    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state)
        self._begun = state["begun"]
        if self._begun:
            self.a = state["a"].copy()

    def restart(self) -> None:
        v = self.v.array_r.reshape(-1, 3)
        self.a = self.equations.acceleration(self.time, self.x, v).copy()
        self._begun = True

    def set_solver_up(self) -> None:
        """There is no solver but that of the mass."""

    def _leap(self, goal: float, compiled: CompiledMotion) -> Step:
        parts = steps_in(goal - self.time, self.settings.step)
        size, count = (goal - self.time) / parts, min(parts, compiled.at_once)
        x, v = self.x.array.reshape(-1, 3), self.v.array.reshape(-1, 3)
        self.a = self.a.copy()
        known = compiled.march(self.time, size, count, x, v, self.a)
        self.time = goal if count == parts else self.time + size * count
        return Step(self.time, size * count, known=known, count=count)

    def _step(self, goal: float) -> Step:
        equations, h, alpha = self.equations, goal - self.time, self.equations.damping
        x, v = self.x.array.reshape(-1, 3), self.v.array.reshape(-1, 3)
        v += h / 2 * self.a
        x += h * v
        equations.place(self.x, self.v, goal)
        undamped = equations.acceleration(goal, self.x, v)
        driven = equations.assembly.driven
        given = undamped.ravel()[driven]
        if alpha:
            undamped += alpha * v
        v[:] = (v + h / 2 * undamped) / (1 + alpha * h / 2)
        equations.place(self.x, self.v, goal)
        self.a = undamped - alpha * v
        self.a.ravel()[driven] = given
        self.time = goal
        return Step(goal, h)
