"""Cells on which every element of the catalogue is tried, and fields to interpolate on them."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.element.shape import cartesian_gradients, cartesian_values, complete_polynomials

EPS = np.finfo(float).eps
CODES = tuple(ELEMENTS)
SHAPES = ("right-corner", "kuhn", "random 0", "random 1", "stretched", "far", "micrometre", "kilometre")


def rotation(d, generator):
    """A random rotation (d, d)."""
    q, _ = np.linalg.qr(generator.normal(size=(d, d)))
    return q * np.sign(np.linalg.det(q)) if d % 2 else q @ np.diag([1.0] * (d - 1) + [np.linalg.det(q)])


def corners_of(cell, shape):
    """Corners (1, c, 3) of one cell of the given shape."""
    d = cell.dimension
    generator = np.random.default_rng(list(f"{cell.name} {shape}".encode()))
    frame = rotation(d, generator) if d > 1 else np.eye(1)
    maps = {
        "right-corner": np.eye(d),
        "kuhn": np.triu(np.ones((d, d))),
        "stretched": frame @ np.diag([100.0] + [1.0] * (d - 1)),
        "far": frame,
        "micrometre": 1e-6 * frame,
        "kilometre": 1e3 * frame,
    }
    linear = maps.get(shape)
    while linear is None:
        trial = generator.normal(size=(d, d))
        linear = trial if np.linalg.det(trial) > 0.1 else None
    points = np.zeros((1, len(cell.corners), 3))
    points[0, :, :d] = np.array(cell.corners, dtype=float) @ linear.T
    if d == 1:
        points[0] = points[0, :, :1] * np.array([0.6, 0.8, 0.0])
    return points + (np.array([1e4, -2e4, 3e4]) * [1, 1, d == 3] if shape == "far" else 0.0)


def size_of(jacobian):
    """The longest edge vector of a cell with this jacobian (d, d)."""
    return np.linalg.norm(jacobian, axis=0).max()


def polynomials(d, degree):
    """Exponents (p, d) of all polynomials up to the degree."""
    return np.array(complete_polynomials(d, degree))


def evaluate(exponents, y):
    """Monomials (n, p) and their gradients (n, p, d) at points y (n, d)."""
    values = np.prod(y[:, None, :] ** exponents, axis=2)
    gradients = np.empty((*values.shape, y.shape[1]))
    for k in range(y.shape[1]):
        lower = exponents - (np.arange(y.shape[1]) == k)
        gradients[..., k] = exponents[:, k] * np.prod(y[:, None, :] ** np.maximum(lower, 0), axis=2)
    return values, gradients


def nodal_vectors(element, jacobian, exponents):
    """Nodal vectors (a, p) of the monomials in (X - X0) / size."""
    size = size_of(jacobian)
    values, gradients = evaluate(exponents, element.node_coordinates @ jacobian.T / size)
    slopes = np.concatenate([values[..., None], gradients / size], axis=2)
    return slopes[element.node, :, element.slot]


def functions_at(element, geometry, xi):
    """Shape functions (q, a) and gradients (q, a, j) of the first cell for slopes along the axes."""
    values = cartesian_values(element.values(xi), element.slot, geometry.jacobian)[0]
    gradients = cartesian_gradients(element.gradients(xi), element.slot, geometry.jacobian, geometry.inverse)[
        0
    ]
    return values, gradients


def inside(cell, n, seed=0):
    """n random points (n, d) inside the reference cell."""
    weights = np.random.default_rng(seed).dirichlet(np.ones(len(cell.corners)), size=n)
    return weights @ np.array(cell.corners, dtype=float)


def turnings(cell):
    """All renumberings of the corners by affine maps of the reference cell that keep its sense."""
    corners = np.array(cell.corners, dtype=float)
    d = cell.dimension
    if cell.is_simplex:
        orders = permutations(range(d + 1))
        return [p for p in orders if np.linalg.det(corners[list(p)][1:] - corners[p[0]]) > 0]
    found = []
    for axes, signs in product(permutations(range(d)), product((1, -1), repeat=d)):
        turn = np.eye(d)[list(axes)] * np.array(signs)[:, None]
        if np.linalg.det(turn) > 0:
            image = corners @ turn.T
            found.append(tuple(int(np.flatnonzero((corners == x).all(axis=1))[0]) for x in image))
    return found
