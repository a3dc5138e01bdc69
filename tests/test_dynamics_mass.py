"""The mass of the body: what it must be, and what solves with it."""

from __future__ import annotations

import numpy as np
import pytest
from family import mesh_of, motion
from motion_cases import GRAVITY, PROJECT, Followed, body, pendulum
from mpi4py import MPI

from ancf_petsc import case_from_dict, run
from ancf_petsc.analysis.build import build
from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.motion.mass_solver import MassSolver

STILL = {"duration": 1e-3, "outputs": 1, "integrator": "runge_kutta_4", "step": 1e-3}
VOLUME, DENSITY = 0.5 * 0.1 * 0.1, 7800.0


def looked_at(look, **dynamics):
    return Followed(pendulum({**STILL, **dynamics}), look).rows[0]


def test_gravity_pulls_at_each_material_by_its_own_density(tmp_path):
    """Half of the length twice as dense: the weight is one and a half times that of one material."""
    data = pendulum(STILL, groups={"half": {"box": [[-1, -1, -1], [0.25, 1, 1]]}})
    data["material"] = [data["material"] | {"group": "half", "density": 2 * DENSITY}, data["material"]]
    model = build(case_from_dict(data, PROJECT), MPI.COMM_SELF).model
    weight = model.loads[0].pattern.sum(axis=0)
    np.testing.assert_allclose(weight, [0.0, 0.0, -9.81 * 1.5 * VOLUME * DENSITY], rtol=1e-12)


def test_a_plate_in_plane_stress_has_condensed_parameters():
    section = {"thickness": 0.1, "plane": "stress"}
    data = body("pendulum_2432_8.msh", STILL, section=section, constraint=[])
    data["mesh"]["element"] = "2432"
    model = build(case_from_dict(data, PROJECT), MPI.COMM_SELF).model
    young, poisson = data["material"]["young"], data["material"]["poisson"]
    condensed = young * poisson / (1 - poisson**2)
    np.testing.assert_allclose(
        model.regions[0].parameters, [condensed, young / (2 * (1 + poisson))], rtol=1e-14
    )


@pytest.mark.parametrize("kind", ["consistent", "lumped"])
def test_total_mass_and_centre(kind):
    def look(motion):
        n = motion.assembly.model.owned
        return motion.mass.times(np.ones((n, 3))).sum(axis=0), motion.mass.centre()

    total, centre = looked_at(look, mass=kind)
    np.testing.assert_allclose(total, VOLUME * DENSITY, rtol=1e-13)
    np.testing.assert_allclose(centre, [0.25, 0.05, 0.05], atol=1e-14)


def test_a_rotating_block_has_the_energy_and_momentum_of_a_rigid_body():
    """Consistent mass: linear velocities are exact. J of a block about its centre: m (b^2 + c^2) / 12."""
    spin = np.array([1.0, 2.0, 3.0])
    mass = VOLUME * DENSITY
    inertia = mass / 12 * np.array([0.1**2 + 0.1**2, 0.5**2 + 0.1**2, 0.5**2 + 0.1**2])

    def look(motion):
        v = motion.integrator.v.array_r.reshape(-1, 3)
        return motion.mass.kinetic_energy(v), *motion.mass.momenta(motion.integrator.x, v)

    start = {"velocity": [1.0, 0.0, -1.0], "spin": spin.tolist()}
    energy, linear, angular = Followed(body("pendulum_96.msh", STILL, initial=start), look).rows[0]
    assert energy == pytest.approx(0.5 * mass * 2 + 0.5 * spin**2 @ inertia, rel=1e-13)
    np.testing.assert_allclose(linear, mass * np.array([1.0, 0.0, -1.0]), atol=1e-12)
    orbital = np.cross([0.25, 0.05, 0.05], linear)
    np.testing.assert_allclose(angular, inertia * spin + orbital, rtol=1e-12)


def test_both_ways_of_solving_agree():
    """Cholesky and Chebyshev, the latter to the 1e-13 it iterates to; supports by component."""

    def look(motion):
        b = np.random.default_rng(1).normal(size=(motion.assembly.model.owned, 3))
        answers = [MassSolver(motion.mass, way).solve(b) for way in ("cholesky", "chebyshev")]
        free = motion.equations.solver.free
        return answers, [np.where(free, motion.mass.times(a) - b, 0.0) for a in answers], free

    hinge = {"group": "hinge", "fix": ["x", "z"]}
    answers, residuals, free = Followed(pendulum(STILL, constraint=[hinge]), look).rows[0]
    for answer, residual in zip(answers, residuals, strict=True):
        np.testing.assert_allclose(answer, answers[0], atol=1e-11 * np.abs(answers[0]).max())
        np.testing.assert_allclose(residual, 0.0, atol=1e-11)
        assert not answer[~free].any()
    assert (~free).sum() == 6


@pytest.mark.parametrize(("kind", "exact"), [("consistent", 2165.4), ("lumped", 1093.9)])
def test_the_highest_frequency_is_estimated_on_the_safe_side(kind, exact):
    """Exact values by a dense eigensolver of another program; the estimate is at most 6 % above."""
    omega = looked_at(lambda motion: motion.integrator.highest_frequency, mass=kind)
    assert 1.0 < omega / exact < 1.06


@pytest.mark.parametrize("code", list(ELEMENTS))
@pytest.mark.parametrize("kind", ["consistent", "lumped"])
def test_a_free_body_falls_as_a_whole(code, kind, tmp_path):
    """Every position at g and no slope at all: load and mass have the same shares. Rounding of stiff internal forces: 1e-9 g."""
    g = np.array([0.0, -2.0, -9.81]) if ELEMENTS[code].components == 3 else np.array([1.0, 0.0, -9.81])

    def look(motion):
        model, x = motion.assembly.model, motion.integrator.x
        return motion.equations.acceleration(0.0, x, np.zeros((model.owned, 3))), model.own_positions

    mesh = mesh_of("pendulum", code, (2, 1, 1), tmp_path)
    section = {"2": {"thickness": 0.1, "plane": "stress"}, "1": {"area": 1e-2, "inertia": 1e-5}}.get(code[0])
    data = motion(mesh, code, 1e-6, step=1e-6, mass=kind)
    data["load"][0]["acceleration"] = g.tolist()
    del data["constraint"], data["probe"]
    data |= {"section": section} if section else {}
    accelerations, positions = Followed(data, look).rows[0]
    found = np.zeros((len(accelerations), 3))
    found[positions] = g
    np.testing.assert_allclose(accelerations, found, rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ["energy_momentum", "runge_kutta_5dp", "central_difference"])
def test_work_of_a_load_that_does_not_start_from_nothing(name, tmp_path):
    """A ramp from one half, with a corner: the balance closes, to 1e-9 of the work where the method keeps it exactly."""
    how = {"energy_momentum": 5e-3, "central_difference": 2e-4}
    dynamics = {"duration": 0.2, "outputs": 7, "integrator": name}
    dynamics |= {"step": how[name]} if name in how else {"tolerance": 1e-8}
    load = {**GRAVITY, "ramp": [[0, 0.5], [0.43, 1], [1, 0.2]]}
    curve = run(case_from_dict(pendulum(dynamics, load=[load]), PROJECT), tmp_path / "run").curve
    allowed = {"energy_momentum": 1e-9, "runge_kutta_5dp": 1e-8, "central_difference": 3e-6}[name]
    assert curve["external_work"][-1] > 10.0
    assert np.abs(curve["energy_drift"]).max() < allowed * curve["external_work"][-1]
