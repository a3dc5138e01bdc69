"""Every law of the registry: stress and tangent are derivatives of the energy, and the energy objective."""

from __future__ import annotations

import numpy as np
import pytest

from ancf_petsc.material import LAWS
from ancf_petsc.material.tensor import determinant, dot, gram, inverse_transpose, outer, transpose

UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=list(LAWS))


def deformation(seed: int) -> np.ndarray:
    """A random F with a positive determinant, far from the identity."""
    F = np.eye(3) + 0.3 * np.random.default_rng(seed).uniform(-1, 1, (3, 3))
    assert np.linalg.det(F) > 0.1
    return F


def difference(function, F: np.ndarray) -> np.ndarray:
    """dfunction/dF (..., i, j) by differences of fourth order, error about 1e-10 of the function's scale."""
    h, slots = 1e-3, []
    for k in range(9):
        values = [np.asarray(function(F.ravel() + step * np.eye(9)[k] * h)) for step in (-2, -1, 1, 2)]
        slots.append((values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h))
    return np.stack(slots, axis=-1)


@each_law
@pytest.mark.parametrize("seed", range(5))
def test_stress_is_the_derivative_of_the_energy(law, seed):
    F, p = deformation(seed), law.parameters(2.0, 0.3)
    stress = np.array(law.stress(tuple(F.ravel()), p))
    expected = difference(lambda f: law.energy(tuple(f), p), F)
    np.testing.assert_allclose(stress, expected, atol=1e-9 * np.abs(stress).max())


@each_law
@pytest.mark.parametrize("seed", range(5))
def test_tangent_is_the_derivative_of_the_stress(law, seed):
    F, p = deformation(seed), law.parameters(2.0, 0.3)
    A = np.empty((3, 3, 3, 3))
    for J in range(3):
        for L in range(3):
            A[:, J, :, L] = np.reshape(law.tangent(tuple(F.ravel()), UNIT[J], UNIT[L], p), (3, 3))
    expected = difference(lambda f: law.stress(tuple(f), p), F).reshape(3, 3, 3, 3)
    np.testing.assert_allclose(A, expected, atol=1e-8 * np.abs(A).max())
    np.testing.assert_allclose(A, A.transpose(2, 3, 0, 1), atol=1e-14 * np.abs(A).max())


@each_law
def test_energy_does_not_feel_rotations(law):
    F, p = deformation(1), law.parameters(2.0, 0.3)
    turn, _ = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    turned = turn @ F
    assert law.energy(tuple(turned.ravel()), p) == pytest.approx(law.energy(tuple(F.ravel()), p), rel=1e-13)
    stress = np.reshape(law.stress(tuple(F.ravel()), p), (3, 3))
    np.testing.assert_allclose(
        np.reshape(law.stress(tuple(turned.ravel()), p), (3, 3)), turn @ stress, atol=1e-13
    )


@each_law
def test_small_strains_give_hookes_law(law):
    """sigma = lambda tr(e) I + 2 mu e to first order: the error is of the size of the strain."""
    p = law.parameters(2.0, 0.3)
    small = 1e-6 * np.array([[1.0, 2.0, 0.5], [2.0, -1.0, 0.3], [0.5, 0.3, 0.7]])
    expected = p[0] * np.trace(small) * np.eye(3) + 2 * p[1] * small
    stress = np.reshape(law.stress(tuple((np.eye(3) + small).ravel()), p), (3, 3))
    np.testing.assert_allclose(stress, expected, atol=1e-5 * np.abs(expected).max())


def test_svk_bar_has_its_known_force():
    """Uniaxial stress: P = E/2 (l^3 - l), largest in compression at l = 1/sqrt(3)."""
    law, poisson = LAWS["svk"], 0.35
    for stretch in (0.577, 0.8, 1.3):
        across = np.sqrt(1 - poisson * (stretch**2 - 1))
        F = (across, 0.0, 0.0, 0.0, across, 0.0, 0.0, 0.0, stretch)
        stress = law.stress(F, law.parameters(3.0, poisson))
        assert stress[8] == pytest.approx(1.5 * (stretch**3 - stretch), rel=1e-13)
        assert abs(stress[0]) < 1e-15 * 3.0 / (1 - 2 * poisson)  # rounding of the moduli


def test_inside_out_cells_have_no_finite_neo_hooke_energy():
    law = LAWS["neo_hooke"]
    F, p = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -0.1), law.parameters(1.0, 0.3)
    assert law.energy(F, p) == np.inf
    assert np.isnan(law.stress(F, p)).any()


def test_tensor_functions_equal_numpy():
    rng = np.random.default_rng(3)
    a, b, u, v = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), rng.normal(size=3), rng.normal(size=3)
    ta, tb = tuple(a.ravel()), tuple(b.ravel())
    det = determinant(ta)
    assert det == pytest.approx(np.linalg.det(a), rel=1e-13)
    for found, expected in (
        (dot(ta, tb), a @ b),
        (gram(ta), a.T @ a),
        (transpose(ta), a.T),
        (outer(tuple(u), tuple(v)), np.outer(u, v)),
        (inverse_transpose(ta, det), np.linalg.inv(a).T),
    ):
        np.testing.assert_allclose(np.reshape(found, (3, 3)), expected, rtol=1e-12, atol=1e-13)
