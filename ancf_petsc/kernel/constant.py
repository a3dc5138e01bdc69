"""Loops over what does not change with the motion: the scalar mass matrix and its products.

The consistent mass of two nodal vectors is a number times the 3 x 3 identity, so one number per pair of nodal vectors that
share a cell is kept, in rows of the graph of `neighbours`:
    pointers (n + 1,), columns    the graph of the n owned nodal vectors, columns ascend: owned ones first, ghosts after
    mass (nnz,)                   one number per entry of the graph
"""

from __future__ import annotations

import numpy as np

from ancf_petsc.kernel.compiled import kernel


@kernel
def add_mass(cells, weights, shape_mass, first, last, pointers, columns, mass):
    """Add the mass of cells first:last to `mass`.

    weights (e,): mass of each cell. shape_mass (a, b): mean of N_a N_b over a cell.
    """
    rows = pointers.size - 1
    for e in range(first, last):
        for a in range(cells.shape[1]):
            i = cells[e, a]
            if i >= rows:
                continue
            low, high = pointers[i], pointers[i + 1]
            for b in range(cells.shape[1]):
                slot = low + np.searchsorted(columns[low:high], cells[e, b])
                mass[slot] += weights[e] * shape_mass[a, b]


@kernel
def mass_product(pointers, columns, mass, field, result):
    """result (n, 3) = mass times field (v, 3)."""
    for i in range(pointers.size - 1):
        x = y = z = 0.0
        for k in range(pointers[i], pointers[i + 1]):
            m, j = mass[k], columns[k]
            x += m * field[j, 0]
            y += m * field[j, 1]
            z += m * field[j, 2]
        result[i, 0] = x
        result[i, 1] = y
        result[i, 2] = z


@kernel
def add_mass_blocks(pointers, columns, mass, factor, own_pointers, other_pointers, split, driven, values):
    """Add factor times the mass to the values of a matrix laid out as the tangent, driven rows and columns left out.

    own_pointers, other_pointers (n + 1,): the graph's entries in owned columns and in ghosts. split: where the values of
    ghost columns begin. driven (v,): bit c is set where component c is driven.
    """
    for i in range(pointers.size - 1):
        own = own_pointers[i + 1] - own_pointers[i]
        for k in range(pointers[i], pointers[i + 1]):
            slot = k - pointers[i]
            if slot < own:
                start, stride = 9 * own_pointers[i] + 3 * slot, 3 * own
            else:
                other = other_pointers[i + 1] - other_pointers[i]
                start, stride = split + 9 * other_pointers[i] + 3 * (slot - own), 3 * other
            held = driven[i] | driven[columns[k]]
            for c in range(3):
                if not held >> c & 1:
                    values[start + c * stride + c] += factor * mass[k]
