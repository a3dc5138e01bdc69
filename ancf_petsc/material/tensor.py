"""Second-order tensors as tuples of nine numbers, row by row, and vectors as tuples of three.

Tuples live in registers: inside compiled kernels these functions become plain arithmetic without memory
traffic. All are `inlined`: Python functions here, compiled into the kernel that calls them, and safe for
numba's cache.
"""

from __future__ import annotations

from numba.extending import register_jitable

inlined = register_jitable(forceinline=True)
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@inlined
def trace(a):
    return a[0] + a[4] + a[8]


@inlined
def determinant(a):
    return (
        a[0] * (a[4] * a[8] - a[5] * a[7])
        - a[1] * (a[3] * a[8] - a[5] * a[6])
        + a[2] * (a[3] * a[7] - a[4] * a[6])
    )


@inlined
def inverse_transpose(a, det):
    """Cofactors of a over its determinant."""
    r = 1.0 / det
    return (
        (a[4] * a[8] - a[5] * a[7]) * r,
        (a[5] * a[6] - a[3] * a[8]) * r,
        (a[3] * a[7] - a[4] * a[6]) * r,
        (a[2] * a[7] - a[1] * a[8]) * r,
        (a[0] * a[8] - a[2] * a[6]) * r,
        (a[1] * a[6] - a[0] * a[7]) * r,
        (a[1] * a[5] - a[2] * a[4]) * r,
        (a[2] * a[3] - a[0] * a[5]) * r,
        (a[0] * a[4] - a[1] * a[3]) * r,
    )


@inlined
def add(a, b):
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
    )


@inlined
def scale(s, a):
    return (s * a[0], s * a[1], s * a[2], s * a[3], s * a[4], s * a[5], s * a[6], s * a[7], s * a[8])


@inlined
def contract(a, b):
    """a : b, the sum of products of components."""
    return (
        a[0] * b[0]
        + a[1] * b[1]
        + a[2] * b[2]
        + a[3] * b[3]
        + a[4] * b[4]
        + a[5] * b[5]
        + a[6] * b[6]
        + a[7] * b[7]
        + a[8] * b[8]
    )


@inlined
def transpose(a):
    return (a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8])


@inlined
def dot(a, b):
    """Product a b."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@inlined
def gram(a):
    """aᵀ a, symmetric."""
    xx = a[0] * a[0] + a[3] * a[3] + a[6] * a[6]
    yy = a[1] * a[1] + a[4] * a[4] + a[7] * a[7]
    zz = a[2] * a[2] + a[5] * a[5] + a[8] * a[8]
    xy = a[0] * a[1] + a[3] * a[4] + a[6] * a[7]
    yz = a[1] * a[2] + a[4] * a[5] + a[7] * a[8]
    zx = a[2] * a[0] + a[5] * a[3] + a[8] * a[6]
    return (xx, xy, zx, xy, yy, yz, zx, yz, zz)


@inlined
def apply(a, v):
    """a v."""
    return (
        a[0] * v[0] + a[1] * v[1] + a[2] * v[2],
        a[3] * v[0] + a[4] * v[1] + a[5] * v[2],
        a[6] * v[0] + a[7] * v[1] + a[8] * v[2],
    )


@inlined
def inner(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@inlined
def outer(u, v):
    return (
        u[0] * v[0],
        u[0] * v[1],
        u[0] * v[2],
        u[1] * v[0],
        u[1] * v[1],
        u[1] * v[2],
        u[2] * v[0],
        u[2] * v[1],
        u[2] * v[2],
    )
