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


MOST_AT_A_POINT = 256
"""Sides with one lowest point that are compared with each other; more are spread."""


@kernel
def match_sides(sides, n_points):
    """Sides are sorted into buckets, where few are left to be compared: by their lowest point, which keeps neighbours together
    in memory, or by a number made of all their points where too many have one lowest point."""
    m = sides.shape[0]
    ordered = np.empty_like(sides)
    at_point = np.zeros(n_points, np.int64)
    for side in range(m):
        sort_row(sides, ordered, side)
        at_point[ordered[side, 0]] += 1
    number = ordered[:, 0].copy()
    if m > 0 and at_point.max() > MOST_AT_A_POINT:
        for side in range(m):
            number[side] = spread_row(ordered, side, m)
    first, row = into_buckets(number, max(n_points, m))
    count = np.ones(m, np.int64)
    other = np.full(m, -1, np.int64)
    for bucket in range(len(first) - 1):
        for i in range(first[bucket], first[bucket + 1]):
            for j in range(i + 1, first[bucket + 1]):
                if same_rows(ordered, row[i], row[j]):
                    note_pair(count, other, row[i], row[j])
    return count, other


@register_jitable
def into_buckets(number, buckets):
    """Where each bucket begins (buckets + 1,), and the rows by bucket, ascending in each (m,)."""
    first = np.zeros(buckets + 1, np.int64)
    for row in range(number.shape[0]):
        first[number[row] + 1] += 1
    for bucket in range(buckets):
        first[bucket + 1] += first[bucket]
    place = first.copy()
    rows = np.empty(number.shape[0], np.int64)
    for row in range(number.shape[0]):
        rows[place[number[row]]] = row
        place[number[row]] += 1
    return first, rows


@register_jitable
def same_rows(rows, a, b):
    """Whether two rows are equal."""
    same = True
    for k in range(rows.shape[1]):
        same = same and rows[a, k] == rows[b, k]
    return same


@register_jitable
def note_pair(count, other, a, b):
    """Two sides are the same."""
    count[a] += 1
    count[b] += 1
    if other[a] < 0:
        other[a] = b
    if other[b] < 0:
        other[b] = a


@register_jitable
def spread_row(rows, row, buckets):
    """A number below `buckets` (under 2^32), made of all entries of a row."""
    key = np.uint64(0)
    for k in range(rows.shape[1]):
        key = (key ^ np.uint64(rows[row, k])) * np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio
        key ^= key >> np.uint64(32)
    return np.int64(((key >> np.uint64(32)) * np.uint64(buckets)) >> np.uint64(32))


@register_jitable
def sort_row(rows, ordered, row):
    """The row of `rows` in ascending order."""
    for k in range(rows.shape[1]):
        value, at = rows[row, k], k
        while at > 0 and ordered[row, at - 1] > value:
            ordered[row, at] = ordered[row, at - 1]
            at -= 1
        ordered[row, at] = value
