"""How a run ended, from its folder and the study's record of it."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ancf_petsc.errors import CaseError, EnvironmentProblem, Interrupted, NoEquilibrium

FINAL_CODES = (0, NoEquilibrium.exit_code)
PASSING = ("", "environment", "interrupted")
"""Kinds of ends that another attempt may not have."""
OUTCOMES = {CaseError.exit_code: "wrong_input", EnvironmentProblem.exit_code: "crashed"}


@dataclass(frozen=True)
class RunEnd:
    """status: "done" or "failed"; outcome: a short name; reason: one line, "" where all went well.

    summary: of summary.json, empty where the run left none. final: whether another attempt would end alike.
    """

    status: str
    outcome: str
    reason: str
    summary: dict[str, Any]
    final: bool


def read_end(folder: Path, identity: str, version: str, record: dict[str, Any]) -> RunEnd | None:
    """How the run in a folder ended; None where it has not run, was interrupted or goes on.

    identity: hash of the case and mesh it has to be of; version: of the program.
    """
    code, reason = record.get("code"), str(record.get("reason", ""))
    summary = summary_of(folder)
    ours = summary.get("hash") == identity and summary.get("versions", {}).get("ancf_petsc") == version
    status = summary.get("status") if ours else None
    end = summary.get("end", {}) if ours else {}
    kind = str(end.get("kind", "")) if isinstance(end, dict) else ""
    if status == "done" and code in (None, 0):
        cut = bool(summary.get("cuts"))
        return RunEnd("done", "cut_steps" if cut else kind or "reached", "", summary, final=True)
    if code == Interrupted.exit_code or status == "interrupted":
        return None
    if status == "stopped" and (code in FINAL_CODES or code is None and kind not in PASSING):
        said = one_line(str(end.get("message") or summary.get("reason") or reason))
        return RunEnd("failed", kind or "stopped", said, summary, final=True)
    if code is None or code == 0:
        return None
    outcome = "timeout" if record.get("timeout") else OUTCOMES.get(code, "crashed")
    return RunEnd(
        "failed", outcome, one_line(reason), summary if ours else {}, final=outcome == "wrong_input"
    )


def summary_of(folder: Path) -> dict[str, Any]:
    """summary.json of a run's folder, empty where there is none."""
    with suppress(OSError, ValueError):
        found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        if isinstance(found, dict):
            return found
    return {}


def one_line(text: str) -> str:
    """A text without line breaks."""
    return " ".join(text.split())
