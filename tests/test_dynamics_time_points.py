"""Outputs, corners of ramps and ends that differ by rounding; steps that would be rounding errors."""

from __future__ import annotations

import numpy as np
import pytest
from family import mesh_of
from motion_cases import GRAVITY, PROJECT, Followed, pendulum

from ancf_petsc import CaseError, case_from_dict, run
from ancf_petsc.errors import MotionStopped
from ancf_petsc.model.ramp import Ramp, merged, nearest_points
from ancf_petsc.plan.outputs import output_times

METHODS = ["generalized_alpha", "energy_momentum", "theta", "bdf", "rosenbrock", "central_difference"]
NEAR = {"an ulp after": 0.7 + 1.2e-16, "an ulp before": 0.7 - 1.2e-16, "a trillionth after": 0.7 + 1e-12}


def lifted(corner, integrator="energy_momentum", duration=0.2, **dynamics):
    """A pendulum whose hinge rises with constant speed until s = corner; outputs at tenths of the duration."""
    lift = {"group": "hinge", "fix": ["x", "y"], "move": {"z": 0.02}, "ramp": [[0, 0], [corner, 1], [1, 1]]}
    how = {"duration": duration, "outputs": 10, "integrator": integrator, **dynamics}
    if "tolerance" not in how:
        how["step"] = 4e-4 if integrator == "central_difference" else 0.01
    return pendulum(how, constraint=[lift])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("corner", NEAR.values(), ids=list(NEAR))
def test_a_corner_beside_an_output_is_that_output(method, corner):
    """The same steps, to a trillionth the same ramp: without the merging the velocity after a step of 1e-17 is nonsense."""
    exact, near = (Followed(lifted(s, method), lambda motion: motion.integrator.time) for s in (0.7, corner))
    assert near.rows == exact.rows
    size = np.abs(exact.velocities).max()
    np.testing.assert_allclose(near.positions, exact.positions, rtol=0, atol=1e-10)
    np.testing.assert_allclose(near.velocities, exact.velocities, rtol=0, atol=1e-9 * size)


@pytest.mark.parametrize("method", ["generalized_alpha", "central_difference", "runge_kutta_5dp"])
def test_a_corner_of_a_load_beside_an_output_is_that_output(method):
    """In compiled loops too, which this body moves in."""
    found = []
    for corner in (0.7, *NEAR.values()):
        dynamics = {"duration": 0.2, "outputs": 10, "integrator": method}
        dynamics |= {"tolerance": 1e-6} if method == "runge_kutta_5dp" else {"step": 4e-4}
        ramp = [[0, 0], [corner, 1], [1, 0.5]]
        followed = Followed(pendulum(dynamics, load=[{**GRAVITY, "ramp": ramp}]), lambda m: m.integrator.time)
        assert np.diff(followed.rows).min() > 1e-5
        found.append(followed.velocities)
    for velocities in found[1:]:
        np.testing.assert_allclose(velocities, found[0], rtol=0, atol=1e-8 * np.abs(found[0]).max())


@pytest.mark.parametrize("duration", [0.1, 0.3, 0.7])
def test_a_corner_counts_whatever_its_time_is_rounded_to(duration):
    """s times duration over duration is not always s: the speed is that of the piece entered, driven nodes stay on their path."""
    for corner in (0.3, 0.55, 0.7, 0.9):
        motion = Followed(lifted(corner, "theta", duration)).motion
        equations = motion.equations
        assert equations.corners == pytest.approx([corner * duration], rel=1e-15)
        assert np.abs(equations.driven_velocities(equations.corners[0])).max() == 0.0


def test_the_shortest_step_of_an_adaptive_method_is_no_rounding_error():
    for corner in NEAR.values():
        for method in ("runge_kutta_5dp", "rosenbrock", "bdf"):
            followed = Followed(lifted(corner, method, tolerance=1e-4))
            assert min(step.size / step.count for step in followed.steps) > 1e-3 * 0.02


def test_a_step_of_a_rounding_error_is_refused():
    """Whoever asks for it, whatever the method."""
    for method in METHODS:
        motion = Followed(lifted(0.7, method)).motion
        motion.integrator.time = 0.1
        with pytest.raises(
            MotionStopped, match=r"refuses to step from time 0.1 by 1e-13, .* of the usual step"
        ):
            motion.integrator.step_to(0.1 + 1e-13)


def test_corners_of_two_ramps_meet_on_the_output_or_on_the_first_of_them():
    ramps = [
        Ramp("table", ((0.0, 0.0), (s, 1.0), (1.0, 1.0))) for s in (0.3 + 5e-17, 0.3, 0.25 + 1e-13, 0.25)
    ]
    places = nearest_points((s for ramp in ramps for s, _ in ramp.table), [0.5, 1.0], 1e-10)
    first, second, third, fourth = (ramp.moved(places) for ramp in ramps)
    assert first == second
    assert third == fourth
    assert first != third
    places = nearest_points([1e-17, 0.5 - 1e-12, 1.0 - 1e-16], [0.5, 1.0], 1e-10)
    assert list(places.values()) == [0.0, 0.5, 1.0]
    moved = Ramp("table", tuple((s, 1.0) for s in places)).moved(places)
    assert moved.corners() == (0.5,)


def test_of_points_that_differ_by_rounding_the_last_stays():
    assert merged([1e-17, 0.1, 0.3, 0.1 + 2e-17, 1.0 - 1e-16, 1.0], 1e-10) == [0.1 + 2e-17, 0.3, 1.0]


def test_a_ramp_that_jumps_is_told(tmp_path):
    data = lifted(0.7)
    data["constraint"][0]["ramp"] = [[0, 0], [0.7, 0], [0.7 + 1e-12, 1], [1, 1]]
    with pytest.raises(CaseError, match=r"constraint.*ramp: the rows at s = 0.7 and 0.7.* are a jump"):
        case_from_dict(data, PROJECT)


STATICS = {
    "times": ({"times": [0.3, 0.7, 0.7 + 1e-16, 1.0 - 1e-16]}, [0.3, 0.7, 1.0]),
    "strokes": ({"strokes": [0.002, 0.004, 0.01]}, [0.2, 0.4, 1.0]),
}


def pressed(statics, folder, ramp):
    """A brick pressed by a tenth of its height along a ramp."""
    return {
        "title": "Pressed",
        "mesh": {"file": str(mesh_of("cube", "3813", (1, 1, 1), folder)), "element": "3813"},
        "groups": {"low": {"plane": "z", "at": "min"}, "high": {"plane": "z", "at": "max"}},
        "material": {"law": "neo_hooke", "young": 1.0, "poisson": 0.3},
        "constraint": [
            {"group": "low", "fix": ["x", "y", "z"]},
            {"group": "high", "fix": ["x", "y"], "move": {"z": -0.01}, "ramp": ramp},
        ],
        "statics": statics,
        "output": {"curve": {"force": "high.z", "stroke": "high.z"}},
    }


@pytest.mark.parametrize(("statics", "expected"), STATICS.values(), ids=list(STATICS))
def test_a_path_has_one_row_for_points_that_differ_by_rounding(statics, expected, tmp_path, caplog):
    """Corners an ulp beside outputs make no step: as many steps as with corners on them."""
    caplog.set_level("INFO", "ancf")
    steps = []
    for shift in (0.0, 1e-16):
        ramp = [[0, 0], [0.2 + shift, 0.2], [0.7 + shift, 0.7], [1, 1]]
        data = pressed(statics, tmp_path, ramp)
        case = case_from_dict(data, tmp_path)
        assert output_times(case.spec) == pytest.approx(expected, rel=1e-15)
        curve = run(case, tmp_path / f"run_{shift}").curve
        assert curve["pseudo_time"].tolist() == pytest.approx([0.0, *expected], rel=1e-15)
        steps.append(curve["steps"].tolist())
    assert steps[0] == steps[1]
