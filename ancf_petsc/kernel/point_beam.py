"""What happens at a point of a planar beam in absolute nodal coordinates: stretched along its axis and bent.

With r' and r'' along the undeformed axis, A = r'.r', B = r'.r'', C = r''.r'':
    w = E (A^(1/2) - 1)^2 / 2 + (E I / area) kappa^2 / 2,   kappa^2 = (A C - B^2) / A^2
is the energy per volume; A^(1/2) is the stretch of the axis, kappa its rotation per undeformed length. Both belong to the
Biot strain of plane sections, A^(1/2) - 1 - z kappa. Parameters: E, E I / area.

Source: J. Gerstmayr, H. Irschik, On the correct representation of bending and axial deformation in the absolute nodal
coordinate formulation with an elastic line approach, J. Sound Vib. 318 (2008) 461.

Between two states, with k = E I / (2 area), the energy per volume is
    w = E (A^(1/2) - 1)^2 / 2 + k (C g - B^2 h),   g = A^-1, h = A^-2,
of A, B and C, which are quadratic in r' and r''. The change of a product is the mean of one factor times the change of the
other; the changes of g, h and the first term are known multiples of that of A, which is (s1 - s0) (s1 + s0) of the two
stretches s. This gives D_A, D_B, D_C with D_A dA + D_B dB + D_C dC = w1 - w0 exactly, the derivatives of w where both states are
one; with r' and r'' of the middle the force's work is the growth of the energy and its moments balance.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ancf_petsc.kernel import scatter
from ancf_petsc.kernel.interface import Kernels
from ancf_petsc.kernel.loop import (
    Action,
    as_given,
    compiled,
    named_means,
    named_target,
    nothing_to_close,
    sums_in_place,
)
from ancf_petsc.kernel.point_solid import LARGE, add_products, stress_changes
from ancf_petsc.material.tensor import inlined, inner, outer, scale


@inlined
def derivatives(local, at):
    """r' and r'', of a field (a, 3)."""
    x = y = z = u = v = w = 0.0
    for a in range(local.shape[0]):
        first, second = at.dN[a, 0], at.dN[a, 1]
        x += local[a, 0] * first
        y += local[a, 1] * first
        z += local[a, 2] * first
        u += local[a, 0] * second
        v += local[a, 1] * second
        w += local[a, 2] * second
    inverse = at.frame.inverse[0]
    square = inverse * inverse
    return (x * inverse, y * inverse, z * inverse), (u * square, v * square, w * square)


@inlined
def strains(r1, r2):
    """A, B, C."""
    return inner(r1, r1), inner(r1, r2), inner(r2, r2)


@inlined
def combined(s, u, t, v):
    """s u + t v of vectors."""
    return (s * u[0] + t * v[0], s * u[1] + t * v[1], s * u[2] + t * v[2])


@inlined
def energy_of(ABC, p):
    A, B, C = ABC
    return 0.5 * p[0] * (np.sqrt(A) - 1.0) ** 2 + 0.5 * p[1] * (A * C - B * B) / A**2


@inlined
def slopes_of(ABC, p):
    """dw/dA, dw/dB, dw/dC."""
    A, B, C = ABC
    k = 0.5 * p[1]
    axial = 0.5 * p[0] * (1.0 - 1.0 / np.sqrt(A))
    return axial + k * (2.0 * B * B / A**3 - C / A**2), -2.0 * k * B / A**2, k / A


@inlined
def second_slopes_of(ABC, p):
    """Second derivatives of w: by AA, AB, AC, BB; the others vanish."""
    A, B, C = ABC
    k = 0.5 * p[1]
    AA = 0.25 * p[0] / A**1.5 + k * (2.0 * C / A**3 - 6.0 * B * B / A**4)
    return AA, 4.0 * k * B / A**3, -k / A**2, -2.0 * k / A**2


@inlined
def add_force(local, at, slopes, r1, r2):
    """Add to local (a, 3) the forces whose work is that of the slopes w_A, w_B, w_C on the changes of A, B, C."""
    on_first = combined(2.0 * slopes[0], r1, slopes[1], r2)
    on_second = combined(slopes[1], r1, 2.0 * slopes[2], r2)
    add_pair_of_forces(local, at, on_first, on_second)


@inlined
def add_pair_of_forces(local, at, on_first, on_second):
    """Add to local (a, 3) the forces of stresses on r' and r''."""
    inverse = at.frame.inverse[0]
    for a in range(local.shape[0]):
        d1, d2 = at.dN[a, 0] * inverse * at.weight, at.dN[a, 1] * inverse * inverse * at.weight
        for i in range(3):
            local[a, i] += d1 * on_first[i] + d2 * on_second[i]


@inlined
def force_at(at, states, parameters, sums, seen):
    r1, r2 = derivatives(states[0], at)
    ABC = strains(r1, r2)
    add_force(sums[0], at, slopes_of(ABC, parameters), r1, r2)
    return min(seen, np.sqrt(ABC[0]))


@inlined
def energy_at(at, states, parameters, sums, seen):
    r1, r2 = derivatives(states[0], at)
    return seen + at.weight * energy_of(strains(r1, r2), parameters)


@inlined
def fields_at(at, states, parameters, sums, seen):
    """E_xx along the axis, axial force over the undeformed section, along the deformed axis, and stretch of the axis."""
    r1, _ = derivatives(states[0], at)
    A = inner(r1, r1)
    stretch = np.sqrt(A)
    strain = (0.5 * (A - 1.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    stress = scale(parameters[0] * (stretch - 1.0) / A, outer(r1, r1))
    scatter.add_means(sums, at, strain, stress, stretch)
    return seen


# --- matrices: H (2, 2, 9 ij) are derivatives with respect to r' and r'', D (a, 2) first and second derivatives of the functions


@inlined
def hessian(r1, r2, p, weight, H):
    """Second derivatives of w with respect to r' and r'', times weight, into H (k, m, 9 ij)."""
    ABC = strains(r1, r2)
    wA, wB, wC = slopes_of(ABC, p)
    AA, AB, AC, BB = second_slopes_of(ABC, p)
    for i in range(3):
        for j in range(3):
            same = 1.0 if i == j else 0.0
            p1, q1, p2, q2 = r1[i], r1[j], r2[i], r2[j]
            mixed = 2.0 * AB * (p1 * q2 + p2 * q1)
            both = weight * (wB * same + 2.0 * AB * p1 * q1 + 4.0 * AC * p1 * q2 + BB * p2 * q1)
            H[0, 0, 3 * i + j] = weight * (2.0 * wA * same + 4.0 * AA * p1 * q1 + mixed + BB * p2 * q2)
            H[1, 1, 3 * i + j] = weight * (2.0 * wC * same + BB * p1 * q1)
            H[0, 1, 3 * i + j] = both
            H[1, 0, 3 * j + i] = both


@inlined
def function_derivatives(at, D):
    """First and second derivatives of the functions of the nodal vectors into D (a, 2), of three columns."""
    frame = at.frame
    inverse = frame.inverse[0]
    for a in range(frame.slot.size):
        factor = inverse if frame.slot[a] == 0 else inverse * frame.J[a // 2, 0, 0]
        D[a, 0] = at.dN[a, 0] * factor
        D[a, 1] = at.dN[a, 1] * factor * inverse


@inlined
def tangent_at(at, states, parameters, sums, seen):
    blocks, D, H, changes = sums
    r1, r2 = derivatives(states[0], at)
    hessian(r1, r2, parameters, at.weight, H)
    function_derivatives(at, D)
    stress_changes(H, D, changes)
    add_products(changes, D, 1, blocks)
    return seen


@inlined
def product_at(at, states, parameters, sums, seen):
    force, H = sums
    r1, r2 = derivatives(states[0], at)
    d1, d2 = derivatives(states[1], at)
    hessian(r1, r2, parameters, 1.0, H)
    on_first = combined(1.0, times(H[0, 0], d1), 1.0, times(H[0, 1], d2))
    on_second = combined(1.0, times(H[1, 0], d1), 1.0, times(H[1, 1], d2))
    add_pair_of_forces(force, at, on_first, on_second)
    return seen


@inlined
def times(block, v):
    """A block (9 ij) times a vector."""
    return (
        block[0] * v[0] + block[1] * v[1] + block[2] * v[2],
        block[3] * v[0] + block[4] * v[1] + block[5] * v[2],
        block[6] * v[0] + block[7] * v[1] + block[8] * v[2],
    )


# --- between two states


@inlined
def discrete_gradient(before, after, p):
    """D_A, D_B, D_C between two states."""
    (A0, B0, C0), (A1, B1, C1) = before, after
    k, product = 0.5 * p[1], A0 * A1
    change_of_g = -1.0 / product
    change_of_h = -(A0 + A1) / product**2
    bent = 0.5 * (C0 + C1) * change_of_g - 0.5 * (B0 * B0 + B1 * B1) * change_of_h
    return (
        0.5 * p[0] * (1.0 - 2.0 / (np.sqrt(A0) + np.sqrt(A1))) + k * bent,
        -0.5 * k * (A0**-2 + A1**-2) * (B0 + B1),
        0.5 * k * (1.0 / A0 + 1.0 / A1),
    )


@inlined
def discrete_hessian(before, after, p):
    """Derivatives of D_A, D_B, D_C with respect to A1, B1, C1, row by row."""
    (A0, B0, C0), (A1, B1, C1) = before, after
    k, product = 0.5 * p[1], A0 * A1
    squares, s1 = 0.5 * (B0 * B0 + B1 * B1), np.sqrt(A1)
    AA = (
        0.5 * p[0] / (s1 * (np.sqrt(A0) + s1) ** 2)
        + 0.5 * k * (C0 + C1) / (product * A1)
        - k * squares * (2.0 / A1 + 1.0 / A0) / (product * A1)
    )
    AB, AC = k * B1 * (A0 + A1) / product**2, -0.5 * k / product
    BA, BB, CA = k * (B0 + B1) / A1**3, -0.5 * k * (A0**-2 + A1**-2), -0.5 * k / A1**2
    return AA, AB, AC, BA, BB, CA


@inlined
def both_states(states, at):
    """Of the first state A, B, C; of the second A, B, C, r', r''; of the middle r', r''."""
    s1, s2 = derivatives(states[0], at)
    r1, r2 = derivatives(states[1], at)
    middle = combined(0.5, s1, 0.5, r1), combined(0.5, s2, 0.5, r2)
    return strains(s1, s2), strains(r1, r2), (r1, r2), middle


@inlined
def mean_force_at(at, states, parameters, sums, seen):
    before, after, _, (m1, m2) = both_states(states, at)
    add_force(sums[0], at, discrete_gradient(before, after, parameters), m1, m2)
    return min(seen, np.sqrt(after[0]))


@inlined
def mean_hessian(states, at, p, H):
    """Derivatives of the stresses on r' and r'' with respect to r' and r'' of the second state, weighed, into H (k, m, 9 ij)."""
    before, after, (r1, r2), (m1, m2) = both_states(states, at)
    D_A, D_B, D_C = discrete_gradient(before, after, p)
    AA, AB, AC, BA, BB, CA = discrete_hessian(before, after, p)
    # Changes of D_A, D_B, D_C with r' and with r'': A' = 2 r', B' = r'' and r', C' = 2 r''.
    A_1, A_2 = combined(2.0 * AA, r1, AB, r2), combined(AB, r1, 2.0 * AC, r2)
    B_1, B_2 = combined(2.0 * BA, r1, BB, r2), combined(BB, r1, 0.0, r2)
    C_1 = combined(2.0 * CA, r1, 0.0, r2)
    for i in range(3):
        for j in range(3):
            same, k = (1.0 if i == j else 0.0), 3 * i + j
            H[0, 0, k] = at.weight * (D_A * same + 2.0 * m1[i] * A_1[j] + m2[i] * B_1[j])
            H[0, 1, k] = at.weight * (0.5 * D_B * same + 2.0 * m1[i] * A_2[j] + m2[i] * B_2[j])
            H[1, 0, k] = at.weight * (0.5 * D_B * same + m1[i] * B_1[j] + 2.0 * m2[i] * C_1[j])
            H[1, 1, k] = at.weight * (D_C * same + m1[i] * B_2[j])


@inlined
def mean_tangent_at(at, states, parameters, sums, seen):
    blocks, D, H, changes = sums
    mean_hessian(states, at, parameters, H)
    function_derivatives(at, D)
    stress_changes(H, D, changes)
    add_products(changes, D, 0, blocks)
    return seen


def _made(gather, action):
    return compiled(gather, action, scatter.named_cells)


def make_kernels(law: object) -> Kernels:
    """Kernels of beams; they are linearly elastic whatever the law."""
    return _kernels()


@cache
def _kernels() -> Kernels:
    forces = (scatter.force_sums, scatter.give_force, as_given)
    products = (scatter.product_sums, scatter.give_force, as_given)
    in_place = (sums_in_place, nothing_to_close)
    mirrored = (scatter.matrix_sums, scatter.give_symmetric, named_target)
    blocks = (scatter.matrix_sums, scatter.give_blocks, named_target)
    return Kernels(
        internal_force=_made(scatter.ONE, Action(force_at, *forces, LARGE)),
        energy=_made(scatter.ONE, Action(energy_at, *in_place, as_given)),
        tangent=_made(scatter.ONE, Action(tangent_at, *mirrored)),
        tangent_product=_made(scatter.TWO, Action(product_at, *products)),
        fields=_made(scatter.ONE, Action(fields_at, scatter.mean_sums, scatter.give_means, named_means)),
        mean_force=_made(scatter.TWO, Action(mean_force_at, *forces, LARGE)),
        mean_tangent=_made(scatter.TWO, Action(mean_tangent_at, *blocks)),
    )
