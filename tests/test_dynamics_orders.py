"""Orders of the integrators, measured.

Implicit ones on the pendulum with gravity raised by a cosine over 0.5 s: gravity at once would excite modes
that no such step resolves. Explicit ones resolve every mode: gravity at once, and steps inside the limit of
stability, omega h = 0.9 to 0.3.
"""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import GRAVITY, Followed, pendulum, slope

SLOW = (50, 100, 200, 400, 800)
FAST = (250, 350, 500, 700)


def raised(**dynamics) -> np.ndarray:
    gravity = {**GRAVITY, "ramp": "cosine"}
    return Followed(pendulum({"duration": 0.5, "outputs": 1, **dynamics}, load=[gravity])).positions


def sudden(**dynamics) -> np.ndarray:
    return Followed(pendulum({"duration": 0.1, "outputs": 1, **dynamics})).positions


@pytest.fixture(scope="module")
def raised_answer() -> np.ndarray:
    return raised(integrator="runge_kutta_4", step=0.5 / 2000)


@pytest.fixture(scope="module")
def sudden_answer() -> np.ndarray:
    return sudden(integrator="runge_kutta_5dp", step=0.1 / 4000)


SECOND_ORDER = {
    "generalised alpha 0.8": {"integrator": "generalized_alpha"},
    "generalised alpha 0.5": {"integrator": "generalized_alpha", "spectral_radius": 0.5},
    "energy-momentum": {"integrator": "energy_momentum"},
    "trapezoidal": {"integrator": "theta"},
    "bdf": {"integrator": "bdf"},
}


@pytest.mark.parametrize("how", SECOND_ORDER.values(), ids=list(SECOND_ORDER))
def test_second_order(how, raised_answer):
    """Slope 2 within 0.1; the answer beside it is good to 1e-10 m, the errors are above 4e-7."""
    errors = [np.abs(raised(step=0.5 / n, **how) - raised_answer).max() for n in SLOW]
    assert -slope(SLOW, errors) == pytest.approx(2.0, abs=0.1)


def test_backward_euler_is_of_first_order(raised_answer):
    errors = [
        np.abs(raised(step=0.5 / n, integrator="theta", theta=1.0) - raised_answer).max() for n in SLOW[2:]
    ]
    assert -slope(SLOW[2:], errors) == pytest.approx(1.0, abs=0.15)


def test_rosenbrock_is_of_third_order_at_least(raised_answer):
    """Also with loads that change in time, whose derivative the method leaves out."""
    errors = [np.abs(raised(step=0.5 / n, integrator="rosenbrock") - raised_answer).max() for n in SLOW[:4]]
    assert -slope(SLOW[:4], errors) > 2.9


@pytest.mark.parametrize(("name", "order"), [("runge_kutta_5dp", 5), ("runge_kutta_4", 4)])
def test_explicit_orders(name, order, sudden_answer):
    errors = [np.abs(sudden(step=0.1 / n, integrator=name) - sudden_answer).max() for n in FAST]
    assert -slope(FAST, errors) == pytest.approx(order, abs=0.15)


@pytest.mark.parametrize("name", ["runge_kutta_5dp", "rosenbrock", "bdf"])
def test_a_smaller_tolerance_brings_a_smaller_error(name, raised_answer):
    """Error control: from 1e-4 to 1e-6 the error falls to less than a fifth."""
    errors = [
        np.abs(raised(integrator=name, tolerance=tolerance) - raised_answer).max()
        for tolerance in (1e-4, 1e-6)
    ]
    assert errors[1] < errors[0] / 5 or errors[0] < 1e-6
    assert errors[1] < 1e-3
