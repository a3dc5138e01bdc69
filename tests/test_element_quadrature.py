"""Quadrature rules: degree on all monomials, positivity, symmetry."""

from itertools import permutations, product
from math import factorial, prod

import numpy as np
import pytest

from ancf_petsc.element.cell import CELLS
from ancf_petsc.element.quadrature import SIMPLEX_RULES, Rule, rule, rule_of_degree

SIMPLEX = [(name, points) for name, table in SIMPLEX_RULES.items() for points in table]
GAUSS = [(name, n ** CELLS[name].dimension) for name in ("line", "quad", "hexahedron") for n in range(1, 8)]


def exact_integral(cell, exponents):
    """Integral of a monomial over the reference simplex or over the unit cube."""
    if cell.is_simplex:
        return prod(map(factorial, exponents)) / factorial(sum(exponents) + cell.dimension)
    return prod(1 / (n + 1) for n in exponents)


def errors(found, degree):
    """Relative errors (p) of the monomials of a total degree (simplex) or of degrees per direction (box)."""
    d = found.cell.dimension
    every = [e for e in product(range(degree + 1), repeat=d) if sum(e) == degree or not found.cell.is_simplex]
    exact = np.array([exact_integral(found.cell, e) for e in every])
    points = found.points if found.cell.is_simplex else found.points + 0.5
    return abs(np.array([found.weights @ np.prod(points**e, axis=1) for e in every]) / exact - 1)


@pytest.mark.parametrize(("name", "points"), SIMPLEX + GAUSS)
def test_degree_is_what_the_rule_says(name, points):
    """Exact to rounding up to its degree; some monomial of the next degree is missed."""
    found = rule(name, points)
    assert len(found) == points
    degrees = range(found.degree + 1) if found.cell.is_simplex else [found.degree]
    # All terms are positive: a coordinate's rounding times the degree, at most 13, is all there is.
    assert max(errors(found, degree).max() for degree in degrees) < 1e-13
    assert errors(found, found.degree + 1).max() > 1e-8


@pytest.mark.parametrize(("name", "points"), SIMPLEX)
def test_simplex_rules_are_symmetric_positive_and_inside(name, points):
    """The points with their weights are the same set after every renumbering of the corners."""
    found = rule(name, points)
    barycentric = np.column_stack([1 - found.points.sum(axis=1), found.points])
    assert barycentric.min() > 0
    assert found.weights.min() > 0

    def as_set(order):
        rows = np.round(np.column_stack([barycentric[:, order], found.weights]), 13)
        return {tuple(row + 0.0) for row in rows}

    assert len(as_set(range(barycentric.shape[1]))) == points
    for order in permutations(range(barycentric.shape[1])):
        assert as_set(list(order)) == as_set(range(barycentric.shape[1]))


def test_rule_of_degree_takes_the_fewest_points():
    assert [len(rule_of_degree("tetra", d)) for d in (0, 1, 2, 3, 4, 5, 6, 7, 8, 12)] == [
        *(1, 1, 4, 8, 14, 14, 24, 46, 46, 168)
    ]
    assert [len(rule_of_degree("triangle", d)) for d in (1, 2, 4, 5, 6, 8)] == [1, 3, 6, 7, 12, 16]
    assert [len(rule_of_degree("hexahedron", d)) for d in (1, 3, 4)] == [1, 8, 27]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rule("tetra", 11), "no rule of 11 points on the tetra; there are 1, 4, 8, 10, 14"),
        (lambda: rule("hexahedron", 9), r"no rule of 9 points on the hexahedron; expected n\^3"),
        (lambda: rule("line", 21), "the most is 20"),
        (lambda: rule_of_degree("triangle", 9), "the highest is 8"),
    ],
)
def test_rules_that_do_not_exist(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    ("points", "weights", "message"),
    [
        ([[0.25, 0.25]], [0.4], "sum of weights 0.4, expected 0.5"),
        ([[0.5, 0.5], [0.0, 0.0]], [0.6, -0.1], "not positive"),
        ([[0.2, 0.2], [0.5, 0.5]], [0.25, 0.25], "not symmetric"),
    ],
)
def test_a_rule_checks_itself(points, weights, message):
    with pytest.raises(ValueError, match=message):
        Rule(CELLS["triangle"], 1, np.array(points), np.array(weights))
