"""The energy-momentum step of Simo and Tarnow, ZAMP 43 (1992) 757.

For any law by the discrete gradient of Gonzalez, CMAME 190 (2000) 1763.

The midpoint rule with the law's discrete gradient: whatever the step, energy plus loss minus work, and both
momenta of a free body, stay what they were, to the tolerance of Newton.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.errors import CaseError
from ancf_petsc.model.matrix import Matrix
from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.increment import Forces
from ancf_petsc.motion.integrators.base import Settings
from ancf_petsc.motion.integrators.one_step import OneStep
from ancf_petsc.parallel.exchange import combined


class EnergyMomentum(OneStep):
    """Driven nodes keep the velocity of the method, 2 d / h - v: with it their work is exact too."""

    name = "energy_momentum"
    symmetric = False
    relative = 1e-11

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        for region in equations.assembly.model.regions:
            if region.kernels.mean_force is None:
                raise CaseError(
                    f"the law {region.law.name} has no discrete gradient",
                    key="dynamics.integrator",
                    got=self.name,
                    expected="a law with mean_stress and mean_tangent",
                    cure="take generalized_alpha",
                )
        super().__init__(equations, settings, x, v)
        self._reactions = np.zeros(0)

    def forces(self, d: PETSc.Vec) -> Forces:
        eq, h = self.equations, self.h
        after = self.between(d, 1.0)
        internal, _ = eq.assembly.mean_force(self.x, after)
        increment, v = d.array_r.reshape(-1, 3), self.v.array_r.reshape(-1, 3)
        inertia = eq.mass.times((2 / h**2 + eq.damping / h) * increment - (2 / h) * v)
        loads = eq.loads(self.time + 0.5 * h)
        values = inertia + internal - loads
        self._reactions = values.ravel()[eq.assembly.driven]
        return Forces(values, self.squared(inertia, internal, loads))

    def tangent(self, d: PETSc.Vec, matrix: Matrix) -> None:
        self.equations.assembly.add_mean_tangent(self.x, self.between(d, 1.0), matrix)
        self.equations.mass.add_to(matrix, 2 / self.h**2 + self.equations.damping / self.h)

    def finish(self, d: NDArray) -> tuple[float, float]:
        eq, v = self.equations, self.v.array_r.reshape(-1, 3)
        work = float(np.vdot(eq.loads(self.time + 0.5 * self.h), d))
        work += float(self._reactions @ d.ravel()[eq.assembly.driven])
        middle = d / self.h
        lost = eq.damping * self.h * float(np.vdot(middle, eq.mass.times(middle))) if eq.damping else 0.0
        self.v.array[:] = (2 * middle - v).ravel()
        total = combined(eq.comm, np.array([work, lost]))
        return float(total[0]), float(total[1])
