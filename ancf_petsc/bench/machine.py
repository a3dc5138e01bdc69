"""What a benchmark's numbers depend on beside the machine: the checkout's commit, and when."""

from __future__ import annotations

import subprocess
from datetime import UTC, datetime

from ancf_petsc.analysis.host.machine import machine, processor
from ancf_petsc.bench.meshes import PROJECT

__all__ = ["commit", "machine", "now", "processor"]


def commit() -> str:
    """The checkout's commit, with a plus where files differ from it; empty outside a checkout."""
    try:
        found = _git("rev-parse", "--short=12", "HEAD")
        changed = _git("status", "--porcelain", "--untracked-files=no", "--", "ancf_petsc")
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f"{found}{'+' * bool(changed)}"


def _git(*words: str) -> str:
    command = ["git", "-C", str(PROJECT), *words]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def now() -> str:
    """The date and time, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")
