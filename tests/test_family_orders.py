"""Every element in whole bodies: the patch test, and the order of convergence to a manufactured solution."""

import numpy as np
import pytest
from family import held_all_around, unit_cube

from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.kernel.tables import make_tables
from ancf_petsc.material import LAWS
from ancf_petsc.model.load import Load
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.solve.newton import Newton

F = np.array([[1.1, 0.2, 0.0], [-0.1, 0.9, 0.1], [0.05, 0.0, 1.2]])
PLANE = np.array([[1.1, 0.2, 0.0], [-0.1, 0.9, 0.0], [0.0, 0.0, 1.0]])
# Divisions of two meshes of the unit cube, and twice the degree of the polynomials that are complete.
LADDERS = {
    "3413": (4, 8, 2),
    "3813": (3, 6, 2),
    "2412": (8, 16, 2),
    "2312": (8, 16, 2),
    "2-6-1-2": (4, 8, 4),
    "3-10-1-3": (2, 4, 4),
    "3443": (2, 4, 4),
    "3443+4": (2, 3, 6),
    "3843": (2, 3, 6),
    "2432": (4, 8, 6),
}


@pytest.mark.parametrize("code", LADDERS)
@pytest.mark.parametrize("rule", ["default", "reduced"])
def test_patch_of_odd_cells_under_affine_boundary_values_is_in_constant_stress(code, rule, tmp_path):
    """The affine state is the equilibrium, whatever the cells, and Newton finds it from a state nearby."""
    if rule not in ELEMENTS[code].points:
        rule = "exact"
    body = held_all_around(code, unit_cube(code, 3, tmp_path, odd=True), tmp_path, rule=rule)
    gradient = PLANE if ELEMENTS[code].components == 2 else F
    affine = body.model.reference @ gradient.T
    free = body.model.drive < 0
    x = body.reference_vector()
    disturbed = affine + 0.01 * free * np.random.default_rng(1).uniform(-1, 1, affine.shape)
    x.array[:] = disturbed.ravel()
    assert free.any()
    outcome = Newton(body, 1e-13).solve(0.0, x)
    assert outcome.converged
    # Rounding of forces over the smallest stiffness of a small mesh.
    np.testing.assert_allclose(x.array_r.reshape(-1, 3), affine, atol=1e-11)
    _, cauchy, det = body.fields(x)
    np.testing.assert_allclose(cauchy, np.broadcast_to(cauchy[0], cauchy.shape), atol=1e-11)
    np.testing.assert_allclose(det, np.linalg.det(gradient), rtol=1e-11)


def exact(points, plane):
    """Positions (..., 3) and gradients (..., 3, 3) of the manufactured motion, displacements up to 0.1."""
    x, y, z = np.moveaxis(points, -1, 0)
    z = 0 * z if plane else z
    a, b = np.sin(2 * x + y + 0.5 * z), np.cos(x - 1.5 * y + z)
    r = points + 0.05 * np.stack((a, b, 0 * a if plane else a * b), axis=-1)
    da = np.cos(2 * x + y + 0.5 * z)[..., None] * np.array([2.0, 1.0, 0.0 if plane else 0.5])
    db = -np.sin(x - 1.5 * y + z)[..., None] * np.array([1.0, -1.5, 0.0 if plane else 1.0])
    dc = np.zeros_like(da) if plane else a[..., None] * db + b[..., None] * da
    return r, np.eye(3) + 0.05 * np.stack((da, db, dc), axis=-2)


class Manufactured:
    """A body held around at the exact values, loaded so that the exact motion is in equilibrium."""

    def __init__(self, code, n, folder):
        row, self.plane = ELEMENTS[code], ELEMENTS[code].components == 2
        self.body = held_all_around(code, unit_cube(code, n, folder), folder, "neo_hooke")
        model = self.body.model
        corners = model.reference[model.position_cells()[:, : len(row.cell.corners)]]
        slopes = model.reference[model.cells[:, row.slot > 0]].reshape(
            len(corners), -1, row.cell.dimension, 3
        )
        tables = make_tables(row, model.cells, corners, directions=slopes, quadrature="exact")
        self.cells, self.volumes = tables, tables.volumes
        self.weights, self.row, self.model = tables.fractions, row, model
        self.shape = np.stack([self._turn(g) for g in np.moveaxis(tables.gradients, 2, 0)], axis=-1)
        xi = row.rule("exact").points
        linear = ELEMENTS[
            {"tetra": "3413", "hexahedron": "3813", "quad": "2412", "triangle": "2312"}[row.cell_name]
        ].values(xi)
        self.places = np.einsum("qc,eci->eqi", linear, corners)

    def _turn(self, values):
        return np.stack([self.model.mapped(v) for v in values], axis=1)

    def integral(self, density):
        """Of values (e, q) over the body."""
        return np.einsum("e,q,eq->", self.volumes, self.weights, density)

    def gradients(self):
        return np.einsum("eqak,ekj->eqaj", self.shape, self.cells.inverses)

    def error(self):
        """Twice the energy of the error, by the identity as stiffness."""
        p = LAWS["neo_hooke"].parameters(1.0, 0.3)
        _, wanted = exact(self.places, self.plane)
        stress = self._stress(wanted, p)
        force = np.zeros_like(self.model.reference)
        G = self.gradients()
        parts = np.einsum("e,q,eqij,eqaj->eai", self.volumes, self.weights, stress, G)
        np.add.at(force, self.model.cells, parts)
        self.model.loads[:] = [Load(force, Ramp("constant"))]
        x = self.body.reference_vector()
        x.array[:] = self.interpolant().ravel()
        outcome = Newton(self.body, 1e-12).solve(1.0, x)
        assert outcome.converged
        r = x.array_r.reshape(-1, 3)
        found = np.einsum("eai,eqaj->eqij", r[self.model.cells], G)
        if self.plane:
            found[..., 2, 2] = 1.0
        return self.integral(((found - wanted) ** 2).sum(axis=(2, 3)))

    def _stress(self, gradient, p):
        J = np.linalg.det(gradient)[..., None, None]
        inverse = np.swapaxes(np.linalg.inv(gradient), -1, -2)
        return p[1] * gradient + (p[0] * np.log(J) - p[1]) * inverse

    def interpolant(self):
        """Nodal vectors of the exact motion."""
        model = self.model
        at = np.flatnonzero(model.slots == 0)[np.cumsum(model.slots == 0) - 1]
        r, gradient = exact(model.reference[at], self.plane)
        along = np.einsum("vij,vj->vi", gradient, model.reference)
        return np.where(model.slots[:, None] == 0, r, along)


@pytest.mark.parametrize("code", LADDERS)
def test_energy_of_the_error_falls_with_the_order_of_the_element(code, tmp_path):
    coarse, fine, order = LADDERS[code]
    errors = [Manufactured(code, n, tmp_path).error() for n in (coarse, fine)]
    measured = np.log(errors[0] / errors[1]) / np.log(fine / coarse)
    # Coarse meshes are not yet in the limit: half an order either way.
    assert measured == pytest.approx(order, abs=0.5)
