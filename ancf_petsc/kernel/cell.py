"""What happens inside one cell of any element, on plain arrays; the loops over cells are in `generic`.

`local` (a, 3) are nodal vectors of a cell in its reference cell: positions from the first node, slopes along
xi. slot (a) is 0 for positions and j for the j-th slope, J (s, 3, 3) turns the slopes of each node into slopes along
xi, inverse (9) is that of the jacobian of the cell, dN (a, 3) the gradients of the shape functions with respect to xi
at a point, G (a, 3) those with respect to X for the nodal vectors. A (3 J, 3 L, 9 ik) is dP/dF.
"""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.kernel.tet3413 import add_block
from ancf_petsc.material.tensor import add, dot, scale, transpose

ZERO = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@register_jitable
def nine(x):
    """An array (9,) as nine numbers."""
    return (x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8])


@register_jitable
def gather(positions, nodes, slot, J, local):
    """Nodal vectors of a cell into local: positions from the first node, slopes along xi."""
    slopes = slot.max()
    for a in range(slot.size):
        k = slot[a]
        for i in range(3):
            if k == 0:
                local[a, i] = positions[nodes[a], i] - positions[nodes[0], i]
            else:
                along = 0.0
                for j in range(slopes):
                    along += J[a // (slopes + 1), j, k - 1] * positions[nodes[a - k + 1 + j], i]
                local[a, i] = along


@register_jitable
def scatter(force, nodes, slot, J, local):
    """Add forces local (a, 3) on the vectors that `gather` makes to the force of the nodal vectors."""
    slopes = slot.max()
    for a in range(slot.size):
        j = slot[a]
        for i in range(3):
            if j == 0:
                force[nodes[a], i] += local[a, i]
            else:
                along = 0.0
                for k in range(slopes):
                    along += J[a // (slopes + 1), j - 1, k] * local[a - j + 1 + k, i]
                force[nodes[a], i] += along


@register_jitable
def gradient_of(local, dN, inverse, base):
    """base + (sum_a r_a dN_a) J^-1 as nine numbers."""
    total = ZERO
    for a in range(local.shape[0]):
        x, y, z = local[a, 0], local[a, 1], local[a, 2]
        u, v, w = dN[a, 0], dN[a, 1], dN[a, 2]
        total = add(total, (x * u, x * v, x * w, y * u, y * v, y * w, z * u, z * v, z * w))
    return add(nine(base), dot(total, inverse))


@register_jitable
def add_stress(local, dN, inverse, P):
    """Add P J^-T dN_a to local (a, 3)."""
    s = dot(P, transpose(inverse))
    for a in range(local.shape[0]):
        u, v, w = dN[a, 0], dN[a, 1], dN[a, 2]
        local[a, 0] += s[0] * u + s[1] * v + s[2] * w
        local[a, 1] += s[3] * u + s[4] * v + s[5] * w
        local[a, 2] += s[6] * u + s[7] * v + s[8] * w


@register_jitable
def cartesian_gradients(dN, slot, J, inverse, G):
    """Gradients with respect to X of the functions of the nodal vectors into G (a, 3)."""
    slopes = slot.max()
    for a in range(slot.size):
        j = slot[a]
        u = v = w = 0.0
        if j == 0:
            u, v, w = dN[a, 0], dN[a, 1], dN[a, 2]
        else:
            for k in range(slopes):
                b = a - j + 1 + k
                factor = J[a // (slopes + 1), j - 1, k]
                u += factor * dN[b, 0]
                v += factor * dN[b, 1]
                w += factor * dN[b, 2]
        for i in range(3):
            G[a, i] = u * inverse[i] + v * inverse[3 + i] + w * inverse[6 + i]


@register_jitable
def stress_changes(A, G, H):
    """A_iJkL G_bL into H (3 J, 9 b + ik)."""
    for b in range(G.shape[0]):
        x, y, z = G[b, 0], G[b, 1], G[b, 2]
        for J in range(3):
            for ik in range(9):
                H[J, 9 * b + ik] = x * A[J, 0, ik] + y * A[J, 1, ik] + z * A[J, 2, ik]


@register_jitable
def add_products(H, G, first, rows):
    """Add sum_J G_aJ H_J to rows (a, 9 b + ik), for b from a on where first is 1, for all b where it is 0.

    The inner loop runs along memory and fills the registers of vectors.
    """
    for a in range(G.shape[0]):
        x, y, z, start = G[a, 0], G[a, 1], G[a, 2], 9 * a * first
        along_x, along_y, along_z, row = H[0, start:], H[1, start:], H[2, start:], rows[a, start:]
        for m in range(row.size):
            row[m] += x * along_x[m] + y * along_y[m] + z * along_z[m]


@register_jitable
def add_free_block(values, start, stride, block):
    """`add_block` where nothing is driven and the row is this rank's."""
    for i in range(3):
        row = np.uint64(start + i * stride)
        for j in range(3):
            values[row + np.uint64(j)] += block[3 * i + j]


@register_jitable
def add_rows(values, rows, a, nodes, starts, strides, split, driven):
    """Add rows (9 b + ik), the blocks of a and b from a on, and what mirrors them to a matrix stored by rows."""
    i = nodes[a]
    for b in range(a, nodes.size):
        j, block = nodes[b], nine(rows[9 * b : 9 * b + 9])
        start, mirrored = starts[a, b], starts[b, a]
        stride = strides[i, 1 if start >= split else 0]
        stride_mirrored = strides[j, 1 if mirrored >= split else 0]
        if start >= 0 and mirrored >= 0 and driven[i] == 0 and driven[j] == 0:
            add_free_block(values, start, stride, block)
            if b > a:
                add_free_block(values, mirrored, stride_mirrored, transpose(block))
        else:
            add_block(values, start, stride, block, driven[i], driven[j])
            if b > a:
                add_block(values, mirrored, stride_mirrored, transpose(block), driven[j], driven[i])


@register_jitable
def unit(axis):
    """Unit vector along an axis."""
    return (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)


@register_jitable
def change_of_stress(A, H):
    """dP_iJ = A_iJkL H_kL as nine numbers."""
    dP = ZERO
    for k in range(3):
        for L in range(3):
            x, y, z = A[0, L], A[1, L], A[2, L]
            column = (x[k], y[k], z[k], x[3 + k], y[3 + k], z[3 + k], x[6 + k], y[6 + k], z[6 + k])
            dP = add(dP, scale(H[3 * k + L], column))
    return dP
