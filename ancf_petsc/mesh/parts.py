"""Finding equal rows of node indices, whatever the order of their nodes."""

from __future__ import annotations

import numpy as np

from ancf_petsc.mesh.faces import sharing, sides_of
from ancf_petsc.mesh.mesh import Integers

_WORD = 2**63


def row_keys(rows: Integers, bound: int) -> Integers:
    """Integers (m,), equal where rows (m, k) of indices below `bound` hold the same ones in any order.

    Keys of two calls are not comparable: stack the rows first.
    """
    columns = np.sort(rows, axis=1).T
    keys, span = columns[0].astype(np.int64), bound
    for column in columns[1:]:
        if span * bound >= _WORD:
            keys = np.unique(keys, return_inverse=True)[1]
            span = len(rows)
        keys = keys * bound + column
        span *= bound
    return keys


def unique_rows(rows: Integers, bound: int) -> Integers:
    """Rows (m, k) without those that repeat an earlier one; the order stays."""
    first = np.unique(row_keys(rows, bound), return_index=True)[1]
    return rows[np.sort(first)]


def rows_in(rows: Integers, others: Integers, bound: int) -> np.ndarray:
    """For each of rows (m, k) its index in the unique rows `others` (n, k), -1 where it is not there."""
    keys = row_keys(np.vstack([others, rows]), bound)
    known, sought = keys[: len(others)], keys[len(others) :]
    if not len(others):
        return np.full(len(rows), -1)
    order = np.argsort(known)
    place = np.minimum(np.searchsorted(known, sought, sorter=order), len(others) - 1)
    found = order[place]
    return np.where(known[found] == sought, found, -1)


def outer_sides(kind: str, cells: Integers, bound: int) -> Integers:
    """Sides (m, corners) that belong to one of cells (e, k) only, oriented outwards."""
    sides = sides_of(kind, cells)
    return sides[sharing(sides, bound)[0] == 1]
