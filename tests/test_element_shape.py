"""Every element of the catalogue on every kind of cell: what shape functions must do."""

import numpy as np
import pytest
from element_cells import (
    CODES,
    EPS,
    SHAPES,
    corners_of,
    evaluate,
    functions_at,
    inside,
    nodal_vectors,
    polynomials,
    size_of,
    turnings,
)

from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.element.cell import CELLS, cell_geometry
from ancf_petsc.element.shape import cartesian_values

each_element = pytest.mark.parametrize("code", CODES)
each_shape = pytest.mark.parametrize("shape", SHAPES)


@each_element
def test_nodality_is_exact(code):
    """One nodal value or slope of a shape function is 1 and all others are 0: in fractions, no tolerance."""
    element = ELEMENTS[code]
    d = element.cell.dimension
    for a, node in enumerate(element.node):
        point = element.cell.centre(element.nodes[node].corners)
        order = [int(element.slot[a] == k + 1) for k in range(d)]
        row = [0] * element.functions
        for exponents, coefficients in zip(element.exponents, element.exact_coefficients, strict=True):
            monomial = 1
            for n, k, x in zip(exponents, order, point, strict=True):
                monomial *= (n * x ** max(n - 1, 0)) if k else x**n
            row = [r + monomial * c for r, c in zip(row, coefficients, strict=True)]
        assert row == [int(b == a) for b in range(element.functions)]


@each_element
@each_shape
def test_nodality_with_slopes_along_the_axes(code, shape):
    element = ELEMENTS[code]
    geometry = element.geometry(corners_of(element.cell, shape))
    values, gradients = functions_at(element, geometry, element.node_coordinates)
    every = np.concatenate([values[..., None], gradients], axis=2)[element.node, :, element.slot]
    h = size_of(geometry.jacobian[0])
    unit = np.where(element.slot > 0, h, 1.0)
    # Rounding of J^-1 J grows with the condition number; coefficients of the functions are below 100.
    tolerance = 100 * EPS * np.linalg.cond(geometry.jacobian[0]) ** 2
    np.testing.assert_allclose(
        every * unit[:, None] / unit, np.eye(element.functions), rtol=0, atol=tolerance
    )


@each_element
@each_shape
def test_reproduces_all_polynomials_it_claims(code, shape):
    """Values and gradients inside; constants are the partition of unity, linears the undeformed cell."""
    element = ELEMENTS[code]
    d = element.cell.dimension
    geometry = element.geometry(corners_of(element.cell, shape))
    J, h = geometry.jacobian[0], size_of(geometry.jacobian[0])
    exponents = polynomials(d, element.complete)
    xi = inside(element.cell, 20)
    values, gradients = functions_at(element, geometry, xi)
    q = nodal_vectors(element, J, exponents)
    expected, slopes = evaluate(exponents, xi @ J.T / h)
    # Rounding of a sum of products, and of J^-1 in gradients.
    np.testing.assert_array_less(abs(values @ q - expected), 100 * EPS * (abs(values) @ abs(q) + 1))
    found = np.einsum("qaj,ap->qpj", gradients, q) * h
    size = np.einsum("qaj,ap->qpj", abs(gradients), abs(q)) * h
    condition = np.linalg.cond(J)
    np.testing.assert_array_less(abs(found - slopes), 100 * EPS * condition * (size.max() + 1))


@each_element
def test_claims_no_degree_too_few(code):
    """The first degree beyond the claim is not reproduced, so that the claim is not modest."""
    element = ELEMENTS[code]
    geometry = element.geometry(corners_of(element.cell, "random 0"))
    exponents = polynomials(element.cell.dimension, element.complete + 1)
    xi = inside(element.cell, 20)
    values, _ = functions_at(element, geometry, xi)
    J = geometry.jacobian[0]
    expected, _ = evaluate(exponents, xi @ J.T / size_of(J))
    assert abs(values @ nodal_vectors(element, J, exponents) - expected).max() > 1e-4


@each_element
def test_gradients_are_those_of_the_values(code):
    """The five-point formula is exact up to degree 4 in each direction: rounding over the step is left."""
    element = ELEMENTS[code]
    xi, step = inside(element.cell, 10), 0.1
    gradients = element.gradients(xi)
    for k, along in enumerate(step * np.eye(element.cell.dimension)):
        one = element.values(xi + along) - element.values(xi - along)
        two = element.values(xi + 2 * along) - element.values(xi - 2 * along)
        np.testing.assert_allclose(gradients[..., k], (8 * one - two) / (12 * step), rtol=0, atol=1e-12)


def test_second_derivatives_of_the_beam():
    """Hermite's functions: the bending moment of a cantilever is linear."""
    beam = ELEMENTS["1222"]
    second = beam.derivative(np.array([[-0.5], [0.5]]), (2,))
    np.testing.assert_allclose(second, [[-6, -4, 6, -2], [6, 2, -6, 4]], atol=1e-14)


def neighbour(cell, points, facet, generator):
    """Global corner numbers and corners of a cell across a facet, in a random numbering.

    points (c, 3) are the corners of the first cell, numbered 0, 1, ...; new corners get new numbers.
    """
    c = len(points)
    numbers, new = np.arange(c), {}
    centre = points[list(facet)].mean(axis=0)
    if cell.is_simplex:
        (apex,) = set(range(c)) - set(facet)
        numbers[apex] = c
        new[c] = centre + 0.7 * (centre - points[apex]) + 0.1 * (points[facet[0]] - centre)
        i, j = facet[:2]
        numbers[i], numbers[j] = numbers[j], numbers[i]
    else:
        corners = np.array(cell.corners, dtype=float)
        axis = int(np.flatnonzero(np.ptp(corners[list(facet)], axis=0) == 0)[0])
        partner = {
            i: int(np.flatnonzero((corners == x).all(axis=1))[0])
            for i, x in enumerate(_mirror(corners, axis))
        }
        tilt = points[facet[0]] - points[partner[facet[0]]] + 0.2 * (points[facet[-1]] - points[facet[0]])
        for i in facet:
            numbers[partner[i]] = i
            numbers[i] = c + i
            new[c + i] = points[i] + tilt
    where = {**dict(enumerate(points)), **new}
    turned = numbers[list(turnings(cell)[generator.integers(len(turnings(cell)))])]
    return turned, np.array([where[n] for n in turned])


def _mirror(corners, axis):
    image = corners.copy()
    image[:, axis] *= -1
    return image


@each_element
@each_shape
def test_continuous_across_shared_facets(code, shape):
    """Two cells with one facet, numbered differently, the same nodal vectors: no jump beyond rounding."""
    element, generator = ELEMENTS[code], np.random.default_rng(7)
    cell, points = element.cell, corners_of(element.cell, shape)
    h = size_of(element.geometry(points).jacobian[0])
    # Edge vectors are differences of coordinates: far from the origin they carry its rounding.
    rounding = 200 * EPS * (1 + abs(points).max() / h)
    for facet in cell.facets:
        numbers, other = neighbour(cell, points[0], facet, generator)
        sides = ((np.arange(len(cell.corners)), points), (numbers, other[None]))
        shared, weights, traces, sizes = {}, generator.dirichlet(np.ones(len(facet)), size=8), [], []
        if not cell.is_simplex and len(facet) == 4:
            s, t = generator.random((2, 8))
            weights = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1)
        for global_numbers, corners in sides:
            geometry = element.geometry(corners)
            local = [int(np.flatnonzero(global_numbers == n)[0]) for n in facet]
            values, gradients = functions_at(
                element, geometry, weights @ np.array(cell.corners, float)[local]
            )
            q = np.empty(element.functions)
            for a, node in enumerate(element.node):
                key = (frozenset(global_numbers[list(element.nodes[node].corners)]), element.slot[a])
                q[a] = shared.setdefault(key, generator.normal() / (h if element.slot[a] else 1))
            trace = values @ q
            if element.continuity == 1:
                trace = np.append(trace, h * gradients[..., 0] @ q)
            traces.append(trace)
            sizes.append((abs(values) @ abs(q)).max())
        assert abs(traces[0] - traces[1]).max() < rounding * max(*sizes, 1)


@each_element
def test_divergence_theorem_on_the_facets(code):
    """Sum over facets of int n_i X_j dA is delta_ij V: orientation, weights and points of `part_tables`."""
    element = ELEMENTS[code]
    d = element.cell.dimension
    points = corners_of(element.cell, "random 0")
    geometry = element.geometry(points)
    x = points[0, :, :d] if d > 1 else geometry.jacobian[0] * np.array(element.cell.corners, dtype=float)
    moments = np.zeros((d, d))
    for facet in element.cell.facets:
        tables = element.part_tables(facet, 3)
        normal = _area_vector(x[list(facet)]) if d > 1 else np.sign(x[list(facet)][0])
        q = nodal_vectors(element, geometry.jacobian[0], np.eye(d, dtype=int)) * size_of(geometry.jacobian[0])
        position = cartesian_values(tables.values, element.slot, geometry.jacobian)[0] @ q
        moments += np.outer(normal, tables.weights @ position)
    volume = geometry.determinant[0] * float(element.cell.volume)
    np.testing.assert_allclose(moments, volume * np.eye(d), rtol=0, atol=1e-13 * abs(moments).max())


def _area_vector(x):
    """Outward normal of a facet times the measure per unit of the reference part."""
    edge = x[1] - x[0]
    return np.array([edge[1], -edge[0]]) if x.shape[1] == 2 else np.cross(edge, x[-1] - x[0])


@pytest.mark.parametrize("name", CELLS)
@each_shape
def test_affine_map_meets_the_corners(name, shape):
    cell = CELLS[name]
    points = corners_of(cell, shape)
    geometry = cell_geometry(cell, points)
    d = cell.dimension
    if d == 1:
        assert geometry.jacobian[0, 0, 0] == pytest.approx(
            np.linalg.norm(points[0, 1] - points[0, 0]), rel=1e-14
        )
        return
    image = geometry.origin[0] + np.array(cell.corners, dtype=float) @ geometry.jacobian[0].T
    np.testing.assert_allclose(image, points[0, :, :d], rtol=0, atol=8 * EPS * abs(points).max())
    assert geometry.determinant[0] > 0
