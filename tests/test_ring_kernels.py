"""Kernels of bodies of revolution on one cell: derivatives of one energy, sums by hand, what has no energy, what keeps it."""

import numpy as np
import pytest
from test_kernel_generic import assembled

from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.kernel.choice import kernel_set
from ancf_petsc.kernel.interface import Means, Span
from ancf_petsc.kernel.revolution import Revolution, quadrature_of
from ancf_petsc.material import LAWS

CODES = tuple(code for code, row in ELEMENTS.items() if row.is_plane)
TURNS = {"x-z": (0, 2), "z-x": (2, 0), "x-y": (0, 1), "z-y": (2, 1)}
"""Radial direction and axis."""
ONE = Span(0, 1)
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=list(LAWS))
each_element = pytest.mark.parametrize("code", CODES)


class OneRing:
    """One deformed cell of odd shape of a body of revolution; u, v are its coordinates along the plane's axes."""

    def __init__(self, code, law, turn="x-z", *, quadrature="default", angle=1.3, radius=2.0):
        self.element, self.law = ELEMENTS[code], law
        radial, axis = TURNS[turn]
        self.revolution = Revolution(radial, axis, angle)
        n = self.revolution.normal
        self.axes = np.eye(3)[:, [(n + 1) % 3, (n + 2) % 3]]
        chosen, row = kernel_set(self.element, axisymmetric=True), self.element
        self.edges = np.array([[1.0, 0.3], [-0.2, 0.8]])  # columns along the plane's axes
        self.origin = radius * self.axes[radial] + 5.0 * self.axes[axis]
        flat = self.origin + row.node_coordinates @ self.edges.T
        # Off the plane through the origin.
        self.reference = 7.0 * np.eye(3)[n] + (flat @ self.axes.T)[row.node]
        for j in range(2):
            self.reference[row.slot == j + 1] = self.axes[:, j]
        self.cells = np.arange(row.functions, dtype=np.int32)[None]
        more = {"axes": self.axes, "quadrature": quadrature, "revolution": self.revolution}
        self.tables = chosen.cells(row, self.cells, self.reference, **more)
        self.kernels, self.p = chosen.kernels(law), law.parameters(1.0, 0.3)
        self.rest = (self.tables, self.p, ONE)
        self.generator = np.random.default_rng(5)
        self.positions = self.reference + 0.03 * self.random()

    def random(self):
        """Random nodal vectors in the plane."""
        return self.generator.normal(size=(len(self.reference), 2)) @ self.axes.T

    def energy(self, positions):
        return self.kernels.energy((positions,), *self.rest)

    def force(self, positions):
        force = np.zeros_like(positions)
        self.kernels.internal_force((positions,), *self.rest, force)
        return force

    def gradients(self, positions):
        """F (q, 3, 3) and volumes (q,) by the definition, from the shape functions alone."""
        row, name = self.element, quadrature_of(self.element, "default")
        rule, revolution = row.rule(name), self.revolution
        values, gradients = row.values(rule.points), row.gradients(rule.points)
        for table in (values, *np.moveaxis(gradients, 2, 0)):
            mapped = table.copy()
            for node in range(len(row.nodes)):
                at = np.flatnonzero((row.node == node) & (row.slot > 0))
                if len(at):
                    mapped[:, at] = table[:, at] @ self.edges.T
            table[:] = mapped
        inverse = np.linalg.inv(self.edges)
        F = np.einsum("ai,qak,kj,Jj->qiJ", positions, gradients, inverse, self.axes)
        n = np.eye(3)[revolution.normal]
        radius = (self.origin + rule.points @ self.edges.T) @ self.axes[revolution.radial]
        hoop = values @ positions[:, revolution.radial] / radius
        F -= np.einsum("qij,j,k->qik", F, n, n)
        F += hoop[:, None, None] * np.outer(n, n)
        area = np.linalg.det(self.edges)
        return F, revolution.angle * radius * rule.weights * area


@each_element
@each_law
@pytest.mark.parametrize("turn", TURNS)
def test_energy_is_that_of_the_definition_and_forces_its_gradient(code, law, turn):
    ring = OneRing(code, law, turn)
    F, volumes = ring.gradients(ring.positions)
    wanted = sum(w * law.energy(tuple(f.ravel()), ring.p) for f, w in zip(F, volumes, strict=True))
    assert ring.energy(ring.positions) == pytest.approx(wanted, rel=1e-11)
    force, h = ring.force(ring.positions), 1e-3
    # Nothing acts out of the plane.
    assert not force[:, ring.revolution.normal].any()
    for _ in range(3):
        v = ring.random()
        steps = [
            ring.energy(ring.positions + k * h * v) - ring.energy(ring.positions - k * h * v)
            for k in (1, 2, 3)
        ]
        slope = (45 * steps[0] - 9 * steps[1] + steps[2]) / (60 * h)
        # Rounding of the energy over the step and the neglected seventh derivative.
        assert np.vdot(force, v) == pytest.approx(slope, abs=1e-8 * np.linalg.norm(force) * np.linalg.norm(v))


@each_element
@each_law
@pytest.mark.parametrize("turn", TURNS)
def test_tangents_are_derivatives_of_the_forces(code, law, turn):
    """Of the force, also as a product with a direction, and of the force between two states."""
    ring = OneRing(code, law, turn)
    K = assembled(ring.kernels, ring.positions, ring.tables, ring.p)
    later = ring.positions + 0.02 * ring.random()
    between = assembled(ring.kernels, ring.positions, ring.tables, ring.p, later=later)
    inside = np.tile(np.arange(3) != ring.revolution.normal, len(K) // 3)
    np.testing.assert_allclose(
        K[inside][:, inside], K.T[inside][:, inside], rtol=0, atol=1e-14 * abs(K).max()
    )

    def mean(state):
        force = np.zeros_like(state)
        ring.kernels.mean_force((ring.positions, state), *ring.rest, force)
        return force

    def quotient(function, x, v, h):
        steps = [function(x + k * h * v) - function(x - k * h * v) for k in (1, 2, 3)]
        return (45 * steps[0] - 9 * steps[1] + steps[2]) / (60 * h)

    for _ in range(3):
        v, product = ring.random(), np.zeros_like(ring.positions)
        ring.kernels.tangent_product((ring.positions, v), *ring.rest, product)
        wanted = quotient(ring.force, ring.positions, v, 1e-3)
        for found in (product, (K @ v.ravel()).reshape(-1, 3)):
            found = found * (np.arange(3) != ring.revolution.normal)
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9 * abs(wanted).max())
        wanted = quotient(mean, later, v, 1e-4)  # short beside the distance of the two states
        found = (between @ v.ravel()).reshape(-1, 3) * (np.arange(3) != ring.revolution.normal)
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-7 * abs(wanted).max())


@each_element
@each_law
def test_work_between_two_states_is_the_growth_of_the_energy(code, law):
    ring, force = OneRing(code, law), np.zeros((ELEMENTS[code].functions, 3))
    later = ring.positions + 0.05 * ring.random()
    ring.kernels.mean_force((ring.positions, later), *ring.rest, force)
    work = np.vdot(force, later - ring.positions)
    assert work == pytest.approx(ring.energy(later) - ring.energy(ring.positions), rel=1e-11)


@pytest.mark.parametrize(
    ("code", "quadrature"), [(code, name) for code in CODES for name in ("default", "reduced", "exact")]
)
@pytest.mark.parametrize("radius", [0.5, 2.0, 300.0])
def test_only_the_motion_along_the_axis_is_free_of_energy(code, quadrature, radius):
    """Every rule, from a cell that touches the axis to one where the hoop hardly counts."""
    if quadrature not in ELEMENTS[code].points:
        quadrature = "default"
    ring = OneRing(code, LAWS["svk"], quadrature=quadrature, radius=radius)
    K = assembled(ring.kernels, ring.reference, ring.tables, ring.p)
    inside = np.tile(np.arange(3) != 1, len(K) // 3)
    values = np.linalg.eigvalsh(K[inside][:, inside])
    # Stiffness of the hoop falls with the square of the radius, 1e-5 at 300; rounding is 1e-15.
    assert (values > 1e-11 * values[-1]).sum() == len(values) - 1
    along = np.where(ELEMENTS[code].slot == 0, 1.0, 0.0)[:, None] * np.array([0.0, 0.0, 1.0])
    assert np.linalg.norm(K @ along.ravel()) < 1e-13 * values[-1]


@each_element
def test_fields_have_the_hoop_across_the_section(code):
    """A ring widened by a tenth and stretched by 0.05 along its axis: strains in their places, det F the product."""
    ring = OneRing(code, LAWS["svk"], "x-z")
    state = ring.reference * [1.1, 1.0, 1.05]
    means = Means(np.empty((1, 9)), np.empty((1, 9)), np.empty(1))
    ring.kernels.fields((state,), *ring.rest, means)
    strain = np.diag([0.5 * (1.1**2 - 1), 0.5 * (1.1**2 - 1), 0.5 * (1.05**2 - 1)])
    np.testing.assert_allclose(means.strain[0].reshape(3, 3), strain, rtol=0, atol=1e-13)
    assert means.det[0] == pytest.approx(1.1**2 * 1.05, rel=1e-13)
    smallest = ring.kernels.internal_force((state,), *ring.rest, np.zeros_like(state))
    assert smallest == pytest.approx(1.1**2 * 1.05, rel=1e-13)


@each_element
def test_volume_is_that_of_pappus(code):
    ring = OneRing(code, LAWS["svk"])
    cell = ELEMENTS[code].cell
    centre = ring.origin + ring.edges @ np.array(cell.centre(range(len(cell.corners))), float)
    radius = centre @ ring.axes[0]
    area = np.linalg.det(ring.edges) * float(cell.volume)
    assert ring.tables.volumes[0] == pytest.approx(1.3 * area * radius, rel=1e-14)
