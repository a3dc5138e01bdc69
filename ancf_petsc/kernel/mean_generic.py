"""Forces between two states that keep energy and momenta, for any element; see `mean` and `generic`."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
from ancf_petsc.kernel.cell import (
    add_products,
    add_stress,
    cartesian_gradients,
    gather,
    gradient_of,
    nine,
    scatter,
    stress_changes,
    unit,
)
from ancf_petsc.kernel.mean import MeanKernels
from ancf_petsc.kernel.tet3413 import add_block
from ancf_petsc.material.models import Law
from ancf_petsc.material.tensor import determinant, scale


@cache
def make_mean_kernels(law: Law) -> MeanKernels:
    """Kernels of all elements for a law with `mean_stress` and `mean_tangent`."""
    return MeanKernels(_force(law), _tangent(law))


def _force(law: Law) -> Callable:
    stress = law.mean_stress
    assert stress is not None

    @kernel
    def force(positions_0, positions_1, cells, maps, volumes, reference, parameters, first, last, result):
        """Add the forces to result (v, 3). Returns the smallest det F1 at a point."""
        gradients, weights, slot, base = reference
        smallest, n = 1e300, slot.size
        before, after, local_force = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
        for e in range(first, last):
            J, inverse = maps.jacobians[e], nine(maps.inverses[e].ravel())
            gather(positions_0, cells[e], slot, J, before)
            gather(positions_1, cells[e], slot, J, after)
            local_force[:] = 0.0
            for q in range(weights.size):
                F0 = gradient_of(before, gradients[q], inverse, base)
                F1 = gradient_of(after, gradients[q], inverse, base)
                smallest = min(smallest, determinant(F1))
                P = scale(weights[q] * volumes[e], stress(F0, F1, parameters))
                add_stress(local_force, gradients[q], inverse, P)
            scatter(result, cells[e], slot, J, local_force)
        return smallest

    return force


@register_jitable
def add_row(values, rows, a, nodes, starts, strides, split, driven):
    """Add rows (9 b + ik), the blocks of a and all b, to a matrix stored by rows."""
    i = nodes[a]
    for b in range(nodes.size):
        start = starts[a, b]
        stride = strides[i, 1 if start >= split else 0]
        add_block(values, start, stride, nine(rows[9 * b : 9 * b + 9]), driven[i], driven[nodes[b]])


def _tangent(law: Law) -> Callable:
    block_of = law.mean_tangent
    assert block_of is not None

    @kernel
    def tangent(
        positions_0,
        positions_1,
        cells,
        maps,
        volumes,
        reference,
        parameters,
        first,
        last,
        starts,
        strides,
        split,
        driven,
        values,
    ):
        """Add dforce/dr1, which is not symmetric, to values; starts, strides, split, driven as in `tet3413`."""
        gradients, weights, slot, base = reference
        n = slot.size
        before, after, G = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
        A, H, rows = np.empty((3, 3, 9)), np.empty((3, 9 * n)), np.empty((n, 9 * n))
        for e in range(first, last):
            J, inverse = maps.jacobians[e], nine(maps.inverses[e].ravel())
            gather(positions_0, cells[e], slot, J, before)
            gather(positions_1, cells[e], slot, J, after)
            rows[:] = 0.0
            for q in range(weights.size):
                F0 = gradient_of(before, gradients[q], inverse, base)
                F1 = gradient_of(after, gradients[q], inverse, base)
                for K in range(3):
                    for L in range(3):
                        block = scale(weights[q] * volumes[e], block_of(F0, F1, unit(K), unit(L), parameters))
                        for ik in range(9):
                            A[K, L, ik] = block[ik]
                cartesian_gradients(gradients[q], slot, J, inverse, G)
                stress_changes(A, G, H)
                add_products(H, G, 0, rows)
            for a in range(n):
                add_row(values, rows[a], a, cells[e], starts[e], strides, split, driven)

    return tangent
