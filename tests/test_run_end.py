"""How a run ended, in a form that programs read: `end`, `cuts` and `step_control` of summary.json, statics and motion."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import Any

import pytest
from motion_cases import pendulum
from statics_cases import block

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import AncfError

PROJECT = Path(__file__).resolve().parent.parent


def summary_of(data: dict[str, Any], folder: Path, **more: Any) -> dict[str, Any]:
    """Of a run, however it ends."""
    said = ""
    try:
        run_case(case_from_dict(data, PROJECT), folder / "run", **more)
    except AncfError as error:
        said = str(error)
    summary = json.loads((folder / "run" / "summary.json").read_text())
    assert summary["end"]["message"] == (said or "the end was reached")
    assert "\n" not in summary["end"]["message"]
    return summary


def test_a_path_that_reached_its_end(tmp_path):
    """With the weakest element of the last state."""
    summary = summary_of(block("pvc_block_234.msh", 0.005, steps=1), tmp_path)
    end = summary["end"]
    assert (summary["status"], end["kind"], end["pseudo_time"]) == ("done", "reached", 1.0)
    assert 0.7 < end["smallest_stretch"] < 0.95
    assert isinstance(end["element"], int)
    assert len(end["place"]) == 3


def test_each_cut_is_there_with_its_reason(tmp_path):
    """A bar pressed to nothing fails: halved from the first step to the smallest, with size and place of each."""
    data = block("pvc_block_234.msh", 0.15, steps=1, smallest_step=0.01)
    summary = summary_of(data, tmp_path)
    assert summary["status"] == "stopped"
    cuts = [entry for entry in summary["step_control"] if entry["action"] in ("halved", "shortened")]
    assert len(cuts) == summary["cuts"] > 2
    assert all(entry["reason"] and 0.0 <= entry["pseudo_time"] < 1.0 for entry in cuts)
    assert all(entry["size"] >= 0.01 for entry in cuts)
    assert summary["step_control_left_out"] == 0


MOTION = {"duration": 0.1, "outputs": 2}


def test_a_motion_that_reached_its_end_and_the_steps_it_rejected(tmp_path):
    data = pendulum({**MOTION, "integrator": "rosenbrock", "tolerance": 1e-6})
    summary = summary_of(data, tmp_path)
    assert (summary["end"]["kind"], summary["end"]["time"]) == ("reached", 0.1)
    assert summary["end"]["smallest_stretch"] == pytest.approx(1.0, abs=0.1)
    assert summary["cuts"] == sum(entry.get("count", 1) for entry in summary["step_control"])


def test_an_explicit_step_beyond_the_stable_one_is_too_long(tmp_path):
    dynamics = {"duration": 1.0, "outputs": 50, "integrator": "runge_kutta_5dp", "step": 1e-3}
    summary = summary_of(pendulum(dynamics), tmp_path)
    assert (summary["status"], summary["end"]["kind"]) == ("stopped", "step_too_long")
    assert summary["end"]["time"] < 1.0


def test_an_interrupted_motion_says_so(tmp_path):
    def watch(done: float) -> None:
        if done > 0.5:
            os.kill(os.getpid(), signal.SIGTERM)

    data = pendulum({**MOTION, "step": 0.01, "integrator": "theta"})
    summary = summary_of(data, tmp_path, watch=watch)
    assert (summary["status"], summary["end"]["kind"]) == ("interrupted", "interrupted")
    assert summary["end"]["time"] == pytest.approx(0.06)
