"""Symmetric matrices of 3 x 3 blocks, of which one half is kept: products and incomplete factors.

Scalar rows make every index and every number of a symmetric matrix travel twice. Here, for n owned nodal vectors:
    pointers (n + 1,), columns (u,)  the blocks right of the diagonal, columns ascend
    blocks (u, 9), diagonal (n, 9)   their numbers, row by row
    factor (u, 9), pivots (n, 9)     U and D^-1 of (I + Uᵀ) D (I + U), in single precision
Columns of other ranks' nodal vectors stay where the tangent is written, by scalar rows (`model/assembly`).

The factor has the pattern of the matrix: block IC(0), J. A. Meijerink and H. A. van der Vorst, Math. Comp. 31 (1977)
148. Single precision halves the memory it is read from, and conjugate gradients need no better one.
"""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
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

SMALLEST_PIVOT = 1e-3
"""Determinant of a pivot over that of the block it was: less is not clear of single precision."""


@inlined
def block_at(values, start, stride):
    """The nine numbers of a block."""
    two, three = start + stride, start + 2 * stride
    return (
        *(values[start], values[start + 1], values[start + 2]),
        *(values[two], values[two + 1], values[two + 2]),
        *(values[three], values[three + 1], values[three + 2]),
    )


@inlined
def vector_at(x, i):
    return x[i, 0], x[i, 1], x[i, 2]


@inlined
def row_at(table, k):
    """The nine numbers of a row of a table (m, 9)."""
    r = table[k]
    return r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]


@inlined
def put_row(table, k, a):
    r = table[k]
    r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8] = a


@kernel
def upper_pattern(pointers, columns):
    """Pointers and columns of the blocks right of the diagonal from those of all (n + 1,), (nnz,)."""
    n = pointers.size - 1
    upper, kept = np.zeros(n + 1, np.int64), np.empty((columns.size - n) // 2, np.int32)
    fill = 0
    for i in range(n):
        for k in range(pointers[i], pointers[i + 1]):
            if columns[k] > i:
                kept[fill] = columns[k]
                fill += 1
        upper[i + 1] = fill
    return upper, kept


@kernel
def copy_half(values, all_pointers, pointers, blocks, diagonal):
    """Fill blocks and diagonal from values by scalar rows, whose block rows begin at all_pointers (n + 1,)."""
    for i in range(pointers.size - 1):
        count, kept = all_pointers[i + 1] - all_pointers[i], pointers[i + 1] - pointers[i]
        start, stride = 9 * all_pointers[i] + 3 * (count - kept), 3 * count
        put_row(diagonal, i, block_at(values, start - 3, stride))
        for k in range(kept):
            put_row(blocks, pointers[i] + k, block_at(values, start + 3 * k, stride))


@kernel
def symmetric_product(pointers, columns, blocks, diagonal, x, y):
    """y = the matrix times x, both (n, 3)."""
    y[:] = 0.0
    for i in range(pointers.size - 1):
        u = vector_at(x, i)
        sx, sy, sz = apply(row_at(diagonal, i), u)
        for k in range(pointers[i], pointers[i + 1]):
            j, b = np.uint32(columns[k]), row_at(blocks, np.uint64(k))
            vx, vy, vz = vector_at(x, j)
            sx += b[0] * vx + b[1] * vy + b[2] * vz
            sy += b[3] * vx + b[4] * vy + b[5] * vz
            sz += b[6] * vx + b[7] * vy + b[8] * vz
            y[j, 0] += b[0] * u[0] + b[3] * u[1] + b[6] * u[2]
            y[j, 1] += b[1] * u[0] + b[4] * u[1] + b[7] * u[2]
            y[j, 2] += b[2] * u[0] + b[5] * u[1] + b[8] * u[2]
        y[i, 0] += sx
        y[i, 1] += sy
        y[i, 2] += sz


@kernel
def add_ghost_product(values, split, pointers, columns, x, y):
    """Add the columns of ghosts, by scalar rows from `split` on in values, times x (n + g, 3) to y (n, 3)."""
    for i in range(pointers.size - 1):
        low, count = pointers[i], pointers[i + 1] - pointers[i]
        for slot in range(count):
            b = block_at(values, split + 9 * low + 3 * slot, 3 * count)
            u = apply(b, vector_at(x, np.uint32(columns[low + slot])))
            y[i, 0] += u[0]
            y[i, 1] += u[1]
            y[i, 2] += u[2]


@register_jitable
def pivot_inverse(d, whole):
    """The inverse of a block of the diagonal; of the block before all updates where they left it not positive."""
    minor, det = d[0] * d[4] - d[1] * d[3], determinant(d)
    if not (d[0] > 0.0 and minor > 0.0 and det > SMALLEST_PIVOT * abs(determinant(whole))):
        d = whole
        minor, det = d[0] * d[4] - d[1] * d[3], determinant(d)
        if not (d[0] > 0.0 and minor > 0.0 and det > 0.0):
            size = max(abs(d[0]), abs(d[4]), abs(d[8]), 1e-300)
            d, det = (size, 0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size), size**3
    return transpose(inverse_transpose(d, det))


@kernel
def factorise(pointers, columns, blocks, diagonal, factor, pivots):
    """Fill factor and pivots. Blocks of the diagonal that updates leave indefinite stay without them."""
    remaining = diagonal.copy()
    for k in range(columns.size):
        put_row(factor, k, row_at(blocks, k))
    for i in range(pointers.size - 1):
        inverse = pivot_inverse(row_at(remaining, i), row_at(diagonal, i))
        put_row(pivots, i, inverse)
        eliminate(i, inverse, pointers, columns, factor, remaining)


@register_jitable
def eliminate(i, inverse, pointers, columns, factor, remaining):
    """Take row i from the rows below it, within the pattern, and divide it by its pivot."""
    for k in range(pointers[i], pointers[i + 1]):
        divided, j = transpose(dot(inverse, row_at(factor, k))), columns[k]
        put_row(remaining, j, add(row_at(remaining, j), scale(-1.0, dot(divided, row_at(factor, k)))))
        place, end = pointers[j], pointers[j + 1]
        for m in range(k + 1, pointers[i + 1]):
            while place < end and columns[place] < columns[m]:
                place += 1
            if place < end and columns[place] == columns[m]:
                taken = dot(divided, row_at(factor, m))
                put_row(factor, place, add(row_at(factor, place), scale(-1.0, taken)))
    for k in range(pointers[i], pointers[i + 1]):
        put_row(factor, k, dot(inverse, row_at(factor, k)))


@kernel
def solve_factors(pointers, columns, factor, pivots, r, work, z):
    """z = ((I + Uᵀ) D (I + U))^-1 r, both (n, 3). work (n, 3): single precision, overwritten."""
    n = pointers.size - 1
    for i in range(n):
        for c in range(3):
            work[i, c] = r[i, c]
    for i in range(n):
        ux, uy, uz = vector_at(work, i)
        for k in range(pointers[i], pointers[i + 1]):
            j, b = np.uint32(columns[k]), row_at(factor, np.uint64(k))
            work[j, 0] -= b[0] * ux + b[3] * uy + b[6] * uz
            work[j, 1] -= b[1] * ux + b[4] * uy + b[7] * uz
            work[j, 2] -= b[2] * ux + b[5] * uy + b[8] * uz
    for i in range(n - 1, -1, -1):
        sx, sy, sz = apply(row_at(pivots, i), vector_at(work, i))
        for k in range(pointers[i], pointers[i + 1]):
            b = row_at(factor, np.uint64(k))
            vx, vy, vz = vector_at(work, np.uint32(columns[k]))
            sx -= b[0] * vx + b[1] * vy + b[2] * vz
            sy -= b[3] * vx + b[4] * vy + b[5] * vz
            sz -= b[6] * vx + b[7] * vy + b[8] * vz
        work[i, 0] = sx
        work[i, 1] = sy
        work[i, 2] = sz
        z[i, 0] = sx
        z[i, 1] = sy
        z[i, 2] = sz
