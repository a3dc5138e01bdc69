"""What works without PETSc and MPI, what is said of packages that are missing, and of a PETSc that does not fit."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib

import numpy as np
import pytest
import results_writer
from mpi4py import MPI
from packaging.requirements import Requirement
from packaging.version import Version
from petsc4py import PETSc
from statics_cases import block

from ancf_petsc import case_from_dict, cli, load_case
from ancf_petsc.analysis.run import run_case
from ancf_petsc.cli.packages import import_problem
from ancf_petsc.errors import CaseError, EnvironmentProblem
from ancf_petsc.input import toml
from ancf_petsc.solve.petsc import direct_package, petsc_options

READER = """
import sys

class Without:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("mpi4py", "petsc4py", "slepc4py"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Without())
import ancf_petsc as ancf
from ancf_petsc.cli import main

folder, case, out = sys.argv[1:]
results = ancf.open_results(folder)
assert results.field("cauchy", step=-1).shape == (6, 9)
print(results.curve["stroke"][-1])
print(ancf.load_case(case).spec.title)
words = (
    ["plot", folder, "--out", out],
    ["view", folder, "--screenshot", f"{out}/run.png"],
    ["view", case, "--screenshot", f"{out}/case.png"],
    ["info", "--elements"],
    ["run", case, "--out", f"{out}/new"],
)
print([main(word) for word in words])
"""


def test_results_are_read_drawn_and_viewed_without_petsc_and_mpi(tmp_path, project):
    results_writer.write(tmp_path / "run", MPI.COMM_SELF)
    place, case = tmp_path / "out", project / "cases" / "bar_tension"
    command = [sys.executable, "-c", READER, tmp_path / "run", case, place]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, cwd=tmp_path, timeout=240)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert float(lines[0]) == -0.1
    assert lines[1] == load_case(case).spec.title
    assert lines[-1] == "[0, 0, 0, 0, 4]"
    assert {file.name for file in place.iterdir()} >= {"probes.png", "run.png", "case.png"}
    errors = [line for line in done.stderr.splitlines() if line.startswith("error")]
    assert len(errors) == 1
    for words in (
        "ancf run: the Python package ",
        "mpi4py, petsc4py, slepc4py",
        "scripts/setup",
        "environment.yml",
    ):
        assert words in errors[0]


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ModuleNotFoundError("No module named 'h5py'", name="h5py"), "h5py is missing in .*: python -m pip install h5py"),
        (
            ImportError("libmpi.so.40: cannot open shared object file", name="mpi4py.MPI"),
            "mpi4py cannot be loaded: libmpi.so.40: cannot .*; computing needs mpi4py",
        ),
        (ImportError("Numba needs NumPy 2.0 or less"), "a Python package cannot be loaded: Numba needs .* pyproject.toml"),
    ],
)  # fmt: skip
def test_a_package_that_cannot_be_imported_is_named_with_its_cure(error, words, monkeypatch, capsys):
    def fail(arguments):
        raise error

    monkeypatch.setattr("ancf_petsc.cli.mesh.execute", fail)
    assert cli.main(["mesh", "cube"]) == 4
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    with pytest.raises(EnvironmentProblem, match=f"ancf mesh: .*{words}"):
        raise import_problem(error, "mesh")


def test_a_fault_of_the_program_is_no_missing_package(monkeypatch):
    def fail(arguments):
        from ancf_petsc.axes import nothing_of_this_name  # noqa: F401

    monkeypatch.setattr("ancf_petsc.cli.mesh.execute", fail)
    with pytest.raises(ImportError, match="nothing_of_this_name"):
        cli.main(["mesh", "cube"])


def test_a_petsc_without_mumps_is_refused_unless_an_option_chooses_another_solver(tmp_path, monkeypatch):
    monkeypatch.setattr("ancf_petsc.solve.petsc.has_package", lambda name: name != "mumps")
    spec = block("", 1e-3)
    spec["mesh"] = {"body": "pvc_block", "divisions": [1, 2, 4], "element": "3413"}
    case = case_from_dict(spec, tmp_path)
    with pytest.raises(EnvironmentProblem, match="without MUMPS.*conda-forge.*ksp_type cg -pc_type gamg"):
        run_case(case, tmp_path / "run")
    with petsc_options({"pc_factor_mat_solver_type": "petsc"}):
        assert direct_package() == "mumps"
        with pytest.raises(EnvironmentProblem, match="without MUMPS"):
            direct_package("modes_st_")


@pytest.mark.parametrize("numbers", [np.complex128, np.float32])
def test_a_petsc_of_other_numbers_is_refused(numbers, monkeypatch):
    monkeypatch.setattr(PETSc, "ScalarType", numbers)
    with (
        pytest.raises(EnvironmentProblem, match=f"computes with {np.dtype(numbers)}.*float64"),
        petsc_options({}),
    ):
        pass


def test_a_wheel_holds_all_that_the_program_needs(project):
    """setuptools puts modules into it and nothing else, so that nothing else may lie in the package."""
    files = [file for file in (project / "ancf_petsc").rglob("*") if file.is_file() and file.suffix != ".pyc"]
    assert [file for file in files if file.suffix != ".py"] == []


OF_CONDA = {"matplotlib": "matplotlib-base"}
"""What conda-forge has under another name."""


def test_the_environment_of_conda_has_every_requirement(project):
    """Of the same smallest version at least: pip, which scripts/setup calls in it, then has nothing to replace."""
    data = tomllib.loads((project / "pyproject.toml").read_text())["project"]
    extras = data["optional-dependencies"]
    asked = [Requirement(line) for line in (*data["dependencies"], *extras["solvers"], *extras["dev"])]
    lines = (project / "environment.yml").read_text().partition("dependencies:\n")[2].splitlines()
    given = {}
    for line in lines:
        name, sign, version = line.removeprefix("  - ").partition(">=")
        given[name] = re.split("[,=]", version)[0] if sign else "0"
    for requirement in asked:
        if requirement.marker is not None and not requirement.marker.evaluate(
            {"python_version": given["python"]}
        ):
            continue
        name = OF_CONDA.get(requirement.name.lower(), requirement.name.lower())
        assert name in given, name
        low = max(
            (Version(one.version) for one in requirement.specifier if one.operator == ">="),
            default=Version("0"),
        )
        assert Version(given[name]) >= low, name


class Scalar(float):
    """A number of numpy 2, whichever numpy there is."""

    def __repr__(self):
        return f"np.float64({float(self)})"

    def tolist(self):
        return float(self)


def test_numbers_of_numpy_stand_in_case_files_and_messages_as_numbers():
    for number in (Scalar(0.5), np.float64(0.5)):
        assert str(CaseError("wrong", got=number)) == "wrong: found 0.5"
        assert str(CaseError("wrong", got=[number, 1])) == "wrong: found [0.5, 1]"
        assert toml.value_text({"z": [number, np.int64(2)]}) == "{ z = [0.5, 2] }"
    assert toml.value_text(np.bool_(True)) == "true"
    assert str(CaseError("wrong", got=(np.int64(3), "a"))) == "wrong: found (3, 'a')"
