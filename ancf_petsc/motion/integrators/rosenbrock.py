"""Rosenbrock-W of PETSc, type ra34pw2 (Rang and Angermann 2005): order 3, four linear solves a step with
one factor, no Newton.
"""

from __future__ import annotations

from collections.abc import Mapping

from petsc4py import PETSc

from ancf_petsc.motion.integrators.implicit_first_order import ImplicitFirstOrder


class Rosenbrock(ImplicitFirstOrder):
    """A W-method: it keeps its order where the derivative with respect to time is left out, as here."""

    name = "rosenbrock"
    type_name = PETSc.TS.Type.ROSW
    keeps_matrix = False

    def options(self) -> Mapping[str, object]:
        return {"ts_rosw_type": "ra34pw2"}
