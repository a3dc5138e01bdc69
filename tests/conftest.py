"""Programs started from tests: under mpiexec on several ranks, and the command line as a user types it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from hypothesis import settings

PROJECT = Path(__file__).resolve().parent.parent
Program = Callable[..., subprocess.CompletedProcess[str]]
PATIENCE = float(os.environ.get("ANCF_TEST_PATIENCE", "1"))
"""Times the seconds after which a program counts as hanging: more where machines are slow or shared."""

# The machine's load must not decide whether a test passes.
settings.register_profile("project", deadline=None)
settings.load_profile("project")


MACHINE_CODE = ".pytest_cache/machine_code"


def pytest_configure(config: pytest.Config) -> None:
    """Give the suite a cache for machine code of its own, which two processes fill that know one law each."""
    if "ANCF_CACHE_DIR" in os.environ:  # from whoever runs the suite, or from the main process to its workers
        return
    folder = config.rootpath / MACHINE_CODE
    os.environ["ANCF_CACHE_DIR"] = str(folder)
    if config.args == config.getini("testpaths") and not config.option.collectonly:
        fill(folder)


def fill(folder: Path) -> None:
    """Compile all kernels, each law in a process of its own; what earlier versions left goes."""
    from ancf_petsc.jit import source_hash

    present = folder / "ancf_petsc" / f"kernels-{source_hash()}"
    mark = present / "filled_by_a_process_for_each_law"
    if mark.exists():
        return
    shutil.rmtree(folder / "ancf_petsc", ignore_errors=True)
    environment = os.environ | {"ANCF_CACHE_DIR": str(folder)}
    command = [sys.executable, str(PROJECT / "scripts" / "verify_machine_code"), "--fill"]
    processes = [subprocess.Popen([*command, law], env=environment) for law in ("svk", "neo_hooke")]
    assert [process.wait() for process in processes] == [0, 0]
    mark.touch()


@pytest.fixture(scope="session")
def machine_code(pytestconfig: pytest.Config) -> Path:
    """A cache for machine code that two processes filled, each of which knew one law."""
    folder = pytestconfig.rootpath / MACHINE_CODE
    fill(folder)
    return folder


@pytest.fixture(scope="session")
def project() -> Path:
    """The project's folder."""
    return PROJECT


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """Environment variables as scripts/environment.sh sets them, without what an MPI of this process left."""
    shell = 'source "$0" && env -0'
    command = ["bash", "-c", shell, str(PROJECT / "scripts" / "environment.sh")]
    said = subprocess.run(command, env=dict(os.environ), check=True, capture_output=True, text=True).stdout
    return dict(line.split("=", 1) for line in said.rstrip("\0").split("\0"))


@pytest.fixture
def mpirun(environment: dict[str, str], tmp_path: Path) -> Program:
    """mpirun(n, args, timeout=120, code=0, cwd=tmp_path): this Python with `args` on n ranks.

    Returns the completed process with stdout and stderr as text. Fails the test, with all that was printed,
    on another exit code than `code` (None: any) or when it takes longer than `timeout` seconds.
    """

    def run(
        n: int, args: Sequence[str | Path], timeout: float = 120, code: int | None = 0, cwd: Path = tmp_path
    ) -> subprocess.CompletedProcess[str]:
        return _run(["mpiexec", "-n", str(n), sys.executable, *args], environment, timeout, code, cwd)

    return run


@pytest.fixture(scope="session")
def on_three_ranks(environment: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Program:
    """on_three_ranks(*args, timeout=120): `mpirun` on three ranks for fixtures of a module; a rank that fails ends the others."""
    folder = tmp_path_factory.mktemp("ranks")

    def run(*args: str | Path, timeout: float = 120) -> subprocess.CompletedProcess[str]:
        command = ["mpiexec", "-n", "3", sys.executable, "-m", "mpi4py", *args]
        return _run(command, environment, timeout, 0, folder)

    return run


@pytest.fixture
def ancf(environment: dict[str, str], tmp_path: Path) -> Program:
    """ancf(*args, ranks=None, timeout=120, code=0, cwd=tmp_path): the command line in a process of its own.

    ranks: under mpiexec with that many; None: without mpiexec. Else as `mpirun`.
    """

    def run(
        *args: str | Path,
        ranks: int | None = None,
        timeout: float = 120,
        code: int | None = 0,
        cwd: Path = tmp_path,
    ) -> subprocess.CompletedProcess[str]:
        launcher = [] if ranks is None else ["mpiexec", "-n", str(ranks)]
        program = [sys.executable, "-m", "ancf_petsc", *args]
        return _run([*launcher, *program], environment, timeout, code, cwd)

    return run


def _run(
    command: Sequence[str | Path], environment: dict[str, str], timeout: float, code: int | None, cwd: Path
) -> subprocess.CompletedProcess[str]:
    words = [str(word) for word in command]
    with subprocess.Popen(
        words,
        cwd=cwd,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            out, err = process.communicate(timeout=timeout * PATIENCE)
            problem = None if code in (None, process.returncode) else f"expected exit code {code}"
        except subprocess.TimeoutExpired:
            out, err = _stop(process)
            problem = f"not done after {timeout * PATIENCE:g} s"
    if problem:
        shown = f"{' '.join(words)}\nexit code {process.returncode}, {problem}"
        pytest.fail(f"{shown}\n--- stdout\n{out}\n--- stderr\n{err}", pytrace=False)
    return subprocess.CompletedProcess(words, process.returncode, out, err)


def _stop(process: subprocess.Popen[str]) -> tuple[str, str]:
    """End a program that hangs and return what it printed. mpiexec ends its ranks when asked politely."""
    process.terminate()
    try:
        return process.communicate(timeout=10)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.communicate()
