"""The folder of a run: whether a run may have it, what an earlier run left in it, the summary."""

from __future__ import annotations

import json
import math
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.errors import CaseError

RUN_FILES = ("results.h5", "results.xdmf", "curve.csv", "probes.csv", "summary.json", "log.txt")
STATUSES = ("done", "stopped", "interrupted")


def check_folder(path: Path, title: str, *, force: bool = False) -> None:
    """Raise CaseError unless a run of `title` may write into `path`; nothing in it is touched.

    A folder may be new, empty, or hold an earlier run of the same title; `force` allows any other.
    """
    path = Path(path)
    there = _nearest_existing(path)
    if not there.is_dir():
        what = "is a file" if there == path else f"cannot be made: {there} is a file"
        raise CaseError(what, file=path, key="--out", expected="a folder", cure="choose another folder")
    try:
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise CaseError(
            f"cannot be written: {error.strerror or error}",
            file=path,
            key="--out",
            cure="choose a folder you may write to, by --out DIR",
        ) from error
    if force or there != path or not any(path.iterdir()):
        return
    holds = run_title(path)
    if holds != title:
        raise CaseError(
            "the folder is not empty",
            file=path,
            key="--out",
            got=f"a run of {holds!r}" if holds is not None else "files that do not belong to a run",
            expected=f"an empty folder, or a run of {title!r}",
            cure="choose another folder by --out DIR, or overwrite by --force",
        )


def _nearest_existing(path: Path) -> Path:
    there = path.absolute()
    while not os.path.lexists(there):
        there = there.parent
    return path if there == path.absolute() else there


def run_title(path: Path) -> str | None:
    """Title of the run in a folder; None where there is no run."""
    results = Path(path) / "results.h5"
    if results.is_file():
        import h5py

        try:
            with h5py.File(results, "r", locking=False) as file:
                return str(file.attrs["title"])
        except (OSError, KeyError):
            pass  # broken by a crash: the summary may still tell
    try:
        title = json.loads((Path(path) / "summary.json").read_text())["title"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return str(title)


def claim_folder(path: Path) -> None:
    """Make the folder and remove the files of an earlier run; whatever else is in it stays."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        for name in RUN_FILES:
            (path / name).unlink(missing_ok=True)
    except OSError as error:
        raise CaseError(
            f"cannot be written: {error.strerror or error}", file=error.filename or path, key="--out"
        ) from error


def write_atomic(path: Path, text: str) -> None:
    """Replace a file as a whole: a reader sees the old text or the new, never a part."""
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


def write_summary(
    folder: Path,
    *,
    title: str,
    status: str,
    seconds: dict[str, float],
    memory_peak_bytes: list[int],
    nodes: int,
    elements: int,
    dof: int,
    ranks: int,
    iterations: dict[str, int],
    final: dict[str, float],
    versions: dict[str, str],
    **more: Any,
) -> None:
    """seconds: import, read, setup, solve, output, total; memory: per rank; iterations: newton, linear."""
    if status not in STATUSES:
        raise ValueError(f"status {status!r} is none of {STATUSES}")
    summary = {
        "title": title,
        "status": status,
        "seconds": seconds,
        "memory_peak_bytes": memory_peak_bytes,
        "nodes": nodes,
        "elements": elements,
        "dof": dof,
        "ranks": ranks,
        "iterations": iterations,
        "final": final,
        "versions": versions,
        **more,
    }
    write_atomic(Path(folder) / "summary.json", json.dumps(_plain(summary), indent=2, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    """The same in JSON's own types; JSON has no word for nan and infinity: null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | None) else str(value)
