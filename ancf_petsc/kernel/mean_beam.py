"""Forces of planar beams between two states that keep energy and momenta; see `mean` and `beam`.

With A, B, C as in `beam`, which are quadratic in r' and r'', and k = E I / (2 area), the energy per volume is
    w = E (A^(1/2) - 1)^2 / 2 + k (C g - B^2 h),   g = A^-1, h = A^-2.
The change of a product is the mean of one factor times the change of the other; the changes of g, h and the first term are
known multiples of that of A, which is (s1 - s0) (s1 + s0) of the two stretches s. This gives D_A, D_B, D_C with D_A dA + D_B dB + D_C dC = w1 - w0 exactly, the derivatives of w where
both states are one; with r' and r'' of the middle the force's work is the growth of the energy and its moments balance.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
from ancf_petsc.kernel.beam import derivatives, strains
from ancf_petsc.kernel.cell import gather, scatter
from ancf_petsc.kernel.mean import MeanKernels
from ancf_petsc.kernel.mean_generic import add_row


@register_jitable
def discrete_gradient(A0, B0, C0, A1, B1, C1, p):
    """D_A, D_B, D_C between two states; p as in `beam`."""
    k, product = 0.5 * p[1], A0 * A1
    change_of_g = -1.0 / product
    change_of_h = -(A0 + A1) / product**2
    bent = 0.5 * (C0 + C1) * change_of_g - 0.5 * (B0 * B0 + B1 * B1) * change_of_h
    return (
        0.5 * p[0] * (1.0 - 2.0 / (np.sqrt(A0) + np.sqrt(A1))) + k * bent,
        -0.5 * k * (A0**-2 + A1**-2) * (B0 + B1),
        0.5 * k * (1.0 / A0 + 1.0 / A1),
    )


@register_jitable
def discrete_hessian(A0, B0, C0, A1, B1, C1, p, D):
    """Derivatives of D_A, D_B, D_C with respect to A1, B1, C1 into D (3, 3)."""
    k, product = 0.5 * p[1], A0 * A1
    squares, s1 = 0.5 * (B0 * B0 + B1 * B1), np.sqrt(A1)
    D[0, 0] = (
        0.5 * p[0] / (s1 * (np.sqrt(A0) + s1) ** 2)
        + 0.5 * k * (C0 + C1) / (product * A1)
        - k * squares * (2.0 / A1 + 1.0 / A0) / (product * A1)
    )
    D[0, 1] = k * B1 * (A0 + A1) / product**2
    D[0, 2] = -0.5 * k / product
    D[1, 0] = k * (B0 + B1) / A1**3
    D[1, 1] = -0.5 * k * (A0**-2 + A1**-2)
    D[2, 0] = -0.5 * k / A1**2
    D[1, 2] = D[2, 1] = D[2, 2] = 0.0


@register_jitable
def gradients_of_strains(r1, r2, V):
    """Derivatives of A, B, C with respect to r' and r'' into V (3, 2, 3)."""
    for i in range(3):
        V[0, 0, i], V[0, 1, i] = 2.0 * r1[i], 0.0
        V[1, 0, i], V[1, 1, i] = r2[i], r1[i]
        V[2, 0, i], V[2, 1, i] = 0.0, 2.0 * r2[i]


@kernel
def force(positions_0, positions_1, cells, maps, volumes, reference, parameters, first, last, result):
    """Add the forces to result (v, 3). Returns the smallest stretch of the axis at a point of the second state."""
    gradients, weights, slot, base = reference
    n, smallest = slot.size, 1e300
    before, after, local_force = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    s1, s2, r1, r2, V = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((3, 2, 3))
    for e in range(first, last):
        J, inverse = maps.jacobians[e], maps.inverses[e, 0, 0]
        gather(positions_0, cells[e], slot, J, before)
        gather(positions_1, cells[e], slot, J, after)
        local_force[:] = 0.0
        for q in range(weights.size):
            A0, B0, C0 = strains(before, gradients[q], inverse, s1, s2)
            A1, B1, C1 = strains(after, gradients[q], inverse, r1, r2)
            smallest = min(smallest, np.sqrt(A1))
            D = discrete_gradient(A0, B0, C0, A1, B1, C1, parameters)
            gradients_of_strains(0.5 * (s1 + r1), 0.5 * (s2 + r2), V)
            w = weights[q] * volumes[e]
            for a in range(n):
                d1, d2 = gradients[q, a, 0] * inverse * w, gradients[q, a, 1] * inverse * inverse * w
                for x in range(3):
                    for i in range(3):
                        local_force[a, i] += D[x] * (d1 * V[x, 0, i] + d2 * V[x, 1, i])
        scatter(result, cells[e], slot, J, local_force)
    return smallest


@register_jitable
def tangent_at_point(before, after, dN, inverse, p, work, H):
    """Derivatives of the force on r' and r'' of the middle with respect to r' and r'' of the second state into H (2, 2, 3, 3)."""
    s1, s2, r1, r2, middle, later, D = work
    A0, B0, C0 = strains(before, dN, inverse, s1, s2)
    A1, B1, C1 = strains(after, dN, inverse, r1, r2)
    D_A, D_B, D_C = discrete_gradient(A0, B0, C0, A1, B1, C1, p)
    discrete_hessian(A0, B0, C0, A1, B1, C1, p, D)
    gradients_of_strains(0.5 * (s1 + r1), 0.5 * (s2 + r2), middle)
    gradients_of_strains(r1, r2, later)
    H[:] = 0.0
    for i in range(3):
        H[0, 0, i, i] = D_A
        H[0, 1, i, i] = H[1, 0, i, i] = 0.5 * D_B
        H[1, 1, i, i] = D_C
    for x in range(3):
        for y in range(3):
            for k in range(2):
                for m in range(2):
                    for i in range(3):
                        for j in range(3):
                            H[k, m, i, j] += middle[x, k, i] * D[x, y] * later[y, m, j]


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
    n, points = slot.size, weights.size
    before, after, rows = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 9))
    H, G = np.empty((points, 2, 2, 3, 3)), np.empty((points, n, 2))
    vectors = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    work = (*vectors, np.empty((3, 2, 3)), np.empty((3, 2, 3)), np.empty((3, 3)))
    for e in range(first, last):
        J, inverse = maps.jacobians[e], maps.inverses[e, 0, 0]
        gather(positions_0, cells[e], slot, J, before)
        gather(positions_1, cells[e], slot, J, after)
        for q in range(points):
            tangent_at_point(before, after, gradients[q], inverse, parameters, work, H[q])
            derivatives(gradients[q], slot, J, inverse, G[q])
        for a in range(n):
            rows[:] = 0.0
            for q in range(points):
                for k in range(2):
                    for m in range(2):
                        factor = weights[q] * volumes[e] * G[q, a, k]
                        for b in range(n):
                            for ij in range(9):
                                rows[b, ij] += factor * G[q, b, m] * H[q, k, m, ij // 3, ij % 3]
            add_row(values, rows.ravel(), a, cells[e], starts[e], strides, split, driven)


@cache
def make_mean_kernels(law: object) -> MeanKernels:
    """Kernels of beams; they are linearly elastic whatever the law."""
    return MeanKernels(force, tangent)
