"""PETSc options of a case: those that PETSc reads at its start, during the solution and at its end are taken; a
misspelt one is an error before anything is solved, one that nothing asks for is an error at the end.
"""

from __future__ import annotations

import logging
import subprocess
import sys

import pytest
from mpi4py import MPI
from petsc4py import PETSc

from ancf_petsc import load_case, open_results
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import CaseError
from ancf_petsc.launcher import is_general_option
from ancf_petsc.solve.petsc import is_given, is_known_option, nearest_option, petsc_options

GENERAL = ["-log_view", "-options_left", "-info", ":snes", "-malloc_debug", "-on_error_abort"]
DURING = ["-snes_converged_reason", "-ksp_converged_reason", "-snes_view", "-snes_monitor"]


def block(project, steps=2, **options):
    changes = {"statics.steps": steps, **{f"petsc.{name}": value for name, value in options.items()}}
    return load_case(project / "cases/pvc_block").with_changes(changes)


def test_standard_options_are_taken_and_do_something(ancf, project, tmp_path):
    out = tmp_path / "run"
    words = ["run", project / "cases/pvc_block", "--out", out, "--set", "statics.steps=1", "--quiet", "--"]
    said = ancf(*words, *GENERAL, *DURING).stdout
    for words in (
        "Linear solve converged due to", "Nonlinear solve converged due to", "SNES Object", "SNES Function norm",
        "[0] <snes>", "PETSc Performance Summary", "There are no unused options",
    ):  # fmt: skip
        assert words in said
    assert "SNESSolve" in said.partition("Performance Summary")[2]  # timed from its start


@pytest.mark.parametrize(
    ("name", "cure"),
    [
        ("ksp_typ", "did you mean 'ksp_type'?"),
        ("snes_convreged_reason", "did you mean 'snes_converged_reason'?"),
        ("mg_levels_ksp_tpye", "did you mean 'mg_levels_ksp_type'?"),
        ("log_veiw", "did you mean 'log_view'?"),
        ("no_such_option", "take it out or correct its name"),
    ],
)
def test_a_misspelt_option_is_an_error_before_the_solution(name, cure, project, tmp_path):
    with pytest.raises(CaseError, match="no solver of this run uses it") as refused:
        run_case(block(project, **{name: True}), tmp_path / "run")
    assert refused.value.key == f"petsc.{name}"
    assert refused.value.cure == cure
    assert not (tmp_path / "run").exists()


def test_an_option_of_a_solver_not_in_use_is_an_error_at_the_end(project, tmp_path, caplog):
    """Nobody knows before which options the solution will ask for; a warning at once, the results are kept."""
    with caplog.at_level(logging.WARNING, "ancf"), pytest.raises(CaseError, match="take it out") as refused:
        run_case(block(project, pc_gamg_threshold=0.1), tmp_path / "run")
    assert refused.value.key == "petsc.pc_gamg_threshold"
    assert "petsc.pc_gamg_threshold: no solver has asked for it so far" in caplog.text
    assert len(open_results(tmp_path / "run").times) == 3


def test_names_are_known_with_their_prefixes_and_numbers():
    known = "ksp_type mat_mumps_icntl_14 mg_levels_1_pc_type sub_pc_factor_levels system_ksp_rtol snes_view"
    assert all(map(is_known_option, known.split()))
    assert not any(map(is_known_option, ("mat_mumps_icntl_x", "mg_levels_", "type", "ts_rk_typo", "")))
    assert nearest_option("sub_pc_factor_level") == "did you mean 'sub_pc_factor_levels'?"


def test_general_options_are_not_those_of_solvers():
    assert all(map(is_general_option, ("log_view", "LOG_VIEW", "on_error_abort", "fp_trap", "options_left")))
    assert not any(map(is_general_option, ("ksp_type", "snes_view", "log_veiw", "ts_monitor")))


def test_a_question_is_no_use_and_options_end_with_their_run():
    """But for PETSc's general options, which it reads at the end of the process."""
    with petsc_options({"ksp_rtol": "1e-3", "citations": True}) as given:
        assert is_given("ksp_rtol")
        assert given.unused(MPI.COMM_SELF) == ["ksp_rtol"]
    assert not is_given("ksp_rtol")
    assert is_given("citations")
    PETSc.Options().delValue("citations")


def test_a_reader_that_leaves_does_not_end_the_run(project, tmp_path):
    """PETSc takes SIGPIPE for a reason to abort."""
    program = (
        f'"{sys.executable}" -m ancf_petsc run "{project}/cases/pvc_block" --out run --set statics.steps=4'
    )
    command = ["bash", "-c", f'{program} | head -1; exit "${{PIPESTATUS[0]}}"']
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=240)
    assert (done.returncode in (0, 141), done.stderr) == (True, "")
    assert len(open_results(tmp_path / "run").times) == 5
