"""Forces between two states that keep energy and momenta, for element 3413; arrays as in `tet3413`.

positions_0, positions_1 (v, 3): the states. F = (F0 + F1) / 2 carries the law's discrete gradient S, so that
force . (r1 - r0) is the growth of the strain energy and forces and moments balance.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from ancf_petsc.jit import kernel
from ancf_petsc.kernel.tet3413 import add_block, edge_sum, nodes_of, scatter_force
from ancf_petsc.material.models import Law
from ancf_petsc.material.tensor import add, determinant, scale


class MeanKernels(NamedTuple):
    """The compiled loops of one element and one law."""

    force: Callable
    tangent: Callable


@cache
def make_mean_kernels(law: Law) -> MeanKernels:
    """Kernels of element 3413 for a law with `mean_stress` and `mean_tangent`."""
    stress, block_of = law.mean_stress, law.mean_tangent
    assert stress is not None
    assert block_of is not None

    @kernel
    def force(positions_0, positions_1, cells, gradients, volumes, parameters, first, last, result):
        """Add the forces to result (v, 3). Returns the smallest det F1."""
        smallest = 1e300
        for e in range(first, last):
            nodes, G = nodes_of(cells, e), gradients[e]
            F0, F1 = edge_sum(positions_0, nodes, G), edge_sum(positions_1, nodes, G)
            smallest = min(smallest, determinant(F1))
            scatter_force(result, nodes, stress(F0, F1, parameters), volumes[e], G)
        return smallest

    @kernel
    def tangent(
        positions_0,
        positions_1,
        cells,
        gradients,
        volumes,
        parameters,
        first,
        last,
        starts,
        strides,
        split,
        driven,
        values,
    ):
        """Add dforce/dr1, which is not symmetric, to values; starts to driven as in `tet3413`."""
        for e in range(first, last):
            nodes, G, w = nodes_of(cells, e), gradients[e], volumes[e]
            F0, F1 = edge_sum(positions_0, nodes, G), edge_sum(positions_1, nodes, G)
            for b in range(1, 4):
                v = (G[b - 1, 0], G[b - 1, 1], G[b - 1, 2])
                balance = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
                for a in range(4):
                    if a < 3:
                        u = (G[a, 0], G[a, 1], G[a, 2])
                        block = scale(w, block_of(F0, F1, u, v, parameters))
                        balance = add(balance, scale(-1.0, block))
                        row = a + 1
                    else:
                        block, row = balance, 0
                    i = nodes[row]
                    start, at_zero = starts[e, row, b], starts[e, row, 0]
                    stride = strides[i, 1 if start >= split else 0]
                    add_block(values, start, stride, block, driven[i], driven[nodes[b]])
                    stride = strides[i, 1 if at_zero >= split else 0]
                    add_block(values, at_zero, stride, scale(-1.0, block), driven[i], driven[nodes[0]])

    return MeanKernels(force, tangent)
