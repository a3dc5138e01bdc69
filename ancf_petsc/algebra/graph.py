"""Graphs of nodal vectors that share a cell, and where the blocks of cells lie in a matrix made of them."""

from __future__ import annotations

import numpy as np

from ancf_petsc.jit import kernel


@kernel
def cells_around(cells, n):
    """For each of n nodes the cells that use it, as (pointers (n + 1,), cells)."""
    pointers = np.zeros(n + 1, np.int64)
    for e in range(cells.shape[0]):
        for a in range(cells.shape[1]):
            pointers[cells[e, a] + 1] += 1
    for i in range(n):
        pointers[i + 1] += pointers[i]
    fill = pointers[:-1].copy()
    around = np.empty(pointers[n], np.int32)
    for e in range(cells.shape[0]):
        for a in range(cells.shape[1]):
            around[fill[cells[e, a]]] = e
            fill[cells[e, a]] += 1
    return pointers, around


@kernel
def neighbours(cells, n, rows):
    """The graph of the first `rows` of n nodes: (pointers (rows + 1,), ascending neighbours), the node itself included."""
    pointers, around = cells_around(cells, n)
    seen = np.full(n, -1, np.int64)
    counts = np.zeros(rows + 1, np.int64)
    for i in range(rows):
        for k in range(pointers[i], pointers[i + 1]):
            for b in range(cells.shape[1]):
                j = cells[around[k], b]
                if seen[j] != i:
                    seen[j] = i
                    counts[i + 1] += 1
    for i in range(rows):
        counts[i + 1] += counts[i]
    columns = np.empty(counts[rows], np.int32)
    seen[:] = -1
    for i in range(rows):
        fill = counts[i]
        for k in range(pointers[i], pointers[i + 1]):
            for b in range(cells.shape[1]):
                j = cells[around[k], b]
                if seen[j] != i:
                    seen[j] = i
                    columns[fill] = j
                    fill += 1
        columns[counts[i] : fill].sort()
    return counts, columns


@kernel
def block_starts(cells, rows, own_pointers, own_columns, other_pointers, other_columns, m):
    """Where the m x m block of each pair of a cell's nodes begins: (e, a, b), -1 for rows of other ranks.

    The values lie by scalar rows, first those of own columns, then those of other ranks' columns.
    """
    split = m * m * own_pointers[rows]
    starts = np.full((cells.shape[0], cells.shape[1], cells.shape[1]), -1, np.int32)
    for e in range(cells.shape[0]):
        for a in range(cells.shape[1]):
            i = cells[e, a]
            if i >= rows:
                continue
            for b in range(cells.shape[1]):
                j = cells[e, b]
                if j < rows:
                    low, high = own_pointers[i], own_pointers[i + 1]
                    slot = low + np.searchsorted(own_columns[low:high], j)
                    starts[e, a, b] = m * m * low + m * (slot - low)
                else:
                    low, high = other_pointers[i], other_pointers[i + 1]
                    slot = low + np.searchsorted(other_columns[low:high], j)
                    starts[e, a, b] = split + m * m * low + m * (slot - low)
    return starts
