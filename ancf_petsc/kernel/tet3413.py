"""The fast path of element 3413: one integration point, constant gradients, everything in registers.

A claim of equality with the generic kernel, which a test checks. Cells are tetrahedra with nodes 0 to 3. F = sum_a r_a G_a
with the gradients G of nodes 1 to 3; that of node 0 is minus their sum.

Arrays, v nodal vectors and e cells of this rank:
    positions (v, 3)      current positions
    cells (e, 4)          nodal vectors of the cells
    gradients (e, 3, 3)   G_a (a = 1..3, component J)
    volumes (e,)          undeformed volumes
    parameters (p,)       of the law
    first, last           the range of cells to visit
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from numba.extending import register_jitable

from ancf_petsc.kernel.compiled import kernel
from ancf_petsc.material.models import Law, green_lagrange
from ancf_petsc.material.tensor import add, apply, determinant, dot, inverse_transpose, scale, transpose


class Kernels(NamedTuple):
    """The compiled loops of one element and one law."""

    internal_force: object
    energy: object
    tangent: object
    tangent_product: object
    fields: object


@register_jitable
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


@register_jitable
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


@register_jitable
def add_block(values, start, stride, block, driven_row, driven_column):
    """Add a 3 x 3 block to a matrix stored by rows, leaving out driven rows and columns.

    start: where the block's first row begins in values, negative if this rank does not own the row.
    """
    if start < 0:
        return
    if driven_row | driven_column == 0:
        for i in range(3):
            for j in range(3):
                values[start + i * stride + j] += block[3 * i + j]
    else:
        for i in range(3):
            if not driven_row >> i & 1:
                for j in range(3):
                    if not driven_column >> j & 1:
                        values[start + i * stride + j] += block[3 * i + j]


@cache
def make_kernels(law: Law) -> Kernels:
    """Kernels of element 3413 for one law."""
    psi, stress, block_of = law.energy, law.stress, law.tangent

    @kernel
    def internal_force(positions, cells, gradients, volumes, parameters, first, last, force):
        """Add the internal forces Q to force (v, 3). Returns the smallest det F."""
        smallest = 1e300
        for e in range(first, last):
            nodes, G = cells[e], gradients[e]
            F = edge_sum(positions, nodes, G)
            smallest = min(smallest, determinant(F))
            scatter_force(force, nodes, stress(F, parameters), volumes[e], G)
        return smallest

    @kernel
    def energy(positions, cells, gradients, volumes, parameters, first, last):
        """Strain energy of the cells."""
        total = 0.0
        for e in range(first, last):
            total += volumes[e] * psi(edge_sum(positions, cells[e], gradients[e]), parameters)
        return total

    @kernel
    def tangent(
        positions, cells, gradients, volumes, parameters, first, last, starts, strides, split, driven, values
    ):
        """Add the tangent dQ/dr to values, the arrays of a matrix stored by rows.

        starts (e, 4, 4): where block (a, b) begins in values; negative for rows of other ranks.
        strides (v, 2): length of a scalar row of the nodal vector in the two parts of values.
        split: where the second part (columns of other ranks) begins in values.
        driven (v,): bit i is set where component i is driven: its row and column stay out.
        """
        for e in range(first, last):
            nodes, G, w = cells[e], gradients[e], volumes[e]
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
            k21, k31, k32 = transpose(k12), transpose(k13), transpose(k23)
            k01 = scale(-1.0, add(k11, add(k21, k31)))
            k02 = scale(-1.0, add(k12, add(k22, k32)))
            k03 = scale(-1.0, add(k13, add(k23, k33)))
            k00 = scale(-1.0, add(k01, add(k02, k03)))
            blocks = (
                (k00, k01, k02, k03),
                (transpose(k01), k11, k12, k13),
                (transpose(k02), k21, k22, k23),
                (transpose(k03), k31, k32, k33),
            )
            for a in range(4):
                for b in range(4):
                    start = starts[e, a, b]
                    stride = strides[nodes[a], 1 if start >= split else 0]
                    add_block(values, start, stride, blocks[a][b], driven[nodes[a]], driven[nodes[b]])

    @kernel
    def tangent_product(positions, direction, cells, gradients, volumes, parameters, first, last, force):
        """Add the tangent times direction (v, 3) to force (v, 3): the directional derivative of Q."""
        for e in range(first, last):
            nodes, G = cells[e], gradients[e]
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

    @kernel
    def fields(positions, cells, gradients, volumes, parameters, first, last, strain, cauchy, det):
        """Green-Lagrange strain (e, 9), Cauchy stress (e, 9) and det F (e,) of the cells."""
        for e in range(first, last):
            F = edge_sum(positions, cells[e], gradients[e])
            J = determinant(F)
            E = green_lagrange(F)
            sigma = scale(1.0 / J, dot(stress(F, parameters), transpose(F)))
            for k in range(9):
                strain[e, k] = E[k]
                cauchy[e, k] = sigma[k]
            det[e] = J

    return Kernels(internal_force, energy, tangent, tangent_product, fields)


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
