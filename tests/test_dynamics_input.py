"""What a motion refuses, what it warns of, and how it stops."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest
from motion_cases import PROJECT, pendulum

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import CaseError, Interrupted, MotionStopped
from ancf_petsc.results.tables import read_table


def case(dynamics, **tables):
    return case_from_dict(pendulum(dynamics, **tables), PROJECT)


WRONG = {
    "negative duration": (
        {"duration": -1.0, "step": 0.1},
        "dynamics.duration: found -1.0, expected a number > 0",
    ),
    "negative step": ({"duration": 1.0, "step": -0.1}, "dynamics.step: found -0.1, expected a number > 0"),
    "unknown integrator": (
        {"duration": 1.0, "step": 0.1, "integrator": "euler"},
        "generalized_alpha, energy_momentum",
    ),
    "step and tolerance": (
        {"duration": 1.0, "step": 0.1, "tolerance": 1e-3, "integrator": "bdf"},
        "step and tolerance given",
    ),
    "bdf of order 3": (
        {"duration": 1.0, "step": 0.1, "integrator": "bdf", "order": 3},
        "orders above 2 are unstable",
    ),
}


@pytest.mark.parametrize(("dynamics", "words"), WRONG.values(), ids=list(WRONG))
def test_wrong_input_is_told(dynamics, words):
    with pytest.raises(CaseError) as error:
        case(dynamics)
    assert words in str(error.value)


def test_mass_needs_density():
    data = pendulum({"duration": 1.0, "step": 0.1}, load=[])
    del data["material"]["density"]
    with pytest.raises(CaseError, match="density: missing: expected a number > 0, because of .dynamics"):
        case_from_dict(data, PROJECT)


def test_a_step_far_too_long_is_warned_of_and_stops_with_what_was_good(tmp_path, caplog):
    """omega h = 2.2: the motion runs into numbers that are not finite; results up to there are whole."""
    caplog.set_level("INFO", "ancf")
    dynamics = {"duration": 1.0, "outputs": 50, "integrator": "runge_kutta_5dp", "step": 1e-3}
    with pytest.raises(
        MotionStopped, match="runge_kutta_5dp cannot go on from time .* not finite any more"
    ) as failure:
        run_case(case(dynamics), tmp_path / "run")
    assert failure.value.exit_code == 3
    assert "is above the stable step of runge_kutta_5dp" in caplog.text
    assert "take step = 0.000453 or less" in caplog.text
    curve = read_table(tmp_path / "run" / "curve.csv")
    assert f"from time {curve['time'][-1]:.6g} " in str(failure.value)
    assert all(np.isfinite(column).all() for column in curve.values())


def test_a_step_is_shortened_to_fill_the_intervals_of_outputs(tmp_path, caplog):
    caplog.set_level("INFO", "ancf")
    run_case(case({"duration": 0.1, "outputs": 3, "step": 0.007}), tmp_path / "run")
    assert "step 0.007 shortened to 0.00666667: 5 equal steps fill the interval of outputs" in caplog.text
    curve = read_table(tmp_path / "run" / "curve.csv")
    assert curve["time"].tolist() == [0.1 * k / 3 for k in range(4)]
    assert curve["steps"].tolist() == [0, 5, 5, 5]


def test_outputs_are_hit_where_the_sum_of_their_steps_is_rounded(tmp_path):
    """Three thirds of a seventh of 0.1 are not that seventh: it would have no row. A method without compiled loops, which leap."""
    end = 0.1 / 7
    assert end * 3 / 3 != end
    run_case(case({"duration": 0.1, "outputs": 7, "step": 0.005, "integrator": "theta"}), tmp_path / "run")
    curve = read_table(tmp_path / "run" / "curve.csv")
    assert curve["time"].tolist() == [0.1 * k / 7 for k in range(8)]
    assert curve["steps"].tolist() == [0, *[3] * 7]


@pytest.mark.parametrize("integrator", ["energy_momentum", "theta"])
def test_a_signal_stops_after_the_step_with_everything_written(integrator, tmp_path):
    """The state it stopped at is the last row, with the work of gravity up to there."""

    def watch(done: float) -> None:
        if done > 0.5:
            os.kill(os.getpid(), signal.SIGTERM)

    dynamics = {"duration": 0.1, "outputs": 2, "step": 0.01, "integrator": integrator}
    with pytest.raises(Interrupted, match="stopped at time 0.06; everything up to here is saved"):
        run_case(case(dynamics), tmp_path / "run", watch=watch)
    curve = read_table(tmp_path / "run" / "curve.csv")
    assert curve["time"].tolist() == pytest.approx([0.0, 0.05, 0.06])
    assert curve["external_work"][2] > 1.1 * curve["external_work"][1] > 0.0
    assert np.abs(curve["energy_drift"]).max() < 1e-3 * curve["external_work"][2]


def test_the_row_a_signal_stops_at_has_the_work_up_to_there(tmp_path):
    """Of constant loads too, whose work is otherwise taken at outputs alone."""
    dynamics = {"duration": 0.1, "outputs": 2, "step": 0.01, "integrator": "theta"}
    data = case(dynamics)

    def watch(done: float) -> None:
        if done > 0.5:
            os.kill(os.getpid(), signal.SIGTERM)

    with pytest.raises(Interrupted):
        run_case(data, tmp_path / "stopped", watch=watch)
    run_case(data.with_changes({"dynamics.outputs": 10}), tmp_path / "whole")
    stopped, whole = (read_table(tmp_path / name / "curve.csv") for name in ("stopped", "whole"))
    row = np.argmin(np.abs(whole["time"] - stopped["time"][-1]))
    assert stopped["external_work"][-1] == pytest.approx(whole["external_work"][row], rel=1e-9)
    assert stopped["external_work"][-1] != pytest.approx(stopped["external_work"][-2], rel=1e-3)


def test_options_of_petsc_have_the_last_word(tmp_path):
    """Another solver gives the same motion; an option nobody reads is refused."""
    ends = []
    for number, options in enumerate(({}, {"ksp_type": "cg", "pc_type": "jacobi", "ksp_rtol": 1e-12})):
        dynamics = {"duration": 0.1, "outputs": 1, "step": 0.01, "integrator": "theta"}
        run_case(case(dynamics, petsc=options), tmp_path / str(number))
        ends.append(read_table(tmp_path / str(number) / "curve.csv")["kinetic_energy"][-1])
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)
    with pytest.raises(CaseError, match="petsc.ts_rk_typo"):
        run_case(case({"duration": 0.1, "step": 0.01}, petsc={"ts_rk_typo": "3"}), tmp_path / "2")
