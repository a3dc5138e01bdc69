"""The fast path of element 3413: one integration point, constant gradients, everything in registers.

A claim of equality with the generic kernel, which a test checks. Cells are tetrahedra with nodes 0 to 3. F
= sum_a r_a G_a with the gradients G of nodes 1 to 3; that of node 0 is minus their sum.

Arrays, v nodal vectors and e cells of this rank:
    positions (v, 3)      current positions
    cells (e, 4)          nodal vectors of the cells
    gradients (e, 3, 3)   G_a (a = 1..3, component J)
    volumes (e,)          undeformed volumes
    parameters (p,)       of the law
    first, last           the range of cells to visit
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
from ancf_petsc.material.models import Law, green_lagrange
from ancf_petsc.material.tensor import (
    add,
    apply,
    determinant,
    dot,
    inlined,
    inverse_transpose,
    scale,
    transpose,
)


class Kernels(NamedTuple):
    """The compiled loops of one element and one law."""

    internal_force: Callable
    energy: Callable
    tangent: Callable
    tangent_product: Callable
    fields: Callable


@inlined
def nodes_of(cells, e):
    """The four nodes of a cell, unsigned: compiled code then need not ask whether an index counts from the end."""
    return np.uint32(cells[e, 0]), np.uint32(cells[e, 1]), np.uint32(cells[e, 2]), np.uint32(cells[e, 3])


@inlined
def edge_sum(r, nodes, G):
    """sum over a = 1..3 of (r_a - r_0) G_a as nine numbers."""
    x, y, z = r[nodes[0], 0], r[nodes[0], 1], r[nodes[0], 2]
    total = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for a in range(3):
        n = nodes[a + 1]
        dx, dy, dz = r[n, 0] - x, r[n, 1] - y, r[n, 2] - z
        gx, gy, gz = G[a, 0], G[a, 1], G[a, 2]
        row = (dx * gx, dx * gy, dx * gz, dy * gx, dy * gy, dy * gz, dz * gx, dz * gy, dz * gz)
        total = add(total, row)
    return total


@inlined
def scatter_force(force, nodes, P, volume, G):
    """Add volume P G_a to the force of node a, and what balances it to node 0."""
    fx = fy = fz = 0.0
    for a in range(3):
        px, py, pz = apply(P, (volume * G[a, 0], volume * G[a, 1], volume * G[a, 2]))
        n = nodes[a + 1]
        force[n, 0] += px
        force[n, 1] += py
        force[n, 2] += pz
        fx += px
        fy += py
        fz += pz
    force[nodes[0], 0] -= fx
    force[nodes[0], 1] -= fy
    force[nodes[0], 2] -= fz


@inlined
def add_rows(values, start, stride, block):
    """Add a 3 x 3 block to a matrix stored by rows of length `stride`, from `start` on."""
    for i in range(3):
        row = start + i * stride
        values[row] += block[3 * i]
        values[row + 1] += block[3 * i + 1]
        values[row + 2] += block[3 * i + 2]


@inlined
def add_inner_cell(values, starts, strides, nodes, upper):
    """Add a cell none of whose rows and columns is driven or another rank's. upper: blocks (a, b) with a <=
    b.
    """
    s0, s1, s2, s3 = strides[nodes[0], 0], strides[nodes[1], 0], strides[nodes[2], 0], strides[nodes[3], 0]
    k00, k01, k02, k03, k11, k12, k13, k22, k23, k33 = upper
    add_rows(values, starts[0, 0], s0, k00)
    add_rows(values, starts[0, 1], s0, k01)
    add_rows(values, starts[0, 2], s0, k02)
    add_rows(values, starts[0, 3], s0, k03)
    add_rows(values, starts[1, 0], s1, transpose(k01))
    add_rows(values, starts[1, 1], s1, k11)
    add_rows(values, starts[1, 2], s1, k12)
    add_rows(values, starts[1, 3], s1, k13)
    add_rows(values, starts[2, 0], s2, transpose(k02))
    add_rows(values, starts[2, 1], s2, transpose(k12))
    add_rows(values, starts[2, 2], s2, k22)
    add_rows(values, starts[2, 3], s2, k23)
    add_rows(values, starts[3, 0], s3, transpose(k03))
    add_rows(values, starts[3, 1], s3, transpose(k13))
    add_rows(values, starts[3, 2], s3, transpose(k23))
    add_rows(values, starts[3, 3], s3, k33)


@register_jitable
def add_block(values, start, stride, block, driven_row, driven_column):
    """Add a 3 x 3 block to a matrix stored by rows, leaving out driven rows and columns.

    start: where the block's first row begins in values, negative if this rank does not own the row.
    """
    if start < 0:
        return
    held = (driven_row | driven_column) & 7
    if held == 0:
        add_rows(values, start, stride, block)
        return
    for i in range(3):
        for j in range(3):
            if not (driven_row >> i | driven_column >> j) & 1:
                values[start + i * stride + j] += block[3 * i + j]


@register_jitable
def add_pair(values, starts, strides, split, driven, nodes, a, b, block):
    """Add the block of nodes a and b, which may be another rank's or driven."""
    i, j, start = nodes[a], nodes[b], starts[a, b]
    add_block(values, start, strides[i, 1 if start >= split else 0], block, driven[i], driven[j])


@register_jitable
def add_any_cell(values, starts, strides, split, driven, nodes, upper):
    """Add a cell with driven degrees of freedom or nodes of other ranks. upper: blocks (a, b) with a <= b."""
    k00, k01, k02, k03, k11, k12, k13, k22, k23, k33 = upper
    matrix = (values, starts, strides, split, driven, nodes)
    add_pair(*matrix, 0, 0, k00)
    add_pair(*matrix, 0, 1, k01)
    add_pair(*matrix, 0, 2, k02)
    add_pair(*matrix, 0, 3, k03)
    add_pair(*matrix, 1, 0, transpose(k01))
    add_pair(*matrix, 1, 1, k11)
    add_pair(*matrix, 1, 2, k12)
    add_pair(*matrix, 1, 3, k13)
    add_pair(*matrix, 2, 0, transpose(k02))
    add_pair(*matrix, 2, 1, transpose(k12))
    add_pair(*matrix, 2, 2, k22)
    add_pair(*matrix, 2, 3, k23)
    add_pair(*matrix, 3, 0, transpose(k03))
    add_pair(*matrix, 3, 1, transpose(k13))
    add_pair(*matrix, 3, 2, transpose(k23))
    add_pair(*matrix, 3, 3, k33)


@cache
def make_kernels(law: Law) -> Kernels:
    """Kernels of element 3413 for one law."""
    return Kernels(
        internal_force=force_kernel(law.stress),
        energy=energy_kernel(law.energy),
        tangent=tangent_kernel(law.tangent),
        tangent_product=tangent_product_kernel(law.tangent),
        fields=fields_kernel(law.stress),
    )


def force_kernel(stress: Callable) -> Callable:
    """The loop over internal forces."""

    @kernel
    def internal_force(positions, cells, gradients, volumes, parameters, first, last, force):
        """Add the internal forces Q to force (v, 3). Returns the smallest det F."""
        smallest = 1e300
        for e in range(first, last):
            nodes, G = nodes_of(cells, e), gradients[e]
            F = edge_sum(positions, nodes, G)
            smallest = min(smallest, determinant(F))
            scatter_force(force, nodes, stress(F, parameters), volumes[e], G)
        return smallest

    return internal_force


def energy_kernel(psi: Callable) -> Callable:
    """The loop over strain energies."""

    @kernel
    def energy(positions, cells, gradients, volumes, parameters, first, last):
        """Strain energy of the cells."""
        total = 0.0
        for e in range(first, last):
            total += volumes[e] * psi(edge_sum(positions, nodes_of(cells, e), gradients[e]), parameters)
        return total

    return energy


def tangent_kernel(block_of: Callable) -> Callable:
    """The loop over tangents."""

    @kernel
    def tangent(
        positions, cells, gradients, volumes, parameters, first, last, starts, strides, split, driven, values
    ):
        """Add the tangent dQ/dr to values, the arrays of a matrix stored by rows.

        starts (e, 4, 4): where block (a, b) begins in values; negative for rows of other ranks.
        strides (v, 2): length of a scalar row of the nodal vector in the two parts of values.
        split: where the second part (columns of other ranks) begins in values.
        driven (v,): bit i is set where component i is driven: its row and column stay out; bit 3 where
        another rank owns the nodal vector.
        """
        for e in range(first, last):
            nodes, G, w = nodes_of(cells, e), gradients[e], volumes[e]
            F = edge_sum(positions, nodes, G)
            g1 = (G[0, 0], G[0, 1], G[0, 2])
            g2 = (G[1, 0], G[1, 1], G[1, 2])
            g3 = (G[2, 0], G[2, 1], G[2, 2])
            k11 = scale(w, block_of(F, g1, g1, parameters))
            k12 = scale(w, block_of(F, g1, g2, parameters))
            k13 = scale(w, block_of(F, g1, g3, parameters))
            k22 = scale(w, block_of(F, g2, g2, parameters))
            k23 = scale(w, block_of(F, g2, g3, parameters))
            k33 = scale(w, block_of(F, g3, g3, parameters))
            k01 = scale(-1.0, add(k11, add(transpose(k12), transpose(k13))))
            k02 = scale(-1.0, add(k12, add(k22, transpose(k23))))
            k03 = scale(-1.0, add(k13, add(k23, k33)))
            k00 = scale(-1.0, add(k01, add(k02, k03)))
            upper = (k00, k01, k02, k03, k11, k12, k13, k22, k23, k33)
            held = driven[nodes[0]] | driven[nodes[1]] | driven[nodes[2]] | driven[nodes[3]]
            if held == 0:
                add_inner_cell(values, starts[e], strides, nodes, upper)
            else:
                add_any_cell(values, starts[e], strides, split, driven, nodes, upper)

    return tangent


def tangent_product_kernel(block_of: Callable) -> Callable:
    """The loop over directional derivatives of the forces."""

    @kernel
    def tangent_product(positions, direction, cells, gradients, volumes, parameters, first, last, force):
        """Add the tangent times direction (v, 3) to force (v, 3): the directional derivative of Q."""
        for e in range(first, last):
            nodes, G = nodes_of(cells, e), gradients[e]
            F = edge_sum(positions, nodes, G)
            H = edge_sum(direction, nodes, G)
            dP = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            for J in range(3):
                u = (1.0 if J == 0 else 0.0, 1.0 if J == 1 else 0.0, 1.0 if J == 2 else 0.0)
                for L in range(3):
                    v = (1.0 if L == 0 else 0.0, 1.0 if L == 1 else 0.0, 1.0 if L == 2 else 0.0)
                    dx, dy, dz = apply(block_of(F, u, v, parameters), (H[L], H[3 + L], H[6 + L]))
                    dP = add(
                        dP,
                        (
                            dx * u[0],
                            dx * u[1],
                            dx * u[2],
                            dy * u[0],
                            dy * u[1],
                            dy * u[2],
                            dz * u[0],
                            dz * u[1],
                            dz * u[2],
                        ),
                    )
            scatter_force(force, nodes, dP, volumes[e], G)

    return tangent_product


def fields_kernel(stress: Callable) -> Callable:
    """The loop over strains and stresses."""

    @kernel
    def fields(positions, cells, gradients, volumes, parameters, first, last, strain, cauchy, det):
        """Green-Lagrange strain (e, 9), Cauchy stress (e, 9) and det F (e,) of the cells."""
        for e in range(first, last):
            F = edge_sum(positions, nodes_of(cells, e), gradients[e])
            J = determinant(F)
            E = green_lagrange(F)
            sigma = scale(1.0 / J, dot(stress(F, parameters), transpose(F)))
            for k in range(9):
                strain[e, k] = E[k]
                cauchy[e, k] = sigma[k]
            det[e] = J

    return fields


@kernel
def geometry(points, cells, gradients, volumes):
    """Gradients of nodes 1 to 3 (e, 3, 3) and volumes (e,) from undeformed points (v, 3)."""
    for e in range(cells.shape[0]):
        n = cells[e]
        J = (
            points[n[1], 0] - points[n[0], 0],
            points[n[1], 1] - points[n[0], 1],
            points[n[1], 2] - points[n[0], 2],
            points[n[2], 0] - points[n[0], 0],
            points[n[2], 1] - points[n[0], 1],
            points[n[2], 2] - points[n[0], 2],
            points[n[3], 0] - points[n[0], 0],
            points[n[3], 1] - points[n[0], 1],
            points[n[3], 2] - points[n[0], 2],
        )
        det = determinant(J)
        inverse = inverse_transpose(J, det)
        for a in range(3):
            for j in range(3):
                gradients[e, a, j] = inverse[3 * a + j]
        volumes[e] = det / 6.0
