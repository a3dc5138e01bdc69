"""The cubic through two points of a path with their slopes, over the part p of the way between them, 0 to 1."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Value = TypeVar("Value", float, NDArray[np.float64])
HALVINGS = 45


def cubic(p: float, start: Value, end: Value, slope0: Value, slope1: Value) -> Value:
    """Its value at p. Slopes are derivatives with respect to p."""
    q = 1.0 - p
    ends = (1 + 2 * p) * q * q * start + (1 + 2 * q) * p * p * end
    return ends + p * q * (q * slope0 - p * slope1)


def extreme(start: float, end: float, slope0: float, slope1: float) -> float:
    """Where between two points with slopes of opposite sign it is level."""
    a = 3 * (slope0 + slope1 - 2 * (end - start))
    b = 2 * (3 * (end - start) - 2 * slope0 - slope1)
    roots = np.roots([a, b, slope0]) if a else np.array([-slope0 / b])
    inside = [float(root.real) for root in roots if abs(root.imag) < 1e-12 and 0.0 < root.real < 1.0]
    return inside[0] if inside else abs(slope0) / (abs(slope0) + abs(slope1))


def crossing(start: float, end: float, slope0: float, slope1: float, level: float) -> float:
    """Where it passes a level between its ends, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        below = cubic(middle, start, end, slope0, slope1) < level
        low, high = (middle, high) if below == (start < level) else (low, middle)
    return (low + high) / 2
