"""Discrete gradients of the laws: Gonzalez, CMAME 190 (2000) 1763."""

from __future__ import annotations

import numpy as np
import pytest

from ancf_petsc.material import LAWS

each_law = pytest.mark.parametrize("law", LAWS.values(), ids=list(LAWS))


def states(size: float, seed: int = 1):
    rng = np.random.default_rng(seed)
    F0 = np.eye(3) + 0.2 * rng.uniform(-1, 1, (3, 3))
    return F0, F0 + size * rng.uniform(-1, 1, (3, 3))


def flat(F):
    return tuple(F.ravel())


@each_law
@pytest.mark.parametrize("size", [0.3, 1e-2, 1e-4, 1e-6, 1e-8, 0.0])
def test_work_between_two_states_is_the_growth_of_the_energy(law, size):
    """P : (F1 - F0) = psi1 - psi0 to rounding, however near the states are; F^-1 P is symmetric."""
    p = law.parameters(2.0, 0.3)
    F0, F1 = states(size)
    P = np.reshape(law.mean_stress(flat(F0), flat(F1), p), (3, 3))
    growth = law.energy(flat(F1), p) - law.energy(flat(F0), p)
    assert np.vdot(P, F1 - F0) == pytest.approx(growth, abs=1e-15)
    S = np.linalg.solve((F0 + F1) / 2, P)
    np.testing.assert_allclose(S, S.T, atol=1e-14)


@each_law
def test_one_state_alone_gives_its_stress(law):
    p, (F, _) = law.parameters(2.0, 0.3), states(0.0)
    np.testing.assert_allclose(law.mean_stress(flat(F), flat(F), p), law.stress(flat(F), p), atol=1e-15)


@each_law
@pytest.mark.parametrize("size", [0.3, 1e-2, 0.0])
def test_mean_tangent_is_the_derivative_of_the_mean_stress(law, size):
    """By central differences of step 1e-5, error about 1e-9 (and 1e-5 where the states coincide: N : N is
    the step's).
    """
    p, h = law.parameters(2.0, 0.3), 1e-5
    F0, F1 = states(size)
    u, v = (0.3, -1.0, 0.5), (1.0, 0.2, -0.7)
    K = np.reshape(law.mean_tangent(flat(F0), flat(F1), u, v, p), (3, 3))
    expected = np.empty((3, 3))
    for k in range(3):
        change = np.zeros((3, 3))
        change[k] = h * np.array(v)
        ends = [np.reshape(law.mean_stress(flat(F0), flat(F1 + s * change), p), (3, 3)) @ u for s in (1, -1)]
        expected[:, k] = (ends[0] - ends[1]) / (2 * h)
    np.testing.assert_allclose(K, expected, atol=(1e-8 if size else 1e-4) * np.abs(K).max())
