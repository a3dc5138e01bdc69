"""Cholesky factors of sparse symmetric matrices in the envelope of their rows.

A. George, J. W. Liu, *Computer Solution of Large Sparse Positive Definite Systems*, Prentice-Hall 1981, chapter 4. A
row holds all columns from its first entry to the diagonal, so the loops inside run over neighbours in memory. Good
for bodies whose numbering keeps the rows short, as that of reverse Cuthill and McKee does.

    pointers (n+1,), columns, values  the matrix, rows of ascending or mixed columns, both triangles
    starts (n+1,)                     where the rows of the factor begin; row i ends with its diagonal
    factor (starts[n],)               L of L L^T, reciprocals on the diagonal
    free (n,)                         rows that are solved for; the others are left out, with 0 as solution
"""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import REGROUPED, kernel


@kernel
def envelope(pointers, columns):
    """starts (n+1,) of a matrix."""
    n = pointers.size - 1
    starts = np.zeros(n + 1, np.int64)
    for i in range(n):
        first = np.int64(i)
        for k in range(pointers[i], pointers[i + 1]):
            first = min(first, np.int64(columns[k]))
        starts[i + 1] = starts[i] + i - first + 1
    return starts


@register_jitable(fastmath=REGROUPED)
def dot(a, b):
    """Dot product; the compiler may reorder the sum."""
    total = 0.0
    for k in range(a.size):
        total += a[k] * b[k]
    return total


@register_jitable(fastmath=REGROUPED)
def dot_three(a, u, v, w):
    """Of a vector with three."""
    x = y = z = 0.0
    for k in range(a.size):
        x += a[k] * u[k]
        y += a[k] * v[k]
        z += a[k] * w[k]
    return x, y, z


@kernel
def factorise(starts, pointers, columns, values, free, factor):
    """Fill the factor; False if the matrix is not positive definite."""
    factor[:] = 0.0
    for i in range(starts.size - 1):
        if not free[i]:
            continue
        origin = starts[i + 1] - 1 - i  # where column 0 of the row would stand
        for k in range(pointers[i], pointers[i + 1]):
            j = columns[k]
            if j <= i and free[j]:
                factor[origin + j] = values[k]
        first = starts[i] - origin
        for j in range(first, i):
            before = starts[j + 1] - 1 - j
            common = max(first, starts[j] - before)
            known = dot(factor[origin + common : origin + j], factor[before + common : before + j])
            factor[origin + j] = (factor[origin + j] - known) * factor[before + j]
        row = factor[starts[i] : origin + i]
        rest = factor[origin + i] - dot(row, row)
        if not rest > 0.0:
            return False
        factor[origin + i] = 1.0 / np.sqrt(rest)
    return True


@register_jitable
def solve_one(starts, factor, y):
    """Overwrite the right side y (n,) with the solution."""
    n = starts.size - 1
    for i in range(n):
        end = starts[i + 1] - 1
        row = factor[starts[i] : end]
        y[i] = (y[i] - dot(row, y[i - row.size : i])) * factor[end]
    for i in range(n - 1, -1, -1):
        end = starts[i + 1] - 1
        row = factor[starts[i] : end]
        y[i] *= factor[end]
        above, value = y[i - row.size : i], y[i]
        for k in range(row.size):
            above[k] -= row[k] * value


@register_jitable
def solve_three(starts, factor, y):
    """Overwrite three right sides y (3, n) with their solutions; the factor is read once for all."""
    n, (u, v, w) = starts.size - 1, (y[0], y[1], y[2])
    for i in range(n):
        end = starts[i + 1] - 1
        row = factor[starts[i] : end]
        first = i - row.size
        a, b, c = dot_three(row, u[first:i], v[first:i], w[first:i])
        u[i], v[i], w[i] = (u[i] - a) * factor[end], (v[i] - b) * factor[end], (w[i] - c) * factor[end]
    for i in range(n - 1, -1, -1):
        end = starts[i + 1] - 1
        row = factor[starts[i] : end]
        first = i - row.size
        a, b, c = u[i] * factor[end], v[i] * factor[end], w[i] * factor[end]
        u[i], v[i], w[i] = a, b, c
        x, y_, z = u[first:i], v[first:i], w[first:i]
        for k in range(row.size):
            x[k] -= row[k] * a
            y_[k] -= row[k] * b
            z[k] -= row[k] * c


@register_jitable
def solve_components(starts, factors, which, b, work, a):
    """a (n, 3) of right sides b (n, 3): component c by the factor which[c] of factors (k, size); work (3, n)."""
    for i in range(b.shape[0]):
        for c in range(3):
            work[c, i] = b[i, c]
    if factors.shape[0] == 1:
        solve_three(starts, factors[0], work)
    else:
        for c in range(3):
            solve_one(starts, factors[which[c]], work[c])
    for i in range(b.shape[0]):
        for c in range(3):
            a[i, c] = work[c, i]


@kernel
def solve_fields(starts, factors, which, b, work):
    """`solve_components` for the interpreter; overwrites b (n, 3)."""
    solve_components(starts, factors, which, b, work, b)
