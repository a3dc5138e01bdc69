"""Rigid motions of parts of a body: a space of few unknowns for what a preconditioner of neighbours cannot see.

Every nodal vector belongs to a part; a part has six unknowns, its translation t and rotation w. They move a position
by t + w x arm and a slope by w x slope. For v nodal vectors, owned ones first, and p parts over all ranks:
    part (v,)        the part of each nodal vector
    arms (v, 3)      from the part's centre to a position; a slope itself
    shifts (v,)      1 for positions, 0 for slopes
    free (v, 3)      1 for free components, 0 for driven ones, which stay
    coarse (6 p,)    the unknowns, translations first in each part
"""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.algebra.blocks import block_at, row_at, vector_at
from ancf_petsc.jit import kernel
from ancf_petsc.material.tensor import transpose


@kernel
def restrict(part, arms, shifts, free, n, r, coarse):
    """coarse = what forces r (n, 3) do along the motions."""
    coarse[:] = 0.0
    for i in range(n):
        fx, fy, fz = r[i, 0] * free[i, 0], r[i, 1] * free[i, 1], r[i, 2] * free[i, 2]
        ax, ay, az = vector_at(arms, i)
        c, s = 6 * part[i], shifts[i]
        coarse[c] += s * fx
        coarse[c + 1] += s * fy
        coarse[c + 2] += s * fz
        coarse[c + 3] += ay * fz - az * fy
        coarse[c + 4] += az * fx - ax * fz
        coarse[c + 5] += ax * fy - ay * fx


@kernel
def add_motion(part, arms, shifts, free, n, coarse, z):
    """Add the motions to z (n, 3)."""
    for i in range(n):
        ax, ay, az = vector_at(arms, i)
        c, s = 6 * part[i], shifts[i]
        wx, wy, wz = coarse[c + 3], coarse[c + 4], coarse[c + 5]
        z[i, 0] += free[i, 0] * (s * coarse[c] + wy * az - wz * ay)
        z[i, 1] += free[i, 1] * (s * coarse[c + 1] + wz * ax - wx * az)
        z[i, 2] += free[i, 2] * (s * coarse[c + 2] + wx * ay - wy * ax)


@register_jitable
def motions(arms, shifts, free, i, into):
    """How the six unknowns move a nodal vector: into (3, 6)."""
    ax, ay, az = vector_at(arms, i)
    into[:] = 0.0
    for c in range(3):
        into[c, c] = shifts[i]
    into[0, 4], into[0, 5] = az, -ay
    into[1, 5], into[1, 3] = ax, -az
    into[2, 3], into[2, 4] = ay, -ax
    for c in range(3):
        for k in range(6):
            into[c, k] *= free[i, c]


@register_jitable
def add_coarse_block(block, left, right, row, column, matrix):
    """Add leftᵀ block right, (6, 6), to the matrix."""
    for k in range(6):
        x, y, z = right[0, k], right[1, k], right[2, k]
        u = block[0] * x + block[1] * y + block[2] * z
        v = block[3] * x + block[4] * y + block[5] * z
        w = block[6] * x + block[7] * y + block[8] * z
        for m in range(6):
            matrix[row + m, column + k] += left[0, m] * u + left[1, m] * v + left[2, m] * w


@kernel
def add_coarse_matrix(half, ghosts, part, arms, shifts, free, matrix):
    """Add the stiffness of the motions of the owned rows of a matrix to matrix (6 p, 6 p).

    half: pointers, columns, blocks, diagonal of `algebra/blocks`; ghosts: values, split, pointers, columns.
    """
    pointers, columns, blocks, diagonal = half
    values, split, other_pointers, other_columns = ghosts
    left, right = np.empty((3, 6)), np.empty((3, 6))
    for i in range(pointers.size - 1):
        row = 6 * part[i]
        motions(arms, shifts, free, i, left)
        add_coarse_block(row_at(diagonal, i), left, left, row, row, matrix)
        for k in range(pointers[i], pointers[i + 1]):
            j, b = columns[k], row_at(blocks, k)
            motions(arms, shifts, free, j, right)
            add_coarse_block(b, left, right, row, 6 * part[j], matrix)
            add_coarse_block(transpose(b), right, left, 6 * part[j], row, matrix)
        low, count = other_pointers[i], other_pointers[i + 1] - other_pointers[i]
        for slot in range(count):
            j = other_columns[low + slot]
            motions(arms, shifts, free, j, right)
            b = block_at(values, split + 9 * low + 3 * slot, 3 * count)
            add_coarse_block(b, left, right, row, 6 * part[j], matrix)
