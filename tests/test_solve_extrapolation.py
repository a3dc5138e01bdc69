"""Extrapolating a path: exact for polynomials, with and without the slope at its start."""

from __future__ import annotations

import numpy as np
import pytest
from petsc4py import PETSc

from ancf_petsc.solve.extrapolation import FEWEST, MOST, Extrapolation, weights_at
from ancf_petsc.solve.forcing import AIM, Forcing


@pytest.mark.parametrize("with_slope", [False, True])
@pytest.mark.parametrize("count", range(2, MOST))
def test_polynomials_go_on_exactly(count, with_slope):
    """A polynomial of as many coefficients as conditions, at times that are not equally far apart."""
    random = np.random.default_rng(count)
    times = [*np.sort(random.uniform(0.2, 0.8, count))]
    path = np.polynomial.Polynomial(random.normal(size=count + with_slope))
    weights, of_slope = weights_at(1.0, times, with_slope=with_slope)
    found = weights @ path(np.array(times)) + of_slope * path.deriv()(times[0])
    # Rounding times the weights.
    assert found == pytest.approx(path(1.0), abs=1e-11 * np.abs(weights).sum())
    assert weights.sum() == pytest.approx(1.0, abs=1e-9)


def vector(value):
    x = PETSc.Vec().createSeq(2)
    x.array[:] = value
    return x


def test_it_remembers_the_last_states_only():
    path = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0, -1.0, 0.7])
    past, times = Extrapolation(), np.linspace(0, 1, 9)
    assert past.at(0.5) is None
    for k, s in enumerate(times):
        past.add(s, vector([path(s), s]))
        if k == 0:
            assert past.wants_slope
            past.set_slope(vector([path.deriv()(s), 1.0]))
        known = min(k + 2 if k + 2 <= MOST else k + 1, MOST)
        found = past.at(1.2)
        assert (found is None) == (known < FEWEST)
        if known == MOST:
            np.testing.assert_allclose(found.array_r, [path(1.2), 1.2], rtol=1e-9)
    past.forget()
    assert past.at(1.2) is None
    assert not past.wants_slope


def test_forcing_terms_follow_what_is_left_to_gain():
    """Far from the solution as loose as the curvature allows, near it just to the tolerance."""
    forcing = Forcing(1e-8)
    forcing.start()
    assert forcing.term(1e-2) == pytest.approx(0.01)  # SHARE x curvature x residual
    forcing.learn(1e-4)
    assert forcing.term(1e-4) == pytest.approx(max(0.01 * 30 * 1e-4, AIM * 1e-4))
    forcing.learn(2e-9)
    forcing.start()
    forcing.learn(1.0)  # nothing was asked for: nothing to learn
    near = forcing.term(1e-6)
    assert near == pytest.approx(AIM * 1e-2)
