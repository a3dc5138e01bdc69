"""The central difference: against the reference, in free flight, with damping, ramps, either mass, other
elements; its compiled loops against its steps.
"""

from __future__ import annotations

import numpy as np
import pytest
from family import mesh_of
from motion_cases import GRAVITY, HINGE, PROJECT, REFERENCE, Followed, body, pendulum, slope

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import MotionStopped
from ancf_petsc.motion.integrators import Integrator
from ancf_petsc.results.tables import read_table

METHOD = {"integrator": "central_difference"}
RAMPED = {**GRAVITY, "ramp": "cosine"}
STEP = 5e-4


def curve_of(folder, **dynamics):
    data = pendulum({"duration": 0.2, "outputs": 10, **METHOD, **dynamics}, load=[RAMPED])
    run_case(case_from_dict(data, PROJECT), folder)
    return read_table(folder / "curve.csv")


def test_1100_steps_follow_the_reference_within_a_tenth_of_a_millimetre(tmp_path):
    """DOP853 on the same equations; an independent code measured 4e-5 m with as many steps."""
    data = pendulum({"duration": 1.0, "outputs": 100, "step": 1 / 1100, **METHOD})
    data["groups"] = {"corners": {"nearest": [[0.5, 0, 0], [0.5, 0.1, 0], [0.5, 0, 0.1], [0.5, 0.1, 0.1]]}}
    data["probe"] = [{"name": "tip", "group": "corners"}]
    run_case(case_from_dict(data, PROJECT), tmp_path / "run")
    probes = read_table(tmp_path / "run" / "probes.csv")
    expected = np.genfromtxt(REFERENCE / "pendulum_96_undamped.csv", delimiter=",", names=True)
    for axis in "xyz":
        np.testing.assert_allclose(probes[f"tip.{axis}"], expected[axis], atol=1e-4)


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_compiled_loops_equal_single_steps(mass, damping, tmp_path, monkeypatch):
    """State, work and loss to rounding and to the order of the sums of work."""
    how = {"step": STEP, "mass": mass, "damping": damping}
    fast = curve_of(tmp_path / "fast", **how)
    monkeypatch.setattr(Integrator, "compiled", None)
    plain = curve_of(tmp_path / "plain", **how)
    assert fast["steps"].tolist() == plain["steps"].tolist() == [0, *[40] * 10]
    size = np.abs(plain["kinetic_energy"]).max()
    for name in ("kinetic_energy", "strain_energy"):
        np.testing.assert_allclose(fast[name], plain[name], atol=1e-10 * size)
    for name in ("external_work", "dissipated_energy"):
        np.testing.assert_allclose(fast[name], plain[name], atol=2e-4 * size)


def test_it_is_of_second_order():
    """Weight that comes smoothly, steps inside the limit of stability."""

    def raised(**dynamics):
        return Followed(pendulum({"duration": 0.5, "outputs": 1, **dynamics}, load=[RAMPED])).positions

    answer, sizes = raised(integrator="runge_kutta_5dp", step=0.5 / 4000), (800, 1600, 3200)
    errors = [np.abs(raised(step=0.5 / n, **METHOD) - answer).max() for n in sizes]
    assert -slope(sizes, errors) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_the_balance_of_energy_closes_with_the_square_of_the_step(damping, tmp_path):
    """Kinetic and strain energy and loss against work: 2nd order, with ramped gravity."""
    drifts = []
    for n in (400, 800):
        curve = curve_of(tmp_path / f"{n}", step=0.2 / n, damping=damping)
        drifts.append(np.abs(curve["energy_drift"]).max() / np.abs(curve["kinetic_energy"]).max())
    assert drifts[0] < 5e-3
    assert drifts[1] < drifts[0] / 3


def test_a_free_body_keeps_its_momenta(tmp_path):
    data = body(
        "pendulum_96.msh",
        {"duration": 0.5, "outputs": 5, "step": STEP, **METHOD},
        initial={"spin": [2.0, 5.0, 3.0], "velocity": [1.0, 0.0, 0.5]},
    )
    run_case(case_from_dict(data, PROJECT), tmp_path / "run")
    curve = read_table(tmp_path / "run" / "curve.csv")
    for name in ("momentum", "angular_momentum"):
        columns = np.array([curve[f"{name}.{axis}"] for axis in "xyz"])
        drift = np.linalg.norm(columns - columns[:, :1], axis=0)
        assert drift.max() < 1e-11 * np.linalg.norm(columns[:, 0])


def test_a_step_beyond_the_limit_is_warned_of_and_stops_with_what_was_good(tmp_path, caplog):
    data = pendulum({"duration": 1.0, "outputs": 50, "step": 1.05e-3, **METHOD})
    with pytest.raises(MotionStopped, match="central_difference cannot go on .* not finite any more"):
        run_case(case_from_dict(data, PROJECT), tmp_path / "run")
    assert "is above the stable step of central_difference" in caplog.text
    curve = read_table(tmp_path / "run" / "curve.csv")
    assert all(np.isfinite(column).all() for column in curve.values())


@pytest.mark.parametrize("code", ["3-10-1-3", "3813", "3843", "3443+4"])
def test_other_elements_follow_runge_kutta(code, tmp_path):
    """Half the step, a quarter of the distance."""
    mesh = mesh_of("pendulum", code, (1, 1, 1), tmp_path)

    def positions(**dynamics):
        data = pendulum({"duration": 0.02, "outputs": 1, **dynamics}, constraint=[HINGE])
        data["mesh"] = {"file": str(mesh), "element": code}
        return Followed(data).positions

    answer = positions(integrator="runge_kutta_5dp", tolerance=1e-9)
    errors = [np.abs(positions(step=0.02 / n, **METHOD) - answer).max() for n in (100, 200)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
