"""Backward differentiation of PETSc, order 1 or 2: higher ones are unstable for undamped structures."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.integrators.base import Settings, Step
from ancf_petsc.motion.integrators.first_order import joined
from ancf_petsc.motion.integrators.implicit_first_order import ImplicitFirstOrder

DEPTH = 3
"""States that a step of order 2 with its error looks back on, the present one included."""


class Bdf(ImplicitFirstOrder):
    """Damps what the step does not resolve, more than generalised alpha does."""

    name = "bdf"
    type_name = PETSc.TS.Type.BDF

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        self._past: list[tuple[float, NDArray]] = []
        super().__init__(equations, settings, x, v)

    def advance(self, goal: float) -> Step:
        step = super().advance(goal)
        self._past = [*self._past, (self.time, self.y.array_r.copy())][-DEPTH:]
        return step

    def restart(self) -> None:
        super().restart()
        self._past = []

    @property
    def is_ready(self) -> bool:
        return len(self._past) == DEPTH

    def state(self) -> dict[str, Any]:
        return {**super().state(), "past": [[t, self._halves(y)] for t, y in self._past]}

    def restore(self, state: dict[str, Any]) -> None:
        """PETSc takes its past states from the solution as steps begin: steps without a solve hand them over."""
        super().restore(state)
        self._past = [(t, joined(halves)) for t, halves in state["past"]]
        now = self.y.array_r.copy()
        anything = self.y.duplicate()
        anything.set(1e300)
        self.ts.setTolerances(rtol=0.0, atol=anything)
        self.solves = False
        self.ts.restartStep()
        for (begin, y), (end, _) in pairwise(self._past):
            self.ts.setTime(begin)
            self.y.array[:] = y
            self.ts.setTimeStep(end - begin)
            self.ts.step()
        self.solves = True
        anything.destroy()
        if self.adaptive:
            self._set_tolerances()
        self.ts.setTime(self.time)
        self.y.array[:] = now
        self._counts = self._counted()

    def options(self) -> Mapping[str, object]:
        return {"ts_bdf_order": self.settings.option}

    def describe(self) -> str:
        return f"{super().describe()}, order {self.settings.option}"
