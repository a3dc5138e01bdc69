"""Quadrature of reference cells: positive and symmetric rules, each named by its number of points.

Tetrahedra and triangles from the tables in `simplex_rules`, lines, quads and bricks by Gauss and Legendre in
each direction. An under-integrating rule must be symmetric, or the answer depends on how nodes are numbered.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.cell import CELLS, Cell
from ancf_petsc.element.simplex_rules import TETRA, TRIANGLE

Floats = NDArray[np.float64]

SIMPLEX_RULES = {"triangle": TRIANGLE, "tetra": TETRA}
MOST_POINTS_PER_DIRECTION = 20


@dataclass(frozen=True, eq=False)
class Rule:
    """Points (q, k) of a reference cell, weights (q) that sum to its volume, and the degree of exactness.

    The degree is total on simplices and per direction on boxes. Raises ValueError where the data are no rule.
    """

    cell: Cell
    degree: int
    points: Floats
    weights: Floats

    def __post_init__(self) -> None:
        volume = float(self.cell.volume)
        centre = np.array(self.cell.centre(tuple(range(len(self.cell.corners)))), dtype=float)
        name = f"the rule of {len(self)} points on the {self.cell.name}"
        if not np.isclose(self.weights.sum(), volume, rtol=1e-14, atol=0):
            raise ValueError(
                f"{name} has the sum of weights {float(self.weights.sum())!r}, expected {volume!r}"
            )
        if self.weights.min() <= 0:
            raise ValueError(f"{name} has a weight that is not positive")
        if not np.allclose(self.weights @ self.points, volume * centre, rtol=0, atol=1e-14):
            raise ValueError(f"{name} is not symmetric: its centroid is off the centre")
        self.points.setflags(write=False)
        self.weights.setflags(write=False)

    def __len__(self) -> int:
        return len(self.weights)


@cache
def rule(cell: str, points: int) -> Rule:
    """The rule of so many points on the cell. Raises ValueError where there is none."""
    if cell in SIMPLEX_RULES:
        return _simplex_rule(cell, points)
    d = CELLS[cell].dimension
    n = round(points ** (1 / d))
    if n < 1 or n**d != points:
        raise ValueError(f"no rule of {points} points on the {cell}; expected n^{d}")
    return _gauss(cell, n)


def rule_of_degree(cell: str, degree: int) -> Rule:
    """The rule with the fewest points that integrates the degree exactly, or ValueError beyond the tables."""
    if cell not in SIMPLEX_RULES:
        return rule(cell, (degree // 2 + 1) ** CELLS[cell].dimension)
    table = SIMPLEX_RULES[cell]
    fitting = [points for points, (exact, _) in table.items() if exact >= degree]
    if not fitting:
        highest = max(exact for exact, _ in table.values())
        raise ValueError(f"no rule of degree {degree} on the {cell}; the highest is {highest}")
    return rule(cell, min(fitting))


def _simplex_rule(name: str, points: int) -> Rule:
    table = SIMPLEX_RULES[name]
    if points not in table:
        raise ValueError(f"no rule of {points} points on the {name}; there are {', '.join(map(str, table))}")
    degree, orbits = table[points]
    barycentric, shares = [], []
    for pattern, weight, values in orbits:
        orbit = _orbit(pattern, values)
        barycentric += orbit
        shares += [weight] * len(orbit)
    cell = CELLS[name]
    weights = np.array(shares) * (float(cell.volume) / sum(shares))
    return Rule(cell, degree, np.array(barycentric)[:, 1:], weights)


def _orbit(pattern: str, values: tuple[float, ...]) -> list[list[float]]:
    """All permutations of barycentric coordinates: `values` and the rest, as often as the pattern says."""
    counts = [int(count) for count in pattern]
    rest = (1.0 - sum(count * value for count, value in zip(counts[:-1], values, strict=True))) / counts[-1]
    every = [*values, rest]
    labels = [label for label, count in enumerate(counts) for _ in range(count)]
    return [[every[label] for label in order] for order in sorted(set(permutations(labels)))]


def _gauss(name: str, n: int) -> Rule:
    """Gauss and Legendre with n points in each direction of [-1/2, 1/2]^d."""
    if n > MOST_POINTS_PER_DIRECTION:
        raise ValueError(f"no rule of {n} points per direction; the most is {MOST_POINTS_PER_DIRECTION}")
    d = CELLS[name].dimension
    x, w = np.polynomial.legendre.leggauss(n)
    grid = np.meshgrid(*([x / 2] * d), indexing="ij")
    weights = np.prod(np.meshgrid(*([w / 2] * d), indexing="ij"), axis=0).ravel()
    return Rule(CELLS[name], 2 * n - 1, np.stack([g.ravel() for g in grid], axis=1), weights)
