"""Shape functions from monomials and nodal functionals, in the reference cell.

With the row x(xi) of monomials, W_ij the i-th nodal functional (a value or a slope at a node) of the j-th
monomial and the nodal vectors q = W c, the shape functions are x W^-1. W is built and inverted in fractions,
so they are exact.

Slopes in the reference cell are with respect to xi; nodal slopes are with respect to the axes, dr/dxi_k =
sum_j J_jk dr/dX_j:
    N(slope j) = sum_k J_jk Nhat(slope k),   dN/dX = dN/dxi J^-1.

Source: Olshevskiy et al., Nonlinear Dynamics 88 (2017) 2457, Eqs. (1)-(5), in the affine coordinates of the
cell.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from math import perm, prod

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Exponents = tuple[int, ...]
Matrix = list[list[Fraction]]
# A nodal functional: the derivative of these orders at this point.
Functional = tuple[tuple[Fraction, ...], Exponents]


@dataclass(frozen=True)
class ElementTables:
    """Shape functions of the reference cell at quadrature points.

    points (q, k), weights (q), values (q, a), gradients (q, a, k) with respect to xi, and of each shape
    function a its node (a) and its slot (a): 0 for the position, j for the slope along xi_j.
    """

    points: Floats
    weights: Floats
    values: Floats
    gradients: Floats
    node: NDArray[np.int64]
    slot: NDArray[np.int64]


def monomials(dimension: int, text: str) -> tuple[Exponents, ...]:
    """Exponents of monomials written as "1 x y xy x2y"; "P3" stands for all of degree 3 and less."""
    rows: list[Exponents] = []
    for word in text.split():
        if complete := re.fullmatch(r"P(\d)", word):
            rows += complete_polynomials(dimension, int(complete[1]))
        else:
            power = {axis: int(n or 1) for axis, n in re.findall(r"([xyz])(\d*)", word)}
            rows.append(tuple(power.get(axis, 0) for axis in "xyz"[:dimension]))
    return tuple(rows)


def complete_polynomials(dimension: int, degree: int) -> list[Exponents]:
    """Exponents of all monomials up to `degree`, lowest first."""
    rows = product(range(degree + 1), repeat=dimension)
    return sorted((row for row in rows if sum(row) <= degree), key=lambda row: (sum(row), [-n for n in row]))


def shape_coefficients(exponents: Sequence[Exponents], functionals: Sequence[Functional]) -> Matrix:
    """W^-1 (p, a), exact. Raises ValueError where the functionals do not determine the polynomial."""
    W = [[_derivative(exponent, order, point) for exponent in exponents] for point, order in functionals]
    return inverse(W)


def _derivative(exponent: Exponents, order: Exponents, point: Sequence[Fraction]) -> Fraction:
    """The derivative of a monomial at a point."""
    factors = (perm(n, k) * x ** max(n - k, 0) for n, k, x in zip(exponent, order, point, strict=True))
    return prod(factors, start=Fraction(1))


def inverse(matrix: Matrix) -> Matrix:
    """Inverse of a square matrix of fractions by Gauss and Jordan. Raises ValueError where it is singular."""
    n = len(matrix)
    if any(len(row) != n for row in matrix):
        raise ValueError(f"{n} nodal functionals for {len(matrix[0])} monomials; expected as many of both")
    rows = [list(row) + [Fraction(int(i == j)) for j in range(n)] for i, row in enumerate(matrix)]
    for column in range(n):
        pivot = next((i for i in range(column, n) if rows[i][column]), None)
        if pivot is None:
            raise ValueError("the nodal functionals do not determine the monomials: W is singular")
        rows[column], rows[pivot] = rows[pivot], rows[column]
        scale = 1 / rows[column][column]
        chosen = rows[column] = [scale * x if x else x for x in rows[column]]
        for i, row in enumerate(rows):
            factor = row[column]
            if i != column and factor:
                rows[i] = [x - factor * y if y else x for x, y in zip(row, chosen, strict=True)]
    return [row[n:] for row in rows]


def tabulate(
    exponents: Sequence[Exponents], coefficients: Floats, points: ArrayLike, order: Sequence[int]
) -> Floats:
    """A derivative of all shape functions (q, a) at reference points (q, k) from coefficients (p, a)."""
    powers = np.array(exponents)
    factors = np.array(
        [[perm(n, k) for n, k in zip(row, order, strict=True)] for row in exponents], dtype=float
    )
    points = np.asarray(points, dtype=float)
    reduced = np.maximum(powers - np.array(order), 0)
    return np.prod(factors * points[:, None, :] ** reduced, axis=2) @ coefficients


def cartesian_values(values: Floats, slot: NDArray[np.int64], jacobian: Floats) -> Floats:
    """Shape functions (e, q, a) for slopes along the axes, from reference values (q, a)."""
    return _combine_slopes(
        np.broadcast_to(values, (len(jacobian), *values.shape))[..., None], slot, jacobian
    )[..., 0]


def cartesian_gradients(
    gradients: Floats, slot: NDArray[np.int64], jacobian: Floats, inverse_jacobian: Floats
) -> Floats:
    """Gradients dN/dX (e, q, a, j) for slopes along the axes, from reference gradients (q, a, k)."""
    return _combine_slopes(np.einsum("qak,ekj->eqaj", gradients, inverse_jacobian), slot, jacobian)


def _combine_slopes(functions: Floats, slot: NDArray[np.int64], jacobian: Floats) -> Floats:
    """N(slope j) = sum_k J_jk Nhat(slope k) for functions (e, q, a, ...); positions stay."""
    combined = np.array(functions)
    d = jacobian.shape[-1]
    if slot.max() > 0:
        along = np.stack([functions[:, :, slot == k + 1] for k in range(d)], axis=-1)
        for j in range(d):
            combined[:, :, slot == j + 1] = np.einsum("eqn...k,ek->eqn...", along, jacobian[:, j])
    return combined
