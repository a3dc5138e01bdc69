"""Kernels of planar beams in absolute nodal coordinates: stretched along their axis and bent.

With r' and r'' along the undeformed axis, A = r'.r', B = r'.r'', C = r''.r'':
    w = E (A^(1/2) - 1)^2 / 2 + (E I / area) kappa^2 / 2,   kappa^2 = (A C - B^2) / A^2
is the energy per volume; A^(1/2) is the stretch of the axis, kappa its rotation per undeformed length. Both belong to the
Biot strain of plane sections, A^(1/2) - 1 - z kappa. Parameters: E, E I / area. Arguments are those of `generic`.

Source: J. Gerstmayr, H. Irschik, On the correct representation of bending and axial deformation in the absolute nodal
coordinate formulation with an elastic line approach, J. Sound Vib. 318 (2008) 461.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
from ancf_petsc.kernel.cell import add_rows, gather, scatter
from ancf_petsc.kernel.tet3413 import Kernels


@register_jitable
def strains(local, dN, inverse, r1, r2):
    """r' and r'' into r1 and r2 (3,). Returns A, B, C."""
    A = B = C = 0.0
    for i in range(3):
        r1[i] = r2[i] = 0.0
        for a in range(local.shape[0]):
            r1[i] += local[a, i] * dN[a, 0] * inverse
            r2[i] += local[a, i] * dN[a, 1] * inverse * inverse
        A += r1[i] * r1[i]
        B += r1[i] * r2[i]
        C += r2[i] * r2[i]
    return A, B, C


@register_jitable
def energy_of(A, B, C, p):
    return 0.5 * p[0] * (np.sqrt(A) - 1.0) ** 2 + 0.5 * p[1] * (A * C - B * B) / A**2


@register_jitable
def slopes_of(A, B, C, p):
    """dw/dA, dw/dB, dw/dC."""
    k = 0.5 * p[1]
    axial = 0.5 * p[0] * (1.0 - 1.0 / np.sqrt(A))
    return axial + k * (2.0 * B * B / A**3 - C / A**2), -2.0 * k * B / A**2, k / A


@register_jitable
def hessian(A, B, C, p, r1, r2, H):
    """Second derivatives of w with respect to r' and r'' into H (2, 2, 3, 3)."""
    k = 0.5 * p[1]
    wA, wB, wC = slopes_of(A, B, C, p)
    AA = 0.25 * p[0] / A**1.5 + k * (2.0 * C / A**3 - 6.0 * B * B / A**4)
    AB, AC, BB = 4.0 * k * B / A**3, -k / A**2, -2.0 * k / A**2
    for i in range(3):
        for j in range(3):
            same = 1.0 if i == j else 0.0
            p1, q1, p2, q2 = r1[i], r1[j], r2[i], r2[j]
            mixed = 2.0 * AB * (p1 * q2 + p2 * q1)
            H[0, 0, i, j] = 2.0 * wA * same + 4.0 * AA * p1 * q1 + mixed + BB * p2 * q2
            H[1, 1, i, j] = 2.0 * wC * same + BB * p1 * q1
            H[0, 1, i, j] = wB * same + 2.0 * AB * p1 * q1 + 4.0 * AC * p1 * q2 + BB * p2 * q1
    for i in range(3):
        for j in range(3):
            H[1, 0, i, j] = H[0, 1, j, i]


@kernel
def internal_force(positions, cells, maps, volumes, reference, parameters, first, last, force):
    """Add the internal forces Q to force (v, 3). Returns the smallest stretch of the axis at a point."""
    gradients, weights, slot, base = reference
    n, smallest = slot.size, 1e300
    local, local_force = np.empty((n, 3)), np.empty((n, 3))
    r1, r2 = np.empty(3), np.empty(3)
    for e in range(first, last):
        J, inverse = maps.jacobians[e], maps.inverses[e, 0, 0]
        gather(positions, cells[e], slot, J, local)
        local_force[:] = 0.0
        for q in range(weights.size):
            A, B, C = strains(local, gradients[q], inverse, r1, r2)
            smallest = min(smallest, np.sqrt(A))
            wA, wB, wC = slopes_of(A, B, C, parameters)
            w = weights[q] * volumes[e]
            for a in range(n):
                d1, d2 = gradients[q, a, 0] * inverse * w, gradients[q, a, 1] * inverse * inverse * w
                for i in range(3):
                    local_force[a, i] += d1 * (2.0 * wA * r1[i] + wB * r2[i]) + d2 * (
                        wB * r1[i] + 2.0 * wC * r2[i]
                    )
        scatter(force, cells[e], slot, J, local_force)
    return smallest


@kernel
def energy(positions, cells, maps, volumes, reference, parameters, first, last):
    """Strain energy of the cells."""
    gradients, weights, slot, base = reference
    local, r1, r2 = np.empty((slot.size, 3)), np.empty(3), np.empty(3)
    total = 0.0
    for e in range(first, last):
        gather(positions, cells[e], slot, maps.jacobians[e], local)
        for q in range(weights.size):
            A, B, C = strains(local, gradients[q], maps.inverses[e, 0, 0], r1, r2)
            total += weights[q] * volumes[e] * energy_of(A, B, C, parameters)
    return total


@register_jitable
def derivatives(dN, slot, J, inverse, D):
    """First and second derivatives of the functions of the nodal vectors into D (a, 2)."""
    for a in range(slot.size):
        factor = inverse if slot[a] == 0 else inverse * J[a // 2, 0, 0]
        D[a, 0] = dN[a, 0] * factor
        D[a, 1] = dN[a, 1] * factor * inverse


@kernel
def tangent(
    positions,
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
    """Add the tangent dQ/dr to values, the arrays of a matrix stored by rows, as `generic` does."""
    gradients, weights, slot, base = reference
    n, points = slot.size, weights.size
    local, r1, r2 = np.empty((n, 3)), np.empty(3), np.empty(3)
    H, D, rows = np.empty((points, 2, 2, 3, 3)), np.empty((points, n, 2)), np.empty((n, 9))
    for e in range(first, last):
        J, inverse = maps.jacobians[e], maps.inverses[e, 0, 0]
        gather(positions, cells[e], slot, J, local)
        for q in range(points):
            A, B, C = strains(local, gradients[q], inverse, r1, r2)
            hessian(A, B, C, parameters, r1, r2, H[q])
            derivatives(gradients[q], slot, J, inverse, D[q])
        for a in range(n):
            rows[:] = 0.0
            for q in range(points):
                w = weights[q] * volumes[e]
                for b in range(a, n):
                    for k in range(2):
                        for m in range(2):
                            factor = w * D[q, a, k] * D[q, b, m]
                            for ij in range(9):
                                rows[b, ij] += factor * H[q, k, m, ij // 3, ij % 3]
            add_rows(values, rows.ravel(), a, cells[e], starts[e], strides, split, driven)


@kernel
def tangent_product(positions, direction, cells, maps, volumes, reference, parameters, first, last, force):
    """Add the tangent times direction (v, 3) to force (v, 3): the directional derivative of Q."""
    gradients, weights, slot, base = reference
    n = slot.size
    local, along, local_force = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    r1, r2, d1, d2, H = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((2, 2, 3, 3))
    for e in range(first, last):
        J, inverse = maps.jacobians[e], maps.inverses[e, 0, 0]
        gather(positions, cells[e], slot, J, local)
        gather(direction, cells[e], slot, J, along)
        local_force[:] = 0.0
        for q in range(weights.size):
            A, B, C = strains(local, gradients[q], inverse, r1, r2)
            hessian(A, B, C, parameters, r1, r2, H)
            strains(along, gradients[q], inverse, d1, d2)
            w = weights[q] * volumes[e]
            for i in range(3):
                f1 = f2 = 0.0
                for j in range(3):
                    f1 += H[0, 0, i, j] * d1[j] + H[0, 1, i, j] * d2[j]
                    f2 += H[1, 0, i, j] * d1[j] + H[1, 1, i, j] * d2[j]
                for a in range(n):
                    dN = gradients[q, a]
                    local_force[a, i] += w * inverse * (dN[0] * f1 + dN[1] * inverse * f2)
        scatter(force, cells[e], slot, J, local_force)


@kernel
def fields(positions, cells, maps, volumes, reference, parameters, first, last, strain, cauchy, det):
    """Means over cells: Green-Lagrange strain along the axis as E_xx (e, 9), axial force over the undeformed section, along the
    deformed axis (e, 9), stretch of the axis (e,)."""
    gradients, weights, slot, base = reference
    local, r1, r2 = np.empty((slot.size, 3)), np.empty(3), np.empty(3)
    for e in range(first, last):
        gather(positions, cells[e], slot, maps.jacobians[e], local)
        strain[e], cauchy[e], det[e] = 0.0, 0.0, 0.0
        for q in range(weights.size):
            A, B, C = strains(local, gradients[q], maps.inverses[e, 0, 0], r1, r2)
            stretch = np.sqrt(A)
            strain[e, 0] += weights[q] * 0.5 * (A - 1.0)
            det[e] += weights[q] * stretch
            stress = parameters[0] * (stretch - 1.0)
            for i in range(3):
                for j in range(3):
                    cauchy[e, 3 * i + j] += weights[q] * stress * r1[i] * r1[j] / A


@cache
def make_kernels(law: object) -> Kernels:
    """Kernels of beams; they are linearly elastic whatever the law."""
    return Kernels(internal_force, energy, tangent, tangent_product, fields)
