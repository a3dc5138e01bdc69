"""Explicit Runge-Kutta methods of PETSc: 5dp (Dormand and Prince 1980, the paper's ode45) and the classical
one of order 4.
"""

from __future__ import annotations

from petsc4py import PETSc

from ancf_petsc.solve.equations import Equations
from ancf_petsc.solve.integrators.base import Settings
from ancf_petsc.solve.integrators.first_order import FirstOrder
from ancf_petsc.solve.petsc import default_options


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

    @property
    def longest_stable(self) -> float:
        """The longest stable fixed step, by the largest frequency of the undeformed body."""
        omega = self.highest_frequency
        return self.highest_stable / omega if omega else self.equations.duration

    def _rates(self, ts: PETSc.TS, t: float, y: PETSc.Vec, f: PETSc.Vec) -> None:
        if self.equations.fused is not None:
            self.equations.fused.rates(t, y.array_r, f.array_w)
            return
        x, v = self.stage(y, t)
        a = self.equations.acceleration(t, x, v)
        rates = f.array
        rates[: self._own], rates[self._own :] = v.ravel(), a.ravel()
        if self.equations.moving:
            driven = self.equations.assembly.driven
            rates[driven] = rates[self._own + driven] = 0.0


class RungeKutta4(RungeKutta5dp):
    """Order 4, four stages; the wider limit of the two."""

    name = "runge_kutta_4"
    table = "4"
    highest_stable = 2.8
