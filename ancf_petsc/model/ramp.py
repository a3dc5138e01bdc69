"""Ramps: how a prescribed displacement or a load follows the pseudo-time s from 0 to 1.

In motion s is time over duration. `cosine` is the mended Eq. (17) of Olshevskiy et al. (2017): (1 - cos(pi s)) / 2.
"""

from __future__ import annotations

from bisect import bisect, insort
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import acos, cos, pi, sin

CLOSE = 1e-9
"""Points of pseudo-time closer than this part of the interval of outputs differ by rounding: they are one."""


@dataclass(frozen=True)
class Ramp:
    """kind: linear, cosine, constant or table; table: rows (s, factor), s ascending, flat outside."""

    kind: str
    table: tuple[tuple[float, float], ...] = ()

    def value(self, s: float) -> float:
        """The factor at s."""
        if self.kind == "linear":
            return s
        if self.kind == "cosine":
            return 0.5 * (1.0 - cos(pi * s))
        if self.kind == "constant":
            return 1.0
        return self._interpolate(s)

    def rate(self, s: float) -> float:
        """Derivative of the factor with respect to s; at the corner of a table the one to the right."""
        if self.kind == "linear":
            return 1.0
        if self.kind == "cosine":
            return 0.5 * pi * sin(pi * s)
        if self.kind == "constant":
            return 0.0
        for (s0, f0), (s1, f1) in zip(self.table, self.table[1:], strict=False):
            if s0 <= s < s1:
                return (f1 - f0) / (s1 - s0)
        return 0.0

    def curvature(self, s: float) -> float:
        """Second derivative of the factor with respect to s, corners left out."""
        return 0.5 * pi * pi * cos(pi * s) if self.kind == "cosine" else 0.0

    def corners(self) -> tuple[float, ...]:
        """Pseudo-times in (0, 1) where the rate jumps: the load path is not smooth across them."""
        return tuple(s for s, _ in self.table if 0.0 < s < 1.0)

    def first_time(self, factor: float) -> float | None:
        """The first s at which the factor is reached, None if it never is."""
        if self.kind == "linear":
            return factor if 0.0 <= factor <= 1.0 else None
        if self.kind == "cosine":
            return acos(1.0 - 2.0 * factor) / pi if 0.0 <= factor <= 1.0 else None
        if self.kind == "constant":
            return 0.0 if factor == 1.0 else None
        for (s0, f0), (s1, f1) in zip(self.table, self.table[1:], strict=False):
            if min(f0, f1) <= factor <= max(f0, f1) and f0 != f1:
                return s0 + (s1 - s0) * (factor - f0) / (f1 - f0)
        return None

    def moved(self, places: Mapping[float, float]) -> Ramp:
        """The ramp with the corners of its table at their `places`."""
        return Ramp(self.kind, tuple((places[s], factor) for s, factor in self.table))

    def _interpolate(self, s: float) -> float:
        if s <= self.table[0][0]:
            return self.table[0][1]
        for (s0, f0), (s1, f1) in zip(self.table, self.table[1:], strict=False):
            if s <= s1:
                return f0 + (f1 - f0) * (s - s0) / (s1 - s0)
        return self.table[-1][1]


def merged(points: Iterable[float], tolerance: float) -> list[float]:
    """Ascending points above 0; of those within the tolerance of each other the last."""
    kept: list[float] = []
    for point in sorted(points):
        if kept and point - kept[-1] <= tolerance:
            kept[-1] = point
        elif point > tolerance:
            kept.append(point)
    return kept


def nearest_points(corners: Iterable[float], points: Iterable[float], tolerance: float) -> dict[float, float]:
    """Where each of the corners of ramps is put: on a point, 0, 1 or another corner that is within the tolerance, or where it is.

    Without this a step would lead from a point to its double, over what rounding makes of their difference.
    """
    known = sorted({0.0, 1.0, *points})
    places = {}
    for s in sorted(set(corners)):
        k = bisect(known, s)
        places[s] = min(known[max(k - 1, 0) : k + 1], key=lambda point: abs(point - s))
        if abs(places[s] - s) > tolerance:
            places[s] = s
            insort(known, s)
    return places


def make_ramp(given: str | tuple | list | None, default: str) -> Ramp:
    """The ramp of a case: a name, a table of rows, or None for the default."""
    if given is None or isinstance(given, str):
        return Ramp(given or default)
    return Ramp("table", tuple((float(s), float(f)) for s, f in given))
