"""A study that is interrupted, killed and started again ends with the table of one left alone: with real processes."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest
from tiny_studies import STUDY, InProcess, lasting, write

from ancf_petsc.studies import runner
from ancf_petsc.studies.study import Options, run_study

FOUR = STUDY.replace("[2, 1, 1], [4, 1, 1], [8, 1, 1]", "[2, 1, 1], [4, 1, 1]")


def begin(file, out, environment, *words):
    command = [sys.executable, "-m", "ancf_petsc", "study", str(file), "--out", str(out), "--quiet", *words]
    return subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)


def ended_runs(out):
    return len(list(out.glob("runs/*/summary.json")))


def wait_until(condition, seconds=60.0):
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit, "it did not happen"
        time.sleep(0.02)


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """The table of a study that nobody disturbed, its runs within this process."""
    with monkeypatch.context() as patch:
        patch.setattr(runner, "Process", InProcess)
        run_study(write(tmp_path, FOUR), tmp_path / "alone", Options(jobs=1))
    return lasting(tmp_path / "alone")


def test_interrupted_then_killed_then_finished(alone, environment, tmp_path):
    file, out = write(tmp_path, FOUR), tmp_path / "out"
    process = begin(file, out, environment, "--jobs", "1")
    wait_until(lambda: ended_runs(out) >= 1)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    if process.returncode:  # else the signal came after the end
        assert process.returncode == 130
        assert "the same command goes on" in said
    assert not list(out.glob("runs/*/running.json"))  # no run was left behind
    process = begin(file, out, environment, "--jobs", "2")
    wait_until(
        lambda: list(out.glob("runs/*/running.json")) or ended_runs(out) == 4 or process.poll() is not None
    )
    process.kill()  # what it started goes on, and is waited for by the next
    process.communicate(timeout=60)
    process = begin(file, out, environment, "--jobs", "2")
    assert process.communicate(timeout=120)[1] == ""
    assert process.returncode == 0
    assert lasting(out) == alone


def test_two_halves_at_once(alone, environment, tmp_path):
    file, out = write(tmp_path, FOUR), tmp_path / "out"
    halves = [begin(file, out, environment, "--only", f"{k}/2", "--jobs", "1") for k in (1, 2)]
    assert [process.wait(120) for process in halves] == [0, 0]
    assert lasting(out) == alone


def test_runs_on_two_ranks(environment, tmp_path):
    one = FOUR.replace(', "3-10-1-3"', "").replace("[2, 1, 1], [4, 1, 1]", "[2, 1, 1]")
    file = write(tmp_path, one)
    process = begin(file, tmp_path / "out", environment, "--ranks", "2")
    assert process.wait(120) == 0
    (row,) = lasting(tmp_path / "out")
    assert (row["status"], row["ranks"]) == ("done", "2")
    assert float(row["force"]) < 0
