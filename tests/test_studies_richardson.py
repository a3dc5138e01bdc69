"""Orders, limits and their uncertainties: on made ladders with known answers, and on measured ones."""

from __future__ import annotations

import numpy as np
import pytest

from ancf_petsc.studies.richardson import ASYMPTOTIC, NOT_ASYMPTOTIC, TOO_FEW, Ladder, extrapolate


@pytest.mark.parametrize("order", [0.5, 1.0, 1.46, 2.0, 4.0])
@pytest.mark.parametrize("ratios", [(2, 2), (1.5, 2.5), (1.2, 1.3), (2, 2, 2), (1.3, 1.9, 1.4)])
def test_the_exact_power_is_found_for_any_ratios(order, ratios):
    h = 1.0 / np.cumprod([1.0, *ratios])
    found = extrapolate(Ladder(h, 3.0 - 0.2 * h**order))
    assert found.verdict == ASYMPTOTIC
    assert found.order == pytest.approx(
        order, rel=0.01
    )  # of four levels the order is searched on a grid of 0.35 %
    assert found.limit == pytest.approx(3.0, abs=1e-3)
    assert found.uncertainty >= 0.24 * 0.2 * h[-1] ** order


def test_levels_may_come_in_any_order_and_twice():
    h = np.array([0.25, 1.0, 0.5, 0.25])
    found = extrapolate(Ladder(h, 1.0 + h**2))
    assert found.order == pytest.approx(2.0)
    assert found.limit == pytest.approx(1.0)


def test_four_levels_that_agree_are_trusted_more_than_three():
    h = 0.5 ** np.arange(4)
    three, four = extrapolate(Ladder(h[1:], 1 + h[1:] ** 2)), extrapolate(Ladder(h, 1 + h**2))
    assert three.uncertainty == pytest.approx(three.gap)  # Fs = 2
    assert four.uncertainty == pytest.approx(0.25 * four.gap, rel=0.02)  # Fs = 1.25


@pytest.mark.parametrize("values", [(1.0, 1.2, 1.1), (1.0, 1.1, 1.1), (1.0, 1.1, 1.3), (1.0, 1.1, 1.2)])
def test_what_does_not_converge_has_no_limit(values):
    found = extrapolate(Ladder((1.0, 0.5, 0.25), values))
    assert found.verdict == NOT_ASYMPTOTIC
    assert found.limit is found.order is found.uncertainty is None
    assert found.words


def test_orders_out_of_range():
    h = np.array([1.0, 0.5, 0.25])
    assert "outside 0.3 to 7" in extrapolate(Ladder(h, h**0.2)).words
    assert "do not shrink" in extrapolate(Ladder(h, -(np.log(h) ** 2))).words
    assert "outside 0.3 to 7" in extrapolate(Ladder(h, 1 + h**7.5)).words


def test_too_few_levels():
    assert extrapolate(Ladder((1.0, 0.5), (1.0, 1.1))).verdict == TOO_FEW
    assert extrapolate(Ladder((1.0, 0.5, 0.5), (1.0, 1.1, 1.1))).verdict == TOO_FEW
    assert extrapolate(Ladder((), ())).verdict == TOO_FEW


def test_equal_levels_are_the_limit():
    found = extrapolate(Ladder((1.0, 0.5, 0.25), (-3.0, -3.0 - 1e-11, -3.0)))
    assert (found.verdict, found.limit) == (ASYMPTOTIC, -3.0)
    assert found.uncertainty < 1e-10


def test_an_order_that_drifts_is_no_order():
    h = 0.5 ** np.arange(4)
    found = extrapolate(Ladder(h, 1.0 + h**0.4 + 8.0 * h**4))
    assert found.verdict == NOT_ASYMPTOTIC


CANTILEVER = {
    # meshes of cubes: divisions across, displacement of the tip (docs/accuracy.md); the limit is -0.35020 m
    "3-10-1-3": (2, (1, 2, 4), (-0.3447538, -0.3488355, -0.3497769)),
    "3443": (2, (1, 2, 4), (-0.3449803, -0.348819, -0.3497567)),
    "3413": (1, (1, 2, 4, 8), (-0.0871627, -0.1944684, -0.2898559, -0.3323478)),
    "3813": (1, (1, 2, 4, 8), (-0.2434799, -0.3147601, -0.34019, -0.3474655)),
}


@pytest.mark.parametrize("code", CANTILEVER)
def test_measured_errors_of_the_cantilever_within_a_factor_of_two(code):
    degree, cells, tips = CANTILEVER[code]
    found = extrapolate(Ladder([1 / n for n in cells], tips, 2.0 * degree))
    if code == "3413":
        assert found.verdict == NOT_ASYMPTOTIC
        return
    assert 0.5 < found.gap / abs(tips[-1] + 0.35020) < 2.0
    assert abs(found.limit + 0.35020) < found.uncertainty


def test_falling_stretches_of_a_fold_forbid_a_limit():
    h, q = np.array([1.0, 0.5, 0.25]), np.array([1.0, 1.5, 1.75])
    calm = Ladder(h, q, 2.0, (0.80, 0.79, 0.788))
    fold = Ladder(h, q, 2.0, (0.80, 0.72, 0.60))
    assert extrapolate(calm).verdict == ASYMPTOTIC
    assert extrapolate(fold).verdict == NOT_ASYMPTOTIC
    assert "fold" in extrapolate(fold).words


def test_growing_strains_make_the_limit_uncertain_or_forbid_it():
    """Strains that grow like h**-1/2 let energies converge with order 1, whatever three levels show."""
    h = np.array([1.0, 0.5, 0.25])
    stretches = np.exp(-0.02 * h**-0.5)
    low, high = Ladder(h, 1 - h**1.5, 4.0, stretches), Ladder(h, 1 - h**3.3, 4.0, stretches)
    found = extrapolate(low)
    assert found.verdict == ASYMPTOTIC
    assert "should fall to 1" in found.words
    assert found.uncertainty > extrapolate(Ladder(h, 1 - h**1.5, 4.0)).uncertainty
    assert extrapolate(high).verdict == NOT_ASYMPTOTIC


def test_an_order_above_the_elements_is_an_accident():
    h = np.array([1.0, 0.5, 0.25])
    assert "accident" in extrapolate(Ladder(h, 1 + h**4, 2.0)).words


def test_an_integrator_shows_its_own_order():
    """Steps too long for the method's order: bdf of order 2 on the pendulum, steps of 10, 5 and 2.5 ms, shows 2.43."""
    sizes, values = [0.01, 0.005, 0.0025], [-0.23533397, -0.23434537, -0.23416196]
    assert extrapolate(Ladder(sizes, values)).verdict == ASYMPTOTIC
    found = extrapolate(Ladder(sizes, values, exact=2))
    assert found.verdict == NOT_ASYMPTOTIC
    assert "2.4 is not the integrator's, 2" in found.words
    steps, path = (
        [0.002, 0.001, 0.0005, 0.00025],
        [3.917e-4, 1.322e-4, 5.23e-5, 1.55e-5],
    )  # finest three 1.76, all 1.5
    assert extrapolate(Ladder(steps, [1.0 + e for e in path], exact=2)).verdict == NOT_ASYMPTOTIC
    exact = [1.0 + h**2 for h in sizes]
    assert extrapolate(Ladder(sizes, exact, exact=2)).limit == pytest.approx(1.0, rel=1e-9)


def test_a_limit_of_zero_is_zero_not_what_rounding_leaves():
    """Errors are relative to a limit, and to zero they are absolute."""
    sizes = [1.0, 0.5, 0.25, 0.125]
    found = extrapolate(Ladder(sizes, [0.4 * h**2 for h in sizes]))
    assert found.verdict == ASYMPTOTIC
    assert found.limit == 0.0
    assert found.gap == pytest.approx(0.4 / 64, rel=1e-9)
