"""Kernels of any element and any law: the reference of the fast paths.

In each cell nodal vectors are turned to the reference cell, F = base + sum_a r_a dN_a/dxi J^-1 at each
quadrature point, and forces are turned back. Arguments, v nodal vectors and e cells of this rank:
    positions (v, 3)      current nodal vectors
    cells, maps, volumes, reference    see `tables`
    parameters (p,)       of the law
    first, last           the range of cells to visit
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from ancf_petsc.jit import composed, kernel
from ancf_petsc.kernel.cell import (
    ZERO,
    add_products,
    add_rows,
    add_stress,
    cartesian_gradients,
    change_of_stress,
    gather,
    gradient_of,
    nine,
    scatter,
    stress_changes,
    unit,
)
from ancf_petsc.kernel.tet3413 import Kernels
from ancf_petsc.material.models import Law, green_lagrange
from ancf_petsc.material.tensor import add, determinant, dot, scale, transpose


@cache
def make_kernels(law: Law) -> Kernels:
    """Kernels of all elements for one law."""
    return Kernels(
        internal_force=_internal_force(law),
        energy=_energy(law),
        tangent=_tangent(law),
        tangent_product=_tangent_product(law),
        fields=_fields(law),
    )


def _internal_force(law: Law) -> Callable:
    stress = law.stress

    @kernel
    def internal_force(positions, cells, maps, volumes, reference, parameters, first, last, force):
        """Add the internal forces Q to force (v, 3). Returns the smallest det F at a point."""
        gradients, weights, slot, base = reference
        smallest = 1e300
        local, local_force = np.empty((slot.size, 3)), np.empty((slot.size, 3))
        for e in range(first, last):
            J, inverse = maps.jacobians[e], nine(maps.inverses[e].ravel())
            gather(positions, cells[e], slot, J, local)
            local_force[:] = 0.0
            for q in range(weights.size):
                F = gradient_of(local, gradients[q], inverse, base)
                smallest = min(smallest, determinant(F))
                P = scale(weights[q] * volumes[e], stress(F, parameters))
                add_stress(local_force, gradients[q], inverse, P)
            scatter(force, cells[e], slot, J, local_force)
        return smallest

    return internal_force


def _energy(law: Law) -> Callable:
    psi = law.energy

    @kernel
    def energy(positions, cells, maps, volumes, reference, parameters, first, last):
        """Strain energy of the cells."""
        gradients, weights, slot, base = reference
        total = 0.0
        local = np.empty((slot.size, 3))
        for e in range(first, last):
            inverse = nine(maps.inverses[e].ravel())
            gather(positions, cells[e], slot, maps.jacobians[e], local)
            for q in range(weights.size):
                F = gradient_of(local, gradients[q], inverse, base)
                total += weights[q] * volumes[e] * psi(F, parameters)
        return total

    return energy


def _moduli(law: Law) -> Callable:
    block_of = law.tangent

    @composed
    def moduli(F, parameters, weight, A):
        """weight dP_iJ/dF_kL into A (3 J, 3 L, 9 ik)."""
        for J in range(3):
            for L in range(J, 3):
                block = scale(weight, block_of(F, unit(J), unit(L), parameters))
                turned = transpose(block)
                for ik in range(9):
                    A[J, L, ik] = block[ik]
                    A[L, J, ik] = turned[ik]

    return moduli


def _tangent(law: Law) -> Callable:
    moduli = _moduli(law)

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
        """Add the tangent dQ/dr to values, the arrays of a matrix stored by rows.

        starts (e, a, a), strides (v, 2), split, driven (v,): as for element 3413.
        """
        gradients, weights, slot, base = reference
        n = slot.size
        local, G, rows = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 9 * n))
        A, H = np.empty((3, 3, 9)), np.empty((3, 9 * n))
        for e in range(first, last):
            J, inverse = maps.jacobians[e], nine(maps.inverses[e].ravel())
            gather(positions, cells[e], slot, J, local)
            rows[:] = 0.0
            for q in range(weights.size):
                F = gradient_of(local, gradients[q], inverse, base)
                moduli(F, parameters, weights[q] * volumes[e], A)
                cartesian_gradients(gradients[q], slot, J, inverse, G)
                stress_changes(A, G, H)
                add_products(H, G, 1, rows)
            for a in range(n):
                add_rows(values, rows[a], a, cells[e], starts[e], strides, split, driven)

    return tangent


def _tangent_product(law: Law) -> Callable:
    moduli = _moduli(law)

    @kernel
    def tangent_product(
        positions, direction, cells, maps, volumes, reference, parameters, first, last, force
    ):
        """Add the tangent times direction (v, 3) to force (v, 3): the directional derivative of Q."""
        gradients, weights, slot, base = reference
        n = slot.size
        local, along, local_force = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
        A, nothing = np.empty((3, 3, 9)), np.zeros(9)
        for e in range(first, last):
            J, inverse = maps.jacobians[e], nine(maps.inverses[e].ravel())
            gather(positions, cells[e], slot, J, local)
            gather(direction, cells[e], slot, J, along)
            local_force[:] = 0.0
            for q in range(weights.size):
                F = gradient_of(local, gradients[q], inverse, base)
                H = gradient_of(along, gradients[q], inverse, nothing)
                moduli(F, parameters, weights[q] * volumes[e], A)
                add_stress(local_force, gradients[q], inverse, change_of_stress(A, H))
            scatter(force, cells[e], slot, J, local_force)

    return tangent_product


def _fields(law: Law) -> Callable:
    stress = law.stress

    @kernel
    def fields(positions, cells, maps, volumes, reference, parameters, first, last, strain, cauchy, det):
        """Means over undeformed cells: Green-Lagrange strain (e, 9), Cauchy stress (e, 9), det F (e,)."""
        gradients, weights, slot, base = reference
        local = np.empty((slot.size, 3))
        for e in range(first, last):
            inverse = nine(maps.inverses[e].ravel())
            gather(positions, cells[e], slot, maps.jacobians[e], local)
            mean_strain, mean_cauchy, det[e] = ZERO, ZERO, 0.0
            for q in range(weights.size):
                F = gradient_of(local, gradients[q], inverse, base)
                J = determinant(F)
                sigma = dot(stress(F, parameters), transpose(F))
                mean_strain = add(mean_strain, scale(weights[q], green_lagrange(F)))
                mean_cauchy = add(mean_cauchy, scale(weights[q] / J, sigma))
                det[e] += weights[q] * J
            for k in range(9):
                strain[e, k] = mean_strain[k]
                cauchy[e, k] = mean_cauchy[k]

    return fields
