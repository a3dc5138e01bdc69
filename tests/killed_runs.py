"""Runs that are killed at random moments, and power cuts simulated, until one comes to its end."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from restart_cases import followed

from ancf_petsc.input.load import Case
from ancf_petsc.results.checkpoint_file import NAMES, all_in

GROWING = ("curve.csv", "probes.csv", "results.xdmf", "log.txt")


def alone(case: Case, folder: Path) -> int:
    """Start `run --restart` in a process of its own, a copy of this one; its number."""
    process = os.fork()
    if process:
        return process
    try:
        os._exit(1 if followed(case, folder, restart=True) else 0)
    finally:
        os._exit(1)


def killed_alone(case: Case, folder: Path, after: float) -> bool:
    """Kill such a run after some seconds; False where it was quicker. Raises AssertionError where it failed."""
    process = alone(case, folder)
    end = time.monotonic() + after
    while time.monotonic() < end:
        done, status = os.waitpid(process, os.WNOHANG)
        if done:
            assert status == 0, f"the run ended with {status}"
            return False
        time.sleep(min(0.002, after))
    os.kill(process, signal.SIGKILL)
    _, status = os.waitpid(process, 0)
    assert status in (0, signal.SIGKILL), f"the run ended with {status}"
    return status != 0


def killed_on_ranks(
    case_file: Path,
    folder: Path,
    ranks: int,
    after: float,
    dice: random.Random,
    environment: Mapping[str, str],
) -> bool:
    """Kill one rank, or all, of a run under mpiexec some seconds after its folder was marked; False where it was quicker."""
    words = ["run", str(case_file), "--restart", "--out", str(folder), "--quiet"]
    command = ["mpiexec", "-n", str(ranks), sys.executable, "-m", "ancf_petsc", *words]
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        while process.poll() is None and not (folder / "running.json").exists():
            time.sleep(0.01)
        end = time.monotonic() + after
        while process.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        if process.poll() is None:
            children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            for number in children if dice.random() < 0.5 else [dice.choice(children)]:
                os.kill(int(number), signal.SIGKILL)
        _, said = process.communicate()
    assert process.returncode == 0 or "error:" not in said, said
    return process.returncode != 0


def cut_power(folder: Path, dice: random.Random) -> str:
    """Lose what the disk had not promised to keep: ends of growing files, and perhaps the newest checkpoint or its rename. What
    was lost, in words.
    """
    if is_done(folder):
        return "nothing: the run was done"
    whole, _ = all_in(folder) if folder.is_dir() else ([], {})
    lost = ""
    if len(whole) == 2 and dice.random() < 0.5:
        newest = whole.pop(0).path
        lost = dice.choice(("cut", "rename"))
        if lost == "cut":
            os.truncate(newest, dice.randrange(newest.stat().st_size))
        else:
            newest.rename(newest.with_name("checkpoint_lost.part"))
    for name in GROWING:
        if (folder / name).exists():
            os.truncate(folder / name, dice.randrange((folder / name).stat().st_size + 1))
    results = folder / "results.h5"
    if results.exists():
        promised = whole[0].about["files"]["size"] if whole else 0
        size = results.stat().st_size
        os.truncate(results, dice.randrange(min(promised, size), size + 1))
    return f"power cut, newest checkpoint {lost}" if lost else "power cut"


def is_done(folder: Path) -> bool:
    """Whether a run says that it came to its end: all of it is on the disk then."""
    try:
        return json.loads((folder / "summary.json").read_text())["status"] == "done"
    except OSError:
        return False


def has_checkpoint(folder: Path) -> bool:
    return any((folder / name).exists() for name in NAMES)
