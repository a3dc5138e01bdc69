"""What a path is made of: its steps, its jumps, and the pseudo-times it has to hit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ancf_petsc.errors import NoEquilibrium

SAME_TIME = 1e-9
"""Pseudo-times closer than this are one."""


@dataclass(frozen=True)
class PathStep:
    """An accepted step of the path. length: of the path so far, where it is followed by its length. output: asked for."""

    s: float
    size: float
    newton: int
    linear: int
    residuals: tuple[float, ...]
    output: bool = False
    length: float | None = None


@dataclass(frozen=True)
class Jump:
    """Damped motion from the last state of a path, at pseudo-time `before`, to a state of rest at s. steps: of the motion. why:
    what ended the path.
    """

    before: float
    s: float
    steps: int
    why: NoEquilibrium


@dataclass(frozen=True)
class Marks:
    """Where a path goes. outputs: pseudo-times to hit exactly, ascending, the last is 1. corners: where it is not smooth."""

    outputs: tuple[float, ...]
    corners: frozenset[float]

    @staticmethod
    def of(outputs: Sequence[float], corners: Sequence[float]) -> Marks:
        """Times that differ by rounding are one: an output's, where there is one."""
        times: list[float] = []
        for s in sorted({*outputs, 1.0}, reverse=True):
            if not times or times[-1] - s > SAME_TIME:
                times.append(s)
        times.reverse()
        found: set[float] = set()
        for corner in sorted(corners):
            near = min((*times, *found), key=lambda s: abs(s - corner))
            found.add(near if abs(near - corner) <= SAME_TIME else corner)
        return Marks(tuple(times), frozenset(found))

    def after(self, s: float) -> float:
        """The next of them."""
        return min(mark for mark in (*self.outputs, *self.corners) if mark > s)
