"""Backward differentiation of PETSc, order 1 or 2: higher ones are unstable for undamped structures."""

from __future__ import annotations

from collections.abc import Mapping

from petsc4py import PETSc

from ancf_petsc.motion.integrators.implicit_first_order import ImplicitFirstOrder


class Bdf(ImplicitFirstOrder):
    """Damps what the step does not resolve, more than generalised alpha does."""

    name = "bdf"
    type_name = PETSc.TS.Type.BDF

    def options(self) -> Mapping[str, object]:
        return {"ts_bdf_order": self.settings.option}

    def describe(self) -> str:
        return f"{super().describe()}, order {self.settings.option}"
