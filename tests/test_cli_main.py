"""The command `ancf`: verbs, one-line errors, exit codes, alone and under mpiexec."""

import os
import shlex
import subprocess
import sys
import time
import types

import pytest

from ancf_petsc import cli
from ancf_petsc.errors import CaseError, EnvironmentProblem, NoEquilibrium

FEW_RANKS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMP_NUM_THREADS": "1",
}


def ancf(*words, ranks=0, **environment):
    """Run the command in a process of its own, or in several."""
    command = [sys.executable, "-m", "ancf_petsc", *map(str, words)]
    if ranks:
        command = ["mpiexec", "-n", str(ranks), *command]
    return subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, **FEW_RANKS, **environment}, timeout=60
    )


@pytest.fixture
def verb(monkeypatch):
    """A verb made of a function: `verb(function, **attributes)`, called `try` on the command line."""

    def make(execute, **attributes):
        module = types.ModuleType("ancf_test_verb")
        module.HELP = "try something"
        module.add_arguments = lambda parser: parser.add_argument("words", nargs="*")
        module.execute = execute
        vars(module).update(attributes)
        monkeypatch.setitem(sys.modules, "ancf_test_verb", module)
        monkeypatch.setitem(cli.VERBS, "try", ("ancf_test_verb", "try something"))

    return make


def raising(error):
    def execute(arguments):
        raise error

    return execute


def test_help_lists_every_verb_and_is_quick():
    start = time.perf_counter()
    done = ancf("--help")
    seconds = time.perf_counter() - start
    assert done.returncode == 0
    for name, (_, line) in cli.VERBS.items():
        assert f"  {name:<8}{line}" in done.stdout
    assert (
        seconds < 2
    )  # 0.14 s on an idle machine; the bar of 0.3 s is measured by hand, tests may share the machine


def test_help_imports_no_verb():
    heavy = "{'numpy', 'pydantic', 'rich', 'mpi4py', 'ancf_petsc.input'}"
    code = f"import sys; from ancf_petsc.cli import main; main(['--help']); print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.endswith("set()\n")


def test_no_verb_shows_the_help(capsys):
    assert cli.main([]) == 0
    assert "verbs:" in capsys.readouterr().out


def test_version_names_the_package(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("ancf_petsc ")


@pytest.mark.parametrize(
    ("word", "hint"),
    [
        ("rnu", "did you mean 'run'"),
        ("block.toml", "did you mean: ancf run block.toml"),
        ("xyz", "there are: run, check"),
    ],
)
def test_unknown_verbs_get_a_suggestion(word, hint, capsys):
    assert cli.main([word]) == 2
    told = capsys.readouterr()
    assert told.err.startswith("error: ancf: unknown verb")
    assert told.err.count("\n") == 1
    assert hint in told.err
    assert told.out == ""


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (CaseError("wrong", file="case.toml", key="title"), 2),
        (NoEquilibrium("the path ends at s = 0.3"), 3),
        (EnvironmentProblem("no MUMPS"), 4),
        (KeyboardInterrupt(), 130),
        (ModuleNotFoundError("No module named 'petsc4py'", name="petsc4py"), 4),
    ],
)
def test_errors_are_one_line_and_an_exit_code(verb, capsys, error, code):
    verb(raising(error))
    assert cli.main(["try"]) == code
    told = capsys.readouterr().err
    assert told.startswith("error: ")
    assert told.count("\n") == 1


def test_a_traceback_is_shown_on_request(verb, capsys, monkeypatch):
    monkeypatch.setenv("ANCF_TRACEBACK", "1")
    verb(raising(CaseError("wrong")))
    assert cli.main(["try"]) == 2
    assert "Traceback" in capsys.readouterr().err


def test_an_unforeseen_error_is_not_hidden(verb):
    verb(raising(ZeroDivisionError("division")))
    with pytest.raises(ZeroDivisionError):
        cli.main(["try"])


def test_wrong_arguments_are_one_line(verb, capsys):
    verb(lambda arguments: 0)
    assert cli.main(["try", "--fast"]) == 2
    assert capsys.readouterr().err == "error: ancf try: unrecognized arguments: --fast; see ancf try --help\n"


def test_what_follows_two_dashes_are_petsc_options(verb):
    seen = []
    verb(lambda arguments: seen.append((arguments.words, arguments.petsc_options)) or 0, PETSC_OPTIONS=True)
    assert cli.main(["try", "a", "--", "-ksp_type", "cg"]) == 0
    assert cli.main(["try", "a"]) == 0
    assert seen == [(["a"], ["-ksp_type", "cg"]), (["a"], [])]


def test_a_verb_without_petsc_refuses_its_options(verb, capsys):
    verb(lambda arguments: 0)
    assert cli.main(["try", "--", "-ksp_type", "cg"]) == 2
    assert "takes no PETSc options" in capsys.readouterr().err


def test_a_closed_pipe_ends_quietly():
    command = f"{shlex.quote(sys.executable)} -m ancf_petsc --help | true"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    assert done.stderr == ""


def test_under_mpiexec_an_error_is_told_once():
    done = ancf("rnu", ranks=2)
    assert done.returncode == 2
    assert done.stderr.count("error: ") == 1
    assert "Traceback" not in done.stderr


def test_under_mpiexec_the_help_is_printed_once():
    assert ancf("--help", ranks=2).stdout.count("verbs:") == 1


def test_an_unforeseen_error_on_one_rank_ends_the_other(tmp_path):
    """Rank 1 fails while rank 0 waits for it: without an abort this would hang."""
    (tmp_path / "waiting_verb.py").write_text(
        "HELP = 'wait'\n"
        "def add_arguments(parser): pass\n"
        "def execute(arguments):\n"
        "    from mpi4py import MPI\n"
        "    if MPI.COMM_WORLD.rank == 1:\n"
        "        raise ZeroDivisionError('one rank fails')\n"
        "    MPI.COMM_WORLD.Barrier()\n"
    )
    code = "import sys; from ancf_petsc import cli; cli.VERBS['wait'] = ('waiting_verb', '')\n"
    code += "sys.exit(cli.main(['wait']))"
    done = subprocess.run(
        ["mpiexec", "-n", "2", sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, **FEW_RANKS, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
        timeout=60,
    )
    assert done.returncode == 1
    assert "ZeroDivisionError: one rank fails" in done.stderr
