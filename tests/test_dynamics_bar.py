"""The bar of section 5.1: damped to rest it is where statics says, and every joule is accounted for."""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import REFERENCE, run_of

from ancf_petsc.results.tables import read_table

WEIGHT = 0.5 * 0.1 * 0.1 * 7800.0 * 9.81


def reference(gravity: int) -> np.ndarray:
    rows = np.genfromtxt(REFERENCE / "bar_tension.csv", delimiter=",", names=True)
    return rows[(rows["elements"] == 240) & (rows["nx"] == 2) & (rows["gravity"] == gravity)][0]


def test_damped_motion_ends_at_the_static_answer():
    """Within 1e-5 after 5 s of critical damping (what is left of the motion); balance 1e-6 of the work
    (exact, in fact).
    """
    folder, _ = run_of("bar_tension/case.toml")
    probes, curve = (read_table(folder / f"{name}.csv") for name in ("probes", "curve"))
    expected = reference(gravity=1)
    assert probes["middle.uz"][-1] == pytest.approx(expected["mid_m"], rel=1e-5)
    assert probes["end.uz"][-1] == pytest.approx(expected["end_m"], rel=1e-5)
    assert np.abs(curve["energy_drift"]).max() < 1e-6 * curve["external_work"][-1]
    assert curve["top.rz"][-1] == pytest.approx(120.0 + WEIGHT, rel=1e-5)
    assert (
        "damping 14.4769 = 4 pi / T, critical for mode 1 of the body under its loads"
        in (folder / "log.txt").read_text()
    )
