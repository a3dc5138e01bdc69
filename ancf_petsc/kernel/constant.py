"""Loops over what does not change with the motion: the scalar mass matrix and its products.

The consistent mass of two nodal vectors is a number times the 3 x 3 identity, so one number per pair of nodal vectors that
share a cell is kept, in rows of the graph of `neighbours`:
    pointers (n + 1,), columns    the graph of the n owned nodal vectors, columns ascend: owned ones first, ghosts after
    mass (nnz,)                   one number per entry of the graph
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from ancf_petsc.jit import kernel
from ancf_petsc.kernel.interface import Floats


class MassCells(NamedTuple):
    """Cells with their masses. nodes (e, a): nodal vectors. slot (a): 0 for a position, j for the j-th slope.

    weights (e, m): coefficients of the mass per volume of the reference cell, shape_mass (m, a, b): means of N_a N_b times
    their functions over the reference cell; m is 1 where the density of every cell is uniform.
    jacobians (e, s, 3, 3): from the slopes of nodes to those along xi.
    """

    nodes: NDArray[np.int32]
    weights: Floats
    shape_mass: Floats
    slot: NDArray[np.int32]
    jacobians: Floats


@register_jitable
def map_rows(matrix, slot, J, mapped):
    """Rows for the slopes of nodes into `mapped` (a, b) from rows (a, b) for slopes along xi. J (s, 3, 3)."""
    slopes = slot.max()
    for a in range(slot.size):
        j = slot[a]
        for b in range(matrix.shape[1]):
            if j == 0:
                mapped[a, b] = matrix[a, b]
            else:
                mapped[a, b] = 0.0
                for k in range(slopes):
                    mapped[a, b] += J[a // (slopes + 1), j - 1, k] * matrix[a - j + 1 + k, b]


@register_jitable
def lump(mass, slot):
    """Scale the diagonal of a cell's mass (a, b) so that positions carry all of it, and drop the rest. In place.

    Hinton, Rock and Zienkiewicz, Earthquake Engng Struct. Dyn. 4 (1976) 245: positive for every element.
    """
    carried = whole = 0.0
    for a in range(slot.size):
        if slot[a] == 0:
            carried += mass[a, a]
            for b in range(slot.size):
                whole += mass[a, b] if slot[b] == 0 else 0.0
    for a in range(slot.size):
        for b in range(slot.size):
            mass[a, b] = mass[a, b] / carried * whole if a == b else 0.0


@register_jitable
def cell_mass(weights, shape_mass, mass):
    """The sum of weights (m) times shape_mass (m, a, b) into mass (a, b)."""
    for a in range(mass.shape[0]):
        for b in range(mass.shape[1]):
            total = 0.0
            for m in range(weights.size):
                total += weights[m] * shape_mass[m, a, b]
            mass[a, b] = total


@kernel
def add_mass(cells, lumped, span, graph, mass):
    """Add the mass of a span of `MassCells` to `mass`."""
    nodes, weights, shape_mass, slot, jacobians = cells
    (first, last), (pointers, columns) = span, graph
    rows, n = pointers.size - 1, slot.size
    half, local = np.empty((n, n)), np.empty((n, n))
    for e in range(first, last):
        cell_mass(weights[e], shape_mass, local)
        if jacobians.shape[1] > 0:
            map_rows(local, slot, jacobians[e], half)
            map_rows(half.T, slot, jacobians[e], local)
        if lumped:
            lump(local, slot)
        for a in range(n):
            i = nodes[e, a]
            if i >= rows:
                continue
            low, high = pointers[i], pointers[i + 1]
            for b in range(n):
                place = low + np.searchsorted(columns[low:high], nodes[e, b])
                mass[place] += local[a, b]


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
def add_mass_blocks(graph, mass, factor, places, values):
    """Add factor times the mass to the values of a matrix laid out as the tangent, driven rows and columns left out.

    places: own_pointers, other_pointers (n + 1,), the graph's entries in owned columns and in ghosts; split, where the values of
    ghost columns begin; driven (v,), bit c is set where component c is driven.
    """
    (pointers, columns), (own_pointers, other_pointers, split, driven) = graph, places
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
