"""Generalised alpha: Chung and Hulbert, J. Appl. Mech. 60 (1993) 371, in the notation of Jansen, Whiting
and Hulbert (2000).

The balance holds between the steps: accelerations at alpha_m, the rest at alpha_f. Second order; what the
step does not resolve is damped, to the spectral radius. Starting accelerations come from the equations of
motion.
"""

from __future__ import annotations

from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.solve.equations import Equations
from ancf_petsc.solve.integrators.base import Settings
from ancf_petsc.solve.integrators.increment import Forces
from ancf_petsc.solve.integrators.one_step import OneStep


class GeneralizedAlpha(OneStep):
    """Carries a: x, v and a continue a motion exactly."""

    name = "generalized_alpha"

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        radius = settings.spectral_radius
        self.alpha_m, self.alpha_f = (2 - radius) / (1 + radius), 1 / (1 + radius)
        self.gamma = 0.5 + self.alpha_m - self.alpha_f
        self.beta = 0.25 * (1 + self.alpha_m - self.alpha_f) ** 2
        super().__init__(equations, settings, x, v)
        self.restart()

    def restart(self) -> None:
        self.a = self.equations.acceleration(self.time, self.x, self.v.array_r.reshape(-1, 3))

    def _ends(self, d: NDArray) -> tuple[NDArray, NDArray]:
        """Velocity and acceleration (n, 3) at the end of the step."""
        h, v = self.h, self.v.array_r.reshape(-1, 3)
        a1 = (d - h * v) / (self.beta * h * h) - (0.5 / self.beta - 1) * self.a
        v1 = v + h * ((1 - self.gamma) * self.a + self.gamma * a1)
        driven = self.equations.assembly.driven
        if len(driven):
            a1.ravel()[driven] = self.equations.driven_accelerations(self.goal)
            v1.ravel()[driven] = self.equations.driven_velocities(self.goal)
        return v1, a1

    def forces(self, d: PETSc.Vec) -> Forces:
        eq, part, time = self.equations, self.alpha_f, self.time + self.alpha_f * self.h
        v1, a1 = self._ends(d.array_r.reshape(-1, 3))
        v = self.v.array_r.reshape(-1, 3)
        carried = (1 - self.alpha_m) * self.a + self.alpha_m * a1
        if eq.damping:
            carried += eq.damping * ((1 - part) * v + part * v1)
        inertia, loads = eq.mass.times(carried), eq.loads(time)
        internal, _ = eq.assembly.internal_force(self.between(d, part))
        values = (inertia + internal - loads) / part
        return Forces(values, self.squared(inertia, internal, loads) / part**2)

    def tangent(self, d: PETSc.Vec, matrix: PETSc.Mat) -> None:
        part, h = self.alpha_f, self.h
        factor = self.alpha_m / part / (self.beta * h * h)
        factor += self.equations.damping * self.gamma / (self.beta * h)
        mass = self.equations.mass
        self.equations.assembly.tangent(self.between(d, part), matrix, lambda: mass.add_to_matrix(factor))

    def finish(self, d: NDArray) -> None:
        v1, self.a = self._ends(d)
        self.v.array[:] = v1.ravel()

    def describe(self) -> str:
        return f"{super().describe()}, spectral radius {self.settings.spectral_radius:g}"
