"""Forces and tangents of whole bodies."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import assembly_of, free_body, odd_mesh, random_state

from ancf_petsc.material import LAWS

each_law = pytest.mark.parametrize("law", LAWS)


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    return odd_mesh(tmp_path_factory.mktemp("mesh") / "cube.msh")


@pytest.fixture
def free(mesh, law, tmp_path):
    return assembly_of(free_body(mesh, law), tmp_path)


@each_law
def test_forces_are_the_derivative_of_the_energy(free):
    x, h = random_state(free), 1e-4
    force = free.internal_force(x)[0].ravel().copy()
    direction = np.random.default_rng(2).normal(size=len(force))
    energies = []
    for step in (-2 * h, -h, h, 2 * h):
        moved = x.copy()
        moved.array[:] += step * direction
        energies.append(free.strain_energy(moved))
    slope = (energies[0] - 8 * energies[1] + 8 * energies[2] - energies[3]) / (12 * h)
    # Fourth order: truncation about h^4 / cell^4 = 1e-14, rounding eps U / h = 1e-12.
    assert slope == pytest.approx(force @ direction, rel=1e-9)


@each_law
def test_tangent_is_the_difference_quotient_of_the_residual(free):
    """Matrix and directional derivative, to 1e-7 of the product."""
    x, h = random_state(free), 1e-5
    direction = free.vector()
    direction.array[:] = np.random.default_rng(3).normal(size=len(direction.array_r))
    forces = []
    for step in (-h, h):
        moved = x.copy()
        moved.axpy(step, direction)
        forces.append(free.internal_force(moved)[0].ravel().copy())
    quotient = (forces[1] - forces[0]) / (2 * h)
    matrix, product = free.create_matrix(), free.vector()
    free.tangent(x, matrix)
    matrix.mat.mult(direction, product)
    scale = np.abs(quotient).max()
    np.testing.assert_allclose(product.array_r, quotient, atol=1e-7 * scale)
    np.testing.assert_allclose(free.tangent_product(x, direction).ravel(), quotient, atol=1e-7 * scale)
    assert matrix.mat.isSymmetric(1e-14 * scale)


@each_law
def test_rotation_makes_no_force(free):
    turn, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    x = free.reference_vector()
    x.array[:] = (x.array_r.reshape(-1, 3) @ turn.T + [3.0, -2.0, 5.0]).ravel()
    force, smallest = free.internal_force(x)
    # Stresses are rounded at eps E, forces at eps E h.
    assert np.abs(force).max() < 1e-14 * 2.0
    assert smallest == pytest.approx(1.0, abs=1e-13)
    assert free.strain_energy(x) < 1e-28


@each_law
def test_patch_of_odd_cells_under_affine_boundary_values_is_in_constant_stress(mesh, law, tmp_path):
    """The patch test: the affine state is the equilibrium, whatever the cells; here Newton finds it."""
    from ancf_petsc.solve.newton import Newton

    everywhere = {"plane": "z", "at": "min"}
    data = free_body(mesh, law) | {"groups": {"low": everywhere}}
    free = assembly_of(data, tmp_path)
    boundary = _outer_nodes(free)
    free.model.drive[boundary] = 0
    free = type(free)(free.model)
    F = np.array([[1.1, 0.2, 0.0], [-0.1, 0.9, 0.1], [0.05, 0.0, 1.2]])
    affine = free.model.reference @ F.T
    x = free.reference_vector()
    values = x.array_r.reshape(-1, 3).copy()
    values[boundary] = affine[boundary]
    inner = np.setdiff1d(np.arange(len(values)), boundary)
    values[inner] = affine[inner] + 0.01
    x.array[:] = values.ravel()
    newton = Newton(free, 1e-13)
    outcome = newton.solve(0.0, x)
    assert outcome.converged
    np.testing.assert_allclose(x.array_r.reshape(-1, 3), affine, atol=1e-13)
    _, cauchy, det = free.fields(x)
    np.testing.assert_allclose(cauchy, np.broadcast_to(cauchy[0], cauchy.shape), atol=1e-13)
    np.testing.assert_allclose(det, np.linalg.det(F), rtol=1e-13)


def _outer_nodes(assembly) -> np.ndarray:
    """Nodes of faces that belong to one cell."""
    from ancf_petsc.mesh.parts import outer_sides

    return np.unique(
        outer_sides("tetra", assembly.model.cells.astype(np.int64), len(assembly.model.reference))
    )
