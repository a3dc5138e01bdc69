"""Driven nodes in motion: on their path exactly, their reactions and work, jumps of their velocity."""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import PROJECT, Followed, pendulum, slope

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.run import run_case
from ancf_petsc.results.tables import read_table

LIFT = {"group": "hinge", "fix": ["x", "y"], "move": {"z": 0.1}, "ramp": "cosine"}
METHODS = {
    "generalized_alpha": 0.01,
    "energy_momentum": 0.01,
    "theta": 0.01,
    "bdf": 0.01,
    "rosenbrock": 0.01,
    "runge_kutta_5dp": 4e-4,
    "runge_kutta_4": 1e-3,
    "central_difference": 5e-4,
}


def driven_of(motion):
    model = motion.assembly.model
    moved = model.drive[: model.owned, 2] >= 0
    z = motion.integrator.x.array_r.reshape(-1, 3)[moved, 2] - model.reference[: model.owned][moved, 2]
    return motion.integrator.time, z


@pytest.mark.parametrize("name", METHODS)
def test_every_method_keeps_driven_nodes_on_their_path(name):
    """After every step, to rounding."""
    data = pendulum(
        {"duration": 0.1, "outputs": 2, "integrator": name, "step": METHODS[name]}, constraint=[LIFT]
    )
    for time, z in Followed(data, driven_of).rows:
        np.testing.assert_allclose(z, 0.1 * (1 - np.cos(np.pi * time / 0.1)) / 2, atol=1e-15)


@pytest.mark.parametrize("name", ["generalized_alpha", "energy_momentum", "theta", "central_difference"])
def test_driven_nodes_leave_the_order_as_it_is(name):
    """On a body so soft that the steps resolve all its modes: the cosine ramp begins with a jump of the
    acceleration.
    """

    def positions(**dynamics):
        how = {"duration": 0.5, "outputs": 1, **dynamics}
        return Followed(pendulum(how, constraint=[LIFT], load=[], material={"young": 2e4})).positions

    answer = positions(integrator="runge_kutta_4", step=0.5 / 1600)
    sizes = (200, 400, 800)
    errors = [np.abs(positions(integrator=name, step=0.5 / n) - answer).max() for n in sizes]
    assert -slope(sizes, errors) == pytest.approx(2.0, abs=0.1)


def run(folder, constraint, **dynamics):
    data = pendulum({"duration": 0.4, "outputs": 20, **dynamics}, constraint=[constraint])
    run_case(case_from_dict(data, PROJECT), folder)
    return read_table(folder / "curve.csv")


def test_energy_balances_with_driven_nodes_and_loss(tmp_path):
    """Work and loss by cubic polynomials between steps held short by stability: 1e-7 of the work."""
    curve = run(tmp_path / "run", LIFT, integrator="runge_kutta_5dp", tolerance=1e-9, damping=2.0)
    assert np.abs(curve["energy_drift"]).max() < 1e-7 * np.abs(curve["external_work"]).max()
    assert curve["dissipated_energy"][-1] > 0.1


def test_reactions_change_the_momentum(tmp_path):
    """d P / dt = gravity + reactions - alpha P; the integral by Simpson's rule over 200 outputs, to its
    error 1e-3.
    """
    curve = run(
        tmp_path / "run", LIFT, integrator="runge_kutta_5dp", tolerance=1e-8, damping=2.0, outputs=400
    )
    weight = 39.0 * 9.81
    force = curve["hinge.rz"] - weight - 2.0 * curve["momentum.z"]
    h = curve["time"][1]
    impulse = h / 3 * (force[0] + 4 * force[1::2].sum() + 2 * force[2:-1:2].sum() + force[-1])
    assert impulse == pytest.approx(curve["momentum.z"][-1] - curve["momentum.z"][0], abs=1e-3 * weight * 0.4)


@pytest.mark.parametrize("name", ["energy_momentum", "runge_kutta_5dp", "generalized_alpha"])
def test_a_corner_of_a_ramp_is_hit_and_its_impulse_counted(name, tmp_path):
    """A velocity that jumps at s = 0.3 (between two outputs) and at 0.6: the impulse's work closes the
    balance.
    """
    kinked = {**LIFT, "move": {"z": 0.05}, "ramp": [[0, 0], [0.3, 0], [0.6, 1], [1, 1]]}
    how = {"step": 2e-4} if name != "runge_kutta_5dp" else {"tolerance": 1e-8}
    curve = run(tmp_path / "run", kinked, integrator=name, **how, outputs=7)
    allowed = {"energy_momentum": 1e-9, "runge_kutta_5dp": 1e-6, "generalized_alpha": 2e-2}[name]
    assert np.abs(curve["energy_drift"]).max() < allowed * np.abs(curve["external_work"]).max()


@pytest.mark.parametrize("name", ["bdf", "theta"])
def test_driven_nodes_gather_no_rounding_from_what_a_method_extrapolates(name):
    """Their equations are solved too. Left out, rounding in bdf's extrapolation grows with the number of steps, held nodes
    wander off and after some hundred steps Newton stands still above its tolerance: 600 steps from rest, whose ramp begins
    with a jump of the velocity.
    """

    def own_of_driven(motion):
        y, driven = motion.integrator.y.array_r, motion.assembly.driven
        return np.concatenate((y[driven], y[len(y) // 2 + driven]))

    drive = {"group": "hinge", "fix": ["x", "y"], "move": {"z": 1e-6}, "ramp": "linear"}
    how = {"duration": 0.6, "outputs": 2, "step": 1e-3, "integrator": name}
    followed = Followed(pendulum(how, constraint=[drive], load=[]), own_of_driven)
    rows = np.array(followed.rows)
    assert np.abs(rows - rows[0]).max() <= 1e-12 * np.abs(rows[0]).max()
    assert max(step.newton for step in followed.steps) <= 4


@pytest.mark.parametrize("amount", [1e-3, 1e-9])
@pytest.mark.parametrize("name", ["generalized_alpha", "energy_momentum", "theta", "bdf", "rosenbrock"])
def test_newton_gets_over_jumps_of_velocities_large_and_small(name, amount):
    """At the start and twice on the way, of 1e-2 and 1e-8 m/s: tolerances are relative to forces or to what rounding leaves."""
    jumps = {
        "group": "hinge",
        "fix": ["x", "y"],
        "move": {"z": amount},
        "ramp": [[0, 0], [0.31, 1], [0.62, 0], [1, 0.5]],
    }
    how = {"duration": 0.3, "outputs": 3, "step": 2e-3, "integrator": name}
    followed = Followed(pendulum(how, constraint=[jumps], load=[]))
    assert max(step.newton for step in followed.steps) <= 6
    assert np.abs(followed.velocities).max() < 100 * amount
