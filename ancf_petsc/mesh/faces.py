"""Which sides cells share: neighbours, the boundary, sides of more than two cells."""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Integers


def sides_of(kind: str, cells: Integers) -> Integers:
    """Sides (e s, corners) of cells (e, k), side by side of each cell, oriented outwards."""
    sides = np.array(KINDS[kind].sides)
    return np.ascontiguousarray(cells[:, sides].reshape(-1, sides.shape[1]))


def sharing(sides: Integers, n_points: int) -> tuple[Integers, Integers]:
    """How many of sides (m, c) are the same as each, itself included (m,), and the lowest other one (m,), -1 for none."""
    return match_sides(sides, n_points)


@kernel
def match_sides(sides, n_points):
    """Sides are sorted into buckets by their lowest point, where few are left to be compared."""
    m = sides.shape[0]
    ordered = np.empty_like(sides)
    first = np.zeros(n_points + 1, np.int64)
    for side in range(m):
        sort_row(sides, ordered, side)
        first[ordered[side, 0] + 1] += 1
    for point in range(n_points):
        first[point + 1] += first[point]
    place = first[:-1].copy()
    bucket = np.empty(m, np.int64)
    for side in range(m):
        lowest = ordered[side, 0]
        bucket[place[lowest]] = side
        place[lowest] += 1
    count = np.ones(m, np.int64)
    other = np.full(m, -1, np.int64)
    for point in range(n_points):
        for i in range(first[point], first[point + 1]):
            for j in range(i + 1, first[point + 1]):
                a, b = bucket[i], bucket[j]
                same = True
                for k in range(1, sides.shape[1]):
                    same = same and ordered[a, k] == ordered[b, k]
                if same:
                    count[a] += 1
                    count[b] += 1
                    if other[a] < 0:
                        other[a] = b
                    if other[b] < 0:
                        other[b] = a
    return count, other


@register_jitable
def sort_row(rows, ordered, row):
    """The row of `rows` in ascending order."""
    for k in range(rows.shape[1]):
        value, at = rows[row, k], k
        while at > 0 and ordered[row, at - 1] > value:
            ordered[row, at] = ordered[row, at - 1]
            at -= 1
        ordered[row, at] = value
