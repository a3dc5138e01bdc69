"""What happens inside one cell of any element, on plain arrays; the loops over cells are in `generic`.

`local` (a, 3) are nodal vectors of a cell in its reference cell: positions from the first node, slopes along
xi. slot (a) is 0 for positions and j for the j-th slope, J (s, 3, 3) turns the slopes of each node into slopes along
xi, inverse (9) is that of the jacobian of the cell, dN (a, 3) the gradients of the shape functions with respect to xi
at a point, G (a, 3) those with respect to X for the nodal vectors. A (3 J, 3 L, 9 ik) is dP/dF.
"""

from __future__ import annotations

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
def combine(x, a, y, b, z, c):
    """x a + y b + z c of nine numbers each."""
    return add(scale(x, a), add(scale(y, b), scale(z, c)))


@register_jitable
def add_products(A, G, a, first, rows):
    """Add sum_JL A_iJkL G_aJ G_bL to rows (b, 9 ik), for b from `first` on."""
    x, y, z = G[a, 0], G[a, 1], G[a, 2]
    along_x = combine(x, nine(A[0, 0]), y, nine(A[1, 0]), z, nine(A[2, 0]))
    along_y = combine(x, nine(A[0, 1]), y, nine(A[1, 1]), z, nine(A[2, 1]))
    along_z = combine(x, nine(A[0, 2]), y, nine(A[1, 2]), z, nine(A[2, 2]))
    for b in range(first, G.shape[0]):
        block = combine(G[b, 0], along_x, G[b, 1], along_y, G[b, 2], along_z)
        for ik in range(9):
            rows[b, ik] += block[ik]


@register_jitable
def add_rows(values, rows, a, nodes, starts, strides, split, driven):
    """Add rows (b, 9), the blocks of a and b from a on, and what mirrors them to a matrix stored by rows."""
    i = nodes[a]
    for b in range(a, nodes.size):
        j, block = nodes[b], nine(rows[b])
        start = starts[a, b]
        add_block(values, start, strides[i, 1 if start >= split else 0], block, driven[i], driven[j])
        if b > a:
            start = starts[b, a]
            stride = strides[j, 1 if start >= split else 0]
            add_block(values, start, stride, transpose(block), driven[j], driven[i])


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
