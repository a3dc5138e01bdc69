"""Where a smooth path goes on: the polynomial through its last states, and through its slope where it began."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.parallel.fields import field

FEWEST, MOST = 3, 6
"""Conditions, states and slope, of a polynomial: fewer predict worse than the tangent, more repeat Newton's errors."""


class Extrapolation:
    """Remembers the last states of a path. s: pseudo-time."""

    def __init__(self) -> None:
        self._states: list[tuple[float, PETSc.Vec]] = []
        self._slope: PETSc.Vec | None = None

    def add(self, s: float, x: PETSc.Vec) -> None:
        """Remember a state."""
        self._states.append((s, x.copy()))
        if len(self._states) + (self._slope is not None) > MOST:
            self._drop_slope()
        if len(self._states) > MOST:
            self._states.pop(0)[1].destroy()

    @property
    def wants_slope(self) -> bool:
        """Whether the slope at the first state would help: it is the only one."""
        return len(self._states) == 1

    def set_slope(self, slope: PETSc.Vec) -> None:
        """dx/ds at the only state."""
        self._drop_slope()
        self._slope = slope.copy()

    def forget(self) -> None:
        """The path is not smooth here, or it is at its end."""
        self._drop_slope()
        for _, state in self._states:
            state.destroy()
        self._states = []

    def state(self) -> dict[str, Any]:
        """What is remembered."""
        slope = None if self._slope is None else field(self._slope)
        return {"states": [[s, field(x)] for s, x in self._states], "slope": slope}

    def restore(self, state: dict[str, Any], like: PETSc.Vec) -> None:
        """Remember what `state` says; like: a vector of the body."""
        self.forget()
        self._states = [(s, filled(like, rows)) for s, rows in state["states"]]
        self._slope = None if state["slope"] is None else filled(like, state["slope"])

    def at(self, target: float) -> PETSc.Vec | None:
        """The state at `target`; None as long as too little is known."""
        if len(self._states) + (self._slope is not None) < FEWEST:
            return None
        weights, of_slope = weights_at(
            target, [s for s, _ in self._states], with_slope=self._slope is not None
        )
        found = self._states[0][1].copy()
        found.scale(weights[0])
        for weight, (_, state) in zip(weights[1:], self._states[1:], strict=True):
            found.axpy(weight, state)
        if self._slope is not None:
            found.axpy(of_slope, self._slope)
        return found

    def _drop_slope(self) -> None:
        if self._slope is not None:
            self._slope.destroy()
        self._slope = None


def filled(like: PETSc.Vec, rows: NDArray) -> PETSc.Vec:
    """A new vector of rows (n, 3)."""
    vector = like.duplicate()
    vector.array[:] = rows.ravel()
    return vector


def weights_at(target: float, times: list[float], *, with_slope: bool) -> tuple[NDArray[np.float64], float]:
    """Weights of values at times, and of the slope at the first of them, in the polynomial's value at target."""
    length = target - times[0]
    t = (np.array(times) - times[0]) / length
    powers = np.arange(len(times) + with_slope)
    conditions = t ** powers[:, None]
    if with_slope:
        conditions = np.column_stack((conditions, np.where(powers == 1, 1.0, 0.0)))
    weights = np.linalg.solve(conditions, np.ones(len(powers)))
    return weights[: len(times)], length * float(weights[-1]) if with_slope else 0.0
