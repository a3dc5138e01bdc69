"""Motions against an independent code: DOP853 on the same equations, within 1e-10 m of itself
(reference/README.md).
"""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import REFERENCE, run_of

from ancf_petsc.results.tables import read_table

MOTIONS = {
    "pendulum/case.toml": ("pendulum_96_undamped.csv", "tip"),
    "pendulum/damped.toml": ("pendulum_96_damped.csv", "tip"),
    "pendulum/vertical.toml": ("pendulum_96_vertical.csv", "tip"),
    "ellipsograph/case.toml": ("ellipsograph_78.csv", "A"),
}


@pytest.mark.parametrize(
    ("case", "reference", "probe"), [(k, *v) for k, v in MOTIONS.items()], ids=list(MOTIONS)
)
def test_runge_kutta_follows_the_reference(case, reference, probe):
    """Local errors of 1e-9 of the body's size in steps held short by stability: 1e-8 m at the end, measured
    1e-9.
    """
    folder, _ = run_of(case)
    expected = np.genfromtxt(REFERENCE / reference, delimiter=",", names=True)
    probes, curve = (read_table(folder / f"{name}.csv") for name in ("probes", "curve"))
    assert np.array_equal(probes["time"], curve["time"])
    np.testing.assert_allclose(probes["time"], expected["t"], rtol=1e-14)
    for axis in "xyz":
        np.testing.assert_allclose(probes[f"{probe}.{axis}"], expected[axis], atol=1e-8)
    size = np.abs(expected["kinetic"]).max()
    for name in ("kinetic", "strain", "potential"):
        np.testing.assert_allclose(curve[f"{name}_energy"], expected[name], atol=1e-8 * size)
    np.testing.assert_allclose(curve["energy_drift"], 0.0, atol=1e-8 * size)
