"""The generic kernels: equal to the fast path of 3413, and derivatives of one energy."""

import numpy as np
import pytest
from element_cells import CODES, EPS, SHAPES, corners_of, functions_at, rotation, size_of

from ancf_petsc.algebra.graph import block_starts, neighbours
from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.kernel import point_solid, tet3413
from ancf_petsc.kernel.interface import Means, Span, Target
from ancf_petsc.kernel.tables import make_tables
from ancf_petsc.material import LAWS
from ancf_petsc.material.models import plane_stress

KERNEL_CODES = tuple(code for code in CODES if ELEMENTS[code].components == ELEMENTS[code].cell.dimension)
SOLIDS = tuple(code for code in KERNEL_CODES if ELEMENTS[code].components == 3)
ONE = Span(0, 1)
each_element = pytest.mark.parametrize("code", KERNEL_CODES)
each_shape = pytest.mark.parametrize("shape", SHAPES)
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=list(LAWS))


class OneCell:
    """One deformed cell of an element, with everything the kernels take."""

    def __init__(self, code, law, shape="random 0", *, quadrature="default", amplitude=0.01):
        self.element, self.kernels = ELEMENTS[code], point_solid.make_kernels(law)
        self.parameters = law.parameters(1.0, 0.3)
        n = self.element.functions
        corners = corners_of(self.element.cell, shape)
        self.cells = np.arange(n, dtype=np.int32)[None]
        self.tables = make_tables(self.element, self.cells, corners, quadrature=quadrature)
        self.geometry = self.element.geometry(corners)
        self.reference = self.nodal_vectors(np.eye(3))
        # Positions move by a part of the thinnest direction, and so do the ends of slopes along the longest one.
        thin = np.linalg.svd(self.geometry.jacobian[0], compute_uv=False).min()
        self.scale = np.where(self.element.slot > 0, thin / size_of(self.geometry.jacobian[0]), thin)
        # Of difference quotients: 1e-16 of the coordinates over steps of 1e-3 of the thinnest direction, times 1e4.
        self.rounding = 1e-9 * max(1.0, abs(corners).max() / thin / 100)
        self.generator = np.random.default_rng(5)
        self.positions = self.reference + amplitude * self.random()

    def nodal_vectors(self, F):
        """Nodal vectors (a, 3) of the homogeneous deformation F."""
        d = self.element.cell.dimension
        x = np.zeros((len(self.element.nodes), 3))
        x[:, :d] = self.geometry.origin[0] + self.element.node_coordinates @ self.geometry.jacobian[0].T
        vectors = (x @ F.T)[self.element.node]
        for j in range(d):
            vectors[self.element.slot == j + 1] = F[:, j]
        return vectors

    def random(self):
        """Random nodal vectors in the space of the element, of the size of a deformation."""
        d = self.element.cell.dimension
        moves = np.zeros((self.element.functions, 3))
        moves[:, :d] = self.generator.normal(size=(len(moves), d)) * self.scale[:, None]
        return moves

    def energy(self, positions):
        return self.kernels.energy((positions,), self.tables, self.parameters, ONE)

    def force(self, positions):
        force = np.zeros_like(positions)
        self.kernels.internal_force((positions,), self.tables, self.parameters, ONE, force)
        return force

    def product(self, positions, direction):
        force = np.zeros_like(positions)
        self.kernels.tangent_product((positions, direction), self.tables, self.parameters, ONE, force)
        return force

    def tangent(self, positions, driven=None):
        return assembled(self.kernels, positions, self.tables, self.parameters, driven)


def assembled(kernels, positions, tables, parameters, driven=None, *, later=None):
    """The tangent as a dense matrix (3 v, 3 v); that between two states where there is a later one."""
    cells, v = tables.nodes, len(positions)
    pointers, columns = neighbours(cells, v, v)
    starts = block_starts(cells, v, pointers, columns, np.zeros(v + 1, np.int64), np.zeros(0, np.int32), 3)
    strides = np.zeros((v, 2), np.int32)
    strides[:, 0] = 3 * np.diff(pointers)
    values = np.zeros(9 * len(columns))
    driven = np.zeros(v, np.uint8) if driven is None else driven
    target = Target(starts, strides, len(values), driven, values)
    rest = (tables, parameters, Span(0, len(cells)), target)
    if later is None:
        kernels.tangent((positions,), *rest)
    else:
        kernels.mean_tangent((positions, later), *rest)
    dense = np.zeros((v, 3, v, 3))
    for i in range(v):
        near = columns[pointers[i] : pointers[i + 1]]
        block = values[9 * pointers[i] : 9 * pointers[i + 1]].reshape(3, len(near), 3)
        dense[i][:, near] = block
    return dense.reshape(3 * v, 3 * v)


def two_tetrahedra():
    """A small mesh of 3413 in a deformed state, away from the origin."""
    points = np.vstack((np.zeros(3), np.eye(3), [0.8, 0.9, 0.7])) + [10.0, -20.0, 5.0]
    cells = np.array([[0, 1, 2, 3], [1, 2, 3, 4]], np.int32)
    return points, cells, points + 0.05 * np.random.default_rng(0).normal(size=points.shape)


@each_law
def test_fast_path_of_3413_equals_the_generic_kernels(law):
    """Forces, energy, tangent with driven degrees of freedom, its product, fields, the smallest det F, what is between states."""
    points, cells, positions = two_tetrahedra()
    fast, general = tet3413.make_kernels(law), point_solid.make_kernels(law)
    p = law.parameters(1.0, 0.3)
    driven = np.array([0, 0b101, 0, 0b111, 0], np.uint8)
    direction = np.random.default_rng(1).normal(size=positions.shape)
    answers = []
    for kernels, tables in (
        (fast, tet3413.tetrahedra(cells, points)),
        (general, make_tables(ELEMENTS["3413"], cells, points[cells])),
    ):
        force, product = np.zeros_like(positions), np.zeros_like(positions)
        means, rest = Means(np.empty((2, 9)), np.empty((2, 9)), np.empty(2)), (tables, p, Span(0, 2))
        smallest = kernels.internal_force((positions,), *rest, force)
        kernels.tangent_product((positions, direction), *rest, product)
        kernels.fields((positions,), *rest, means)
        energy = kernels.energy((positions,), *rest)
        later, between = positions + 0.02 * direction, np.zeros_like(positions)
        kernels.mean_force((positions, later), *rest, between)
        K = assembled(kernels, positions, tables, p, driven)
        mean_K = assembled(kernels, positions, tables, p, driven, later=later)
        answers.append((force, product, *means, K, between, mean_K, np.array([smallest, energy])))
    for one, other in zip(*answers, strict=True):
        # Coordinates of 20 sizes of a cell: their differences carry 20 eps.
        np.testing.assert_allclose(one, other, rtol=0, atol=200 * EPS * abs(one).max())


@each_element
@each_law
@each_shape
def test_force_is_the_gradient_of_the_energy(code, law, shape):
    """Central differences of sixth order along random directions."""
    cell = OneCell(code, law, shape)
    force, h = cell.force(cell.positions), 1e-3
    for _ in range(3):
        v = cell.random()
        steps = [
            cell.energy(cell.positions + k * h * v) - cell.energy(cell.positions - k * h * v)
            for k in (1, 2, 3)
        ]
        slope = (45 * steps[0] - 9 * steps[1] + steps[2]) / (60 * h)
        # Rounding of the energy over the step, 1e-16 / 1e-3, and the neglected seventh derivative.
        scale = np.linalg.norm(force * cell.scale[:, None]) * np.linalg.norm(v / cell.scale[:, None])
        assert np.sum(force * v) == pytest.approx(slope, abs=cell.rounding * scale)


@each_element
@each_law
@each_shape
def test_tangent_is_symmetric_and_the_derivative_of_the_force(code, law, shape):
    cell = OneCell(code, law, shape)
    K = cell.tangent(cell.positions)
    unit = np.repeat(cell.scale, 3)
    scaled = K * unit[:, None] * unit
    # The matrix mirrors its blocks; only diagonal blocks are computed twice.
    np.testing.assert_allclose(scaled, scaled.T, rtol=0, atol=100 * EPS * abs(scaled).max())
    h = 1e-3
    for _ in range(3):
        v = cell.random()
        steps = [
            cell.force(cell.positions + k * h * v) - cell.force(cell.positions - k * h * v) for k in (1, 2, 3)
        ]
        change = (45 * steps[0] - 9 * steps[1] + steps[2]) / (60 * h)
        product = (K @ v.ravel()).reshape(-1, 3)
        size = abs(product * cell.scale[:, None]).max()
        np.testing.assert_allclose(
            product * cell.scale[:, None], change * cell.scale[:, None], rtol=0, atol=cell.rounding * size
        )
        np.testing.assert_allclose(
            cell.product(cell.positions, v), product, rtol=0, atol=1e-13 * abs(product).max()
        )


@each_element
@each_law
def test_forces_turn_with_the_body(code, law):
    """Objectivity: Q(R r + c) = R Q(r), and no force in a rigid motion; in the plane for those that lie there."""
    cell = OneCell(code, law)
    d = cell.element.cell.dimension
    R, c = np.eye(3), np.array([1.0, -2.0, 0.5]) * (np.arange(3) < d)
    R[:d, :d] = rotation(d, np.random.default_rng(3))
    moved = cell.positions @ R.T + np.where(cell.element.slot[:, None] == 0, c, 0.0)
    rigid = cell.reference @ R.T + np.where(cell.element.slot[:, None] == 0, c, 0.0)
    # Rounding of positions times the stiffness.
    tolerance = 1e-14 * abs(cell.tangent(rigid)).max() * (1 + abs(rigid).max())
    np.testing.assert_allclose(cell.force(moved), cell.force(cell.positions) @ R.T, rtol=0, atol=tolerance)
    np.testing.assert_allclose(cell.force(rigid), 0.0, atol=tolerance)


@pytest.mark.parametrize(
    ("code", "quadrature"),
    [(code, name) for code in SOLIDS for name in ELEMENTS[code].points if name != "mass"],
)
@each_law
def test_patch_test_of_one_cell(code, quadrature, law):
    """Constant stress: nodal forces are those of the tractions P n on the faces, which a mesh balances."""
    cell = OneCell(code, law, "random 1", quadrature=quadrature)
    F = np.eye(3) + 0.1 * np.random.default_rng(2).normal(size=(3, 3))
    P = np.array(law.stress(tuple(F.ravel()), cell.parameters)).reshape(3, 3)
    force = cell.force(cell.nodal_vectors(F))
    expected = np.zeros_like(force)
    corners = np.array(cell.element.cell.corners, dtype=float) @ cell.geometry.jacobian[0].T
    for facet in cell.element.cell.facets:
        tables = cell.element.part_tables(facet, 5)
        values, _ = functions_at(cell.element, cell.geometry, tables.points)
        x = corners[list(facet)]
        expected += np.outer(tables.weights @ values, P @ np.cross(x[1] - x[0], x[-1] - x[0]))
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-13 * abs(force).max())


@each_element
def test_forces_are_the_sums_of_the_theory(code):
    """Q_a = int P dN_a/dX dV for St Venant-Kirchhoff, by plain sums over the shape functions."""
    cell = OneCell(code, LAWS["svk"])
    d, lame, mu = cell.element.cell.dimension, *cell.parameters
    rule = cell.element.rule()
    _, gradients = functions_at(cell.element, cell.geometry, rule.points)
    F = np.einsum("ai,qaj->qij", cell.positions[:, :d], gradients)
    E = 0.5 * (np.einsum("qki,qkj->qij", F, F) - np.eye(d))
    S = lame * np.trace(E, axis1=1, axis2=2)[:, None, None] * np.eye(d) + 2 * mu * E
    weights = rule.weights * cell.geometry.determinant[0]
    force = np.einsum("q,qij,qjk,qak->ai", weights, F, S, gradients)
    energy = 0.5 * np.einsum("q,qij,qij->", weights, S, E)
    # FᵀF - I of a small strain cancels: what is left is rounding of the positions times the stiffness.
    rounding = 1e-14 * abs(cell.tangent(cell.positions)).max()
    np.testing.assert_allclose(cell.force(cell.positions)[:, :d], force, rtol=0, atol=rounding)
    assert abs(cell.force(cell.positions)[:, d:]).max(initial=0) == 0
    assert cell.energy(cell.positions) == pytest.approx(energy, rel=1e-11)


def test_thickness_and_plane_stress():
    """Uniaxial stress of a square: with the condensed first Lame parameter the force is E t strain."""
    square = np.array(ELEMENTS["2412"].cell.corners, dtype=float)
    points = np.column_stack([square, np.zeros(4)])
    tables = make_tables(ELEMENTS["2412"], np.arange(4)[None], points[None], thickness=0.1)
    parameters = plane_stress(LAWS["svk"].parameters(1.0, 0.3))
    strain, force = 1e-6, np.zeros((4, 3))
    point_solid.make_kernels(LAWS["svk"]).internal_force(
        (points * [1 + strain, 1 - 0.3 * strain, 1],), tables, parameters, ONE, force
    )
    expected = 0.1 * strain / 2 * np.sign(points) * [1, 0, 0]
    # Green and Lagrange's strain differs from the linear one by its square.
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-5 * abs(expected).max())


def test_inverted_points_are_seen():
    """det F is negative at a point once a corner is pushed through; neo-Hooke has no energy there."""
    cell = OneCell("3843", LAWS["neo_hooke"], "right-corner", amplitude=0.0)
    cell.positions[0] += 2.0
    force = np.zeros_like(cell.positions)
    assert cell.kernels.internal_force((cell.positions,), cell.tables, cell.parameters, ONE, force) < 0
    assert np.isinf(cell.energy(cell.positions))
