"""Numbers from curves whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest

from ancf_petsc.post.curves import (
    energy_absorbed,
    energy_loaded,
    force_at,
    initial_stiffness,
    is_compression,
    secant_stiffness,
    work_done,
)
from ancf_petsc.post.units import Units, read_units

STROKE = -np.linspace(0, 0.02, 11)
FORCE = 5e4 * STROKE - 3e6 * STROKE**2  # softens in tension, stiffens in compression


def test_a_spring_stores_half_force_times_stroke():
    assert energy_absorbed([0.0, 0.1, 0.3], [0.0, 2.0, 6.0]) == pytest.approx(0.9, rel=1e-15)
    assert work_done([0.0, 0.1, 0.3], [0.0, 2.0, 6.0]) == pytest.approx([0.0, 0.1, 0.9], rel=1e-15)


def test_compression_absorbs_energy_as_tension_does():
    assert energy_absorbed(STROKE, 5e4 * STROKE) == pytest.approx(0.5 * 5e4 * 0.02**2, rel=1e-14)


def test_an_elastic_loop_keeps_nothing_and_a_lossy_one_its_area():
    there_and_back = np.concatenate([STROKE, STROKE[-2::-1]])
    elastic = np.concatenate([FORCE, FORCE[-2::-1]])
    assert energy_absorbed(there_and_back, elastic) == pytest.approx(0.0, abs=1e-15 * abs(FORCE).max())
    assert energy_loaded(there_and_back, elastic) == pytest.approx(energy_absorbed(STROKE, FORCE), rel=1e-14)
    assert energy_absorbed([0.0, 1.0, 1.0, 0.0], [2.0, 2.0, 1.0, 1.0]) == 1.0


def test_stiffness_of_a_parabola_is_exact():
    """Differences of second order differentiate a parabola without error."""
    assert initial_stiffness(STROKE, FORCE) == pytest.approx(5e4, rel=1e-12)
    assert secant_stiffness(STROKE, FORCE) == pytest.approx(5e4 + 3e6 * 0.02, rel=1e-12)
    assert initial_stiffness([0.0, 0.5], [0.0, 2.0]) == 4.0
    assert np.isnan(initial_stiffness([0.0], [0.0]))


def test_force_is_interpolated_while_loading():
    there_and_back = np.concatenate([STROKE, STROKE[-2::-1]])
    force = np.concatenate([FORCE, 0.5 * FORCE[-2::-1]])
    wanted = [STROKE[3], (STROKE[3] + STROKE[4]) / 2, -0.03]
    assert force_at(there_and_back, force, wanted) == pytest.approx(
        [FORCE[3], (FORCE[3] + FORCE[4]) / 2, np.nan], rel=1e-12, nan_ok=True
    )


def test_compression_is_negative_stroke_and_force():
    assert is_compression(STROKE, FORCE)
    assert not is_compression(-STROKE, -FORCE)


def test_arrays_that_are_no_curve_are_refused():
    with pytest.raises(ValueError, match="are no curve"):
        energy_absorbed([0.0, 1.0], [0.0])


@pytest.mark.parametrize(
    ("label", "units"),
    [
        ("SI", Units("m", "N", "Pa", "J", "s", "kg")),
        ("mm, MPa, N", Units("mm", "N", "MPa", "mJ")),
        ("mm MPa", Units("mm", "N", "MPa", "mJ")),
        ("m, kN, s", Units("m", "kN", "kPa", "kJ", "s")),
        ("in, lbf, psi", Units("in", "lbf", "psi", "lbf in")),
        ("furlongs", Units()),
    ],
)
def test_units_are_read_from_the_label(label, units):
    assert read_units(label) == units
