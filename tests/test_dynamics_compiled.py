"""Steps in compiled loops against PETSc's: the adaptive pair of Runge and Kutta, generalised alpha."""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import GRAVITY, HINGE, PROJECT, Followed, pendulum
from mpi4py import MPI

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.build import build
from ancf_petsc.analysis.motion import MotionAnalysis
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import MotionStopped
from ancf_petsc.motion.compiled_newton import CompiledNewton
from ancf_petsc.motion.integrators import Integrator
from ancf_petsc.results.tables import read_table
from ancf_petsc.solve.petsc import petsc_options

ADAPTIVE = {"duration": 0.2, "outputs": 4, "integrator": "runge_kutta_5dp", "tolerance": 1e-6}
ALPHA = {"duration": 0.2, "outputs": 4, "integrator": "generalized_alpha", "step": 2e-3}
RAMPED = {**GRAVITY, "ramp": "cosine"}
ENERGIES = ("kinetic_energy", "strain_energy", "external_work", "dissipated_energy")


def both_ways(tmp_path, monkeypatch, data):
    """Curves of the compiled loop and of PETSc's steps."""
    curves = []
    for way in ("compiled", "petsc"):
        if way == "petsc":
            monkeypatch.setattr(Integrator, "compiled", None)
        run_case(case_from_dict(data, PROJECT), tmp_path / way)
        curves.append(read_table(tmp_path / way / "curve.csv"))
    return curves


def assert_equal_energies(fast, plain, within):
    size = np.abs(plain["kinetic_energy"]).max()
    for name in ENERGIES:
        np.testing.assert_allclose(fast[name], plain[name], atol=within * size, err_msg=name)


@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_the_adaptive_pair_takes_the_steps_of_petsc(damping, tmp_path, monkeypatch):
    """The same steps, accepted and rejected; states to rounding, which rejected steps amplify a little."""
    fast, plain = both_ways(tmp_path, monkeypatch, pendulum({**ADAPTIVE, "damping": damping}))
    for name in ("steps", "rejected_steps"):
        assert fast[name].tolist() == plain[name].tolist()
    assert fast["rejected_steps"].sum() > 0
    assert_equal_energies(fast, plain, 1e-9)


@pytest.mark.parametrize("tables", [{}, {"load": [RAMPED]}, {"constraint": [{**HINGE, "fix": ["x", "z"]}]}])
@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_generalised_alpha_takes_the_iterations_of_snes(tables, damping, tmp_path, monkeypatch):
    """The same Newton, iteration for iteration: states to the rounding of its linear solver."""
    fast, plain = both_ways(tmp_path, monkeypatch, pendulum({**ALPHA, "damping": damping}, **tables))
    for name in ("steps", "newton_iterations"):
        assert fast[name].tolist() == plain[name].tolist()
    assert_equal_energies(fast, plain, 1e-9)


def test_a_step_that_fails_is_left_to_snes(monkeypatch):
    """Which goes on from the step before; here every other leap is said to have failed at its second step."""
    answer = Followed(pendulum(ALPHA)).positions
    whole, calls = CompiledNewton.steps, []

    def steps(self, state, times, scheme):
        calls.append(len(times))
        if len(calls) % 2:
            return whole(self, state, times, scheme)
        done, newton, good = whole(self, state, times[:1], scheme)
        return done, newton, False

    monkeypatch.setattr(CompiledNewton, "steps", steps)
    followed = Followed(pendulum(ALPHA))
    assert sum(step.count for step in followed.steps) == 100
    assert followed.steps[0].time == pytest.approx(0.05)
    np.testing.assert_allclose(followed.positions, answer, atol=1e-8)  # the factors are not of the same age


@pytest.mark.parametrize("dynamics", [ADAPTIVE, ALPHA])
@pytest.mark.parametrize(
    ("options", "compiled"), [({}, True), ({"ts_max_reject": "3"}, False), ({"malloc_dump": "0"}, True)]
)
def test_an_option_for_petscs_solvers_goes_to_them(dynamics, options, compiled):
    case = case_from_dict(pendulum(dynamics), PROJECT)
    with petsc_options(options):
        motion = MotionAnalysis(case, build(case, MPI.COMM_SELF))
        assert motion.integrator.is_compiled == compiled
        motion.destroy()


def test_loads_that_change_leave_adaptive_steps_to_petsc(tmp_path, monkeypatch):
    data = pendulum(ADAPTIVE, load=[RAMPED])
    fast, plain = both_ways(tmp_path, monkeypatch, data)
    assert fast["steps"].tolist() == plain["steps"].tolist()
    assert_equal_energies(fast, plain, 1e-9)


@pytest.mark.parametrize("dynamics", [ADAPTIVE, ALPHA])
def test_a_state_that_is_not_finite_ends_the_loops(dynamics):
    case = case_from_dict(pendulum(dynamics), PROJECT)
    motion = MotionAnalysis(case, build(case, MPI.COMM_SELF))
    motion.integrator.x.array[5] = np.nan
    motion.integrator.restart()
    with pytest.raises(
        MotionStopped, match="cannot go on from time 0 to .*: (numbers|forces) are not finite"
    ):
        motion.integrator.advance(0.05)
    motion.destroy()
