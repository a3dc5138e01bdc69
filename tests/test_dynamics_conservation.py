"""What the energy-momentum step keeps, and the trapezoidal rule does not."""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import CASES, run_of

from ancf_petsc import load_case
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import MotionStopped
from ancf_petsc.results.tables import read_table


def curve_of(case, folder, **changes):
    run_case(load_case(CASES / case).with_changes(changes), folder)
    return read_table(folder / "curve.csv")


def vectors(curve, name):
    return np.stack([curve[f"{name}.{axis}"] for axis in "xyz"], axis=1)


def worst(values):
    return np.linalg.norm(values - values[0], axis=-1).max() / np.linalg.norm(values[0])


@pytest.mark.parametrize("case", ["case.toml", "fast.toml"])
def test_free_flight_keeps_energy_and_momenta(case):
    """1000 steps of 20 times the explicit limit: 1e-8 of each, from Newton's tolerance 1e-11."""
    curve = read_table(run_of(f"tumbling_block/{case}")[0] / "curve.csv")
    energy = curve["kinetic_energy"] + curve["strain_energy"]
    assert curve["steps"].sum() == 1000
    assert np.abs(energy / energy[0] - 1).max() < 1e-8
    assert worst(vectors(curve, "momentum")) < 1e-8
    assert worst(vectors(curve, "angular_momentum")) < 1e-8


def test_free_flight_of_neo_hooke_keeps_them_too(tmp_path):
    """By the law's discrete gradient; 200 steps."""
    changes = {"material.law": "neo_hooke", "dynamics.duration": 3.68952, "dynamics.outputs": 20}
    curve = curve_of("tumbling_block/case.toml", tmp_path / "run", **changes)
    energy = curve["kinetic_energy"] + curve["strain_energy"]
    assert np.abs(energy / energy[0] - 1).max() < 1e-8
    assert worst(vectors(curve, "angular_momentum")) < 1e-8


@pytest.mark.parametrize("case", ["trapezoidal.toml", "fast_trapezoidal.toml"])
def test_the_trapezoidal_rule_gains_energy_until_it_fails(case, tmp_path):
    """Before step 400, or with 1.5 times the energy; what was before is kept and the failure is told in
    words.
    """
    with pytest.raises(
        MotionStopped, match="theta cannot go on from time .*; try a smaller dynamics.step"
    ) as failure:
        curve_of(f"tumbling_block/{case}", tmp_path / "run")
    assert failure.value.exit_code == 3
    curve = read_table(tmp_path / "run" / "curve.csv")
    energy = curve["kinetic_energy"] + curve["strain_energy"]
    assert curve["steps"].sum() < 400 or energy.max() > 1.5 * energy[0]
    assert np.isfinite(energy).all()
    assert f"{curve['time'][-1]:.6g}" in str(failure.value)


def test_a_stiff_pendulum_keeps_its_energy_where_no_vibration_is_resolved(tmp_path):
    """omega_max h = 700: drift within 1e-8 of m g L = 191 J; the trapezoidal rule fails before 10 s."""
    curve = read_table(run_of("stiff_pendulum/case.toml")[0] / "curve.csv")
    assert np.abs(curve["energy_drift"]).max() < 1e-8 * 191
    with pytest.raises(MotionStopped):
        curve_of("stiff_pendulum/trapezoidal.toml", tmp_path / "trapezoidal")


def test_work_of_driven_nodes_and_loads_is_exact(tmp_path):
    """A driven hinge, a damped fall, steps far too long: the balance holds to Newton's tolerance all the
    same.
    """
    changes = {
        "dynamics": {
            "duration": 1.0,
            "integrator": "energy_momentum",
            "step": 0.02,
            "damping": 2.0,
            "outputs": 25,
        },
        "constraint.hinge.fix": ["x", "y"],
        "constraint.hinge.move": {"z": 0.2},
    }
    curve = curve_of("pendulum", tmp_path / "run", **changes)
    assert np.abs(curve["energy_drift"]).max() < 1e-9 * np.abs(curve["external_work"]).max()
    assert curve["dissipated_energy"][-1] > 1.0
