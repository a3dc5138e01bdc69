"""One run of a study as processes of their own: `ancf run` with the changes as --set, on one rank or under mpiexec."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from ancf_petsc.errors import CaseError
from ancf_petsc.input import toml
from ancf_petsc.input.overrides import remove_value, set_value, split_path
from ancf_petsc.launcher import environment, on_ranks
from ancf_petsc.studies.runs import REMOVED, StudyRun

PATIENCE = 5.0
"""Seconds that a run has for a clean end when the study is interrupted; afterwards it is killed."""
TAIL = 4000
"""Bytes of what a run said on stderr that are looked at for its reason."""


class Process:
    """A run that goes on. folder: where its results go. ranks: how many."""

    def __init__(self, run: StudyRun, case_file: Path, folder: Path, ranks: int) -> None:
        self.run, self.folder = run, folder
        words = run_words(run, case_file, folder)
        command = on_ranks(ranks, [sys.executable, "-m", "ancf_petsc", *words])
        self._said = tempfile.TemporaryFile()  # noqa: SIM115
        self.begun = time.monotonic()
        # A group of its own: Ctrl-C on the terminal reaches the study, which ends its runs itself.
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
            env=environment(),
            start_new_session=True,
        )

    @property
    def seconds(self) -> float:
        """Since its start."""
        return time.monotonic() - self.begun

    def code(self) -> int | None:
        """The exit code, None while it goes on."""
        return self._process.poll()

    def reason(self) -> str:
        """The last line of what it said, its error message as a rule."""
        self._said.seek(0, os.SEEK_END)
        self._said.seek(max(0, self._said.tell() - TAIL))
        lines = self._said.read().decode(errors="replace").splitlines()
        errors = [line for line in lines if line.startswith("error: ")]
        last = errors[-1].removeprefix("error: ") if errors else next((x for x in reversed(lines) if x), "")
        return last or f"ended with exit code {self._process.returncode}"

    def ask_to_stop(self) -> None:
        """A signal to the run, and to all its ranks: it ends after the step it is in."""
        self._signal(signal.SIGTERM)

    def end(self, patience: float = PATIENCE) -> None:
        """Wait for its end, and kill it when it takes too long."""
        try:
            self._process.wait(max(0.0, patience))
        except subprocess.TimeoutExpired:
            self._signal(signal.SIGKILL)
            self._process.wait()
        self._said.close()

    def _signal(self, number: int) -> None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, number)


def run_words(run: StudyRun, case_file: Path, folder: Path) -> list[str]:
    """What follows `ancf` on the command line of a run; a person repeats the run with it."""
    return ["run", str(case_file), *_settings(run), "--out", str(folder), "--quiet"]


def _settings(run: StudyRun) -> list[str]:
    """The changes as words of the command line; keys that are not there need no removal."""
    words = []
    data: dict[str, Any] = toml.parse(run.base_text)
    for path, value in run.changes:
        keys, _ = split_path(path)
        if value == REMOVED:
            with suppress(CaseError):
                remove_value(data, keys)
                words.append(f"{path}=")
        else:
            set_value(data, keys, value)
            words.append(f"{path}={toml.value_text(value)}")
    return ["--set", *words] if words else []


class OtherLoad:
    """What others take of the machine while a run goes on (Linux): whether the run's cores were its own."""

    SPARE = 0.25
    """Of a core, that others may take more than what the run leaves them."""

    def __init__(self) -> None:
        self._begun, self._before = time.monotonic(), _busy()

    def left_alone(self, own: float, ranks: int) -> bool:
        """Whether other processes found room beside the run. own: seconds of processor time of the run itself."""
        now, spent = _busy(), time.monotonic() - self._begun
        if self._before is None or now is None or spent <= 0.0:
            return True
        others = (now[0] - self._before[0] - own) / spent
        return others <= max(0, now[1] - ranks) + self.SPARE


def _busy() -> tuple[float, int] | None:
    """Seconds that all cores have worked since the system's start, and how many cores there are."""
    try:
        lines = Path("/proc/stat").read_text().splitlines()
    except OSError:
        return None
    counts = [int(word) for word in lines[0].split()[1:]]
    idle = sum(counts[3:5])  # and waiting for input and output
    guests = sum(counts[8:10])  # which user and nice hold already
    cores = sum(line.startswith("cpu") for line in lines) - 1
    return (sum(counts) - idle - guests) / os.sysconf("SC_CLK_TCK"), cores
