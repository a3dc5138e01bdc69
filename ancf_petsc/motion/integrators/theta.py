"""The theta method of PETSc, balanced at the ends of steps: 1/2 is the trapezoidal rule, 1 backward Euler."""

from __future__ import annotations

from collections.abc import Mapping

from petsc4py import PETSc

from ancf_petsc.motion.integrators.implicit_first_order import ImplicitFirstOrder


class Theta(ImplicitFirstOrder):
    """Second order at 1/2, which keeps the energy of linear bodies only; first order above."""

    name = "theta"
    type_name = PETSc.TS.Type.THETA

    def options(self) -> Mapping[str, object]:
        return {"ts_theta_theta": self.settings.option, "ts_theta_endpoint": True}

    def describe(self) -> str:
        return f"{super().describe()}, theta {self.settings.option:g}"
