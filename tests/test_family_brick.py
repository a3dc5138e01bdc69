"""One 3843 as a unit cube of steel against its own derivation: monomials, W, Gauss points, all written out here."""

import itertools

import numpy as np
import pytest

from ancf_petsc.algebra.graph import block_starts, neighbours
from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.element.cell import CELLS
from ancf_petsc.kernel import point_solid
from ancf_petsc.kernel.interface import Span, Target
from ancf_petsc.kernel.tables import make_tables, map_functions
from ancf_petsc.material import LAWS
from ancf_petsc.model.mass import mean_products

YOUNG, POISSON, DENSITY = 210e9, 0.3, 7850.0
LAME, SHEAR = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON), YOUNG / 2 / (1 + POISSON)
CORNERS = np.array(CELLS["hexahedron"].corners, float) + 0.5
# Superlinear degree at most 3: what cubic serendipity means.
EXPONENTS = [p for p in itertools.product(range(4), repeat=3) if sum(n for n in p if n > 1) <= 3]


def monomials(points, order=(0, 0, 0)):
    """A derivative of the 32 monomials (q, p) at points (q, 3)."""
    columns = []
    for powers in EXPONENTS:
        value = np.ones(len(points))
        for x, n, k in zip(points.T, powers, order, strict=True):
            value = value * (n if k else 1) * x ** max(n - k, 0) * (n >= k)
        columns.append(value)
    return np.stack(columns, axis=1)


UNIT = tuple(map(tuple, np.eye(3, dtype=int)))
W = np.stack([monomials(CORNERS, o) for o in ((0, 0, 0), *UNIT)], axis=1).reshape(32, 32)
x, w = np.polynomial.legendre.leggauss(8)
POINTS = np.array(list(itertools.product((x + 1) / 2, repeat=3)))
WEIGHTS = np.array([a * b * c for a, b, c in itertools.product(w / 2, repeat=3)])
VALUES = monomials(POINTS) @ np.linalg.inv(W)
GRADIENTS = np.stack([monomials(POINTS, o) @ np.linalg.inv(W) for o in UNIT], axis=-1)
REFERENCE = np.concatenate((CORNERS[:, None], np.tile(np.eye(3), (8, 1, 1))), axis=1).reshape(32, 3)


def state(name):
    """Nodal vectors (32, 3) of a displacement state."""
    random = np.random.default_rng(7).normal(size=(32, 3))
    shear = np.array([[1.05, 0.1, 0.0], [0.0, 0.97, -0.05], [0.02, 0.0, 1.0]])
    return {"rest": REFERENCE, "sheared": REFERENCE @ shear.T, "bent": REFERENCE + 0.03 * random}[name]


def strained(q):
    F = np.einsum("ai,gaj->gij", q, GRADIENTS)
    E = (np.einsum("gki,gkj->gij", F, F) - np.eye(3)) / 2
    return F, LAME * np.trace(E, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 2 * SHEAR * E


def force(q):
    F, S = strained(q)
    return np.einsum("g,gij,gjk,gak->ai", WEIGHTS, F, S, GRADIENTS)


def tangent(q):
    F, S = strained(q)
    identity, B = np.eye(3), np.einsum("gij,gaj->gai", F, GRADIENTS)
    material = LAME * np.einsum("g,gai,gbk->aibk", WEIGHTS, B, B)
    swapped = np.einsum("g,giL,gkJ,gaJ,gbL->aibk", WEIGHTS, F, F, GRADIENTS, GRADIENTS, optimize=True)
    both = np.einsum("g,gij,gkj,gaJ,gbJ->aibk", WEIGHTS, F, F, GRADIENTS, GRADIENTS, optimize=True)
    geometric = np.einsum("g,gaJ,gJL,gbL,ik->aibk", WEIGHTS, GRADIENTS, S, GRADIENTS, identity, optimize=True)
    return material + SHEAR * (swapped + both) + geometric


@pytest.fixture(scope="module")
def program():
    row = ELEMENTS["3843"]
    cells = np.arange(32, dtype=np.int32)[None]
    return (
        row,
        make_tables(row, cells, CORNERS[None], quadrature="exact"),
        LAWS["svk"].parameters(YOUNG, POISSON),
    )


def test_mass_is_that_of_the_derivation(program):
    row, tables, _ = program
    half = np.stack([map_functions(m, tables.jacobians, row)[0] for m in mean_products(row)[0]], axis=0)
    mass = DENSITY * np.stack([map_functions(m, tables.jacobians, row)[0] for m in half.T], axis=1)
    wanted = DENSITY * np.einsum("g,ga,gb->ab", WEIGHTS, VALUES, VALUES)
    np.testing.assert_allclose(mass, wanted, rtol=0, atol=1e-12 * wanted.max())
    assert mass[::4, ::4].sum() == pytest.approx(DENSITY, rel=1e-13)


@pytest.mark.parametrize("name", ["rest", "sheared", "bent"])
def test_forces_and_tangent_are_those_of_the_derivation(program, name):
    row, tables, p = program
    q, kernels = np.ascontiguousarray(state(name)), point_solid.make_kernels(LAWS["svk"])
    found = np.zeros((32, 3))
    kernels.internal_force((q,), tables, p, Span(0, 1), found)
    # Rounding of F^T F - I, 1e-15, times the stiffness.
    np.testing.assert_allclose(found, force(q), rtol=0, atol=1e-14 * YOUNG)
    pointers, columns = neighbours(tables.nodes, 32, 32)
    none = np.zeros(33, np.int64)
    starts = block_starts(tables.nodes, 32, pointers, columns, none, np.zeros(0, np.int32), 3)
    strides = np.stack((np.full(32, 96, np.int32), np.zeros(32, np.int32)), axis=1)
    values = np.zeros(96 * 96)
    target = Target(starts, strides, len(values), np.zeros(32, np.uint8), values)
    kernels.tangent((q,), tables, p, Span(0, 1), target)
    wanted = tangent(q).reshape(96, 96)
    np.testing.assert_allclose(values.reshape(96, 96), wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())
