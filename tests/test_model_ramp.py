"""Ramps: values, their derivatives by differences, corners, and when a factor is first reached."""

from __future__ import annotations

import numpy as np
import pytest

from ancf_petsc.model.ramp import Ramp

TABLE = Ramp("table", ((0.1, 0.0), (0.3, 2.0), (0.6, 1.0)))
RAMPS = {"linear": Ramp("linear"), "cosine": Ramp("cosine"), "constant": Ramp("constant"), "table": TABLE}


def test_values():
    half = (1.0 - np.cos(0.3 * np.pi)) / 2
    values = [RAMPS[kind].value(0.3) for kind in ("linear", "cosine", "constant")]
    assert values == pytest.approx([0.3, half, 1.0], rel=1e-15)
    assert [ramp.value(1.0) for ramp in list(RAMPS.values())[:3]] == pytest.approx([1.0] * 3, rel=1e-15)
    places = (0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.9, 1.0)
    assert [TABLE.value(s) for s in places] == pytest.approx(
        [0.0, 0.0, 1.0, 2.0, 1.5, 1.0, 1.0, 1.0], abs=1e-15
    )


@pytest.mark.parametrize("kind", RAMPS)
@pytest.mark.parametrize("s", [0.05, 0.2, 0.45, 0.8])
def test_rates_and_curvatures_are_differences(kind, s):
    ramp, h = RAMPS[kind], 1e-4
    before, here, after = (ramp.value(s + step) for step in (-h, 0.0, h))
    assert ramp.rate(s) == pytest.approx((after - before) / (2 * h), abs=1e-6)
    assert ramp.curvature(s) == pytest.approx((after - 2 * here + before) / h**2, abs=1e-5)


def test_corners_are_where_rates_jump():
    assert TABLE.corners() == (0.1, 0.3, 0.6)
    assert Ramp("table", ((0.0, 0.0), (0.5, 1.0), (1.0, 0.0))).corners() == (0.5,)
    assert Ramp("cosine").corners() == ()


@pytest.mark.parametrize("kind", ["linear", "cosine", "table"])
@pytest.mark.parametrize("factor", [0.2, 0.5, 0.9])
def test_the_first_time_of_a_factor(kind, factor):
    ramp = RAMPS[kind]
    s = ramp.first_time(factor)
    assert ramp.value(s) == pytest.approx(factor, rel=1e-12)
    assert all(ramp.value(earlier) < factor for earlier in np.linspace(0.0, s, 50)[:-1])
    assert ramp.first_time(2.5) is None
