"""Runs that end at their checkpoints, for tests of going on from there, and what two runs differ by."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ancf_petsc import AncfError, case_from_dict, run
from ancf_petsc.analysis.checkpoint import Checkpoints
from ancf_petsc.input.load import Case
from ancf_petsc.results.mark import MARK

TABLES = ("curve.csv", "probes.csv", "results.xdmf")


FACTS = ("status", "end", "cuts", "step_control", "critical_points", "doubts", "iterations", "steps", "final")


@contextmanager
def snapshots(into: Path) -> Iterator[list[Path]]:
    """Copies of the folder of a run as it is just after each checkpoint, in `into`: as a kill there would leave it."""
    found: list[Path] = []
    original = Checkpoints.save

    def save(self: Checkpoints, what: Any) -> None:
        original(self, what)
        if self.comm.rank == 0:
            found.append(into / f"at_{self.history.number}")
            shutil.copytree(self.folder, found[-1], ignore=shutil.ignore_patterns(MARK))

    Checkpoints.save = save  # type: ignore[method-assign]
    try:
        yield found
    finally:
        Checkpoints.save = original  # type: ignore[method-assign]


def followed(case: Case, folder: Path, **how: Any) -> str:
    """Run a case; the words of the error it ends with, if it does."""
    try:
        run(case, folder, **how)
    except AncfError as error:
        return str(error)
    return ""


def with_checkpoints(data: dict[str, Any], every: str) -> Case:
    """A case of a table with output.checkpoint."""
    output = {**data.get("output", {}), "checkpoint": every}
    return case_from_dict({**data, "output": output}, ".")


def fields(folder: Path) -> dict[str, np.ndarray]:
    """All datasets of results.h5, and the times of its steps."""
    found: dict[str, np.ndarray] = {}
    with h5py.File(folder / "results.h5", "r", locking=False) as file:
        file.visititems(
            lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
        )
        found["times"] = np.array([step.attrs["time"] for step in file["steps"].values()])
    return found


def differences(one: Path, other: Path) -> list[str]:
    """Names of the files, fields and facts of the summary in which two runs are not the same, bit by bit."""
    wrong = [
        name
        for name in TABLES
        if (one / name).exists() and (one / name).read_bytes() != (other / name).read_bytes()
    ]
    said = [json.loads((folder / "summary.json").read_text()) for folder in (one, other)]
    wrong += [name for name in FACTS if said[0].get(name) != said[1].get(name)]
    first, second = fields(one), fields(other)
    if first.keys() != second.keys():
        return [*wrong, "names of fields"]
    return wrong + [name for name in first if not np.array_equal(first[name], second[name])]


def largest_difference(one: Path, other: Path) -> float:
    """Of the fields of two runs, over the largest number of each field; inf where they have not the same steps."""
    first, second = fields(one), fields(other)
    if first.keys() != second.keys() or len(first["times"]) != len(second["times"]):
        return float("inf")
    return max(
        float(np.abs(first[name] - second[name]).max() / max(np.abs(first[name]).max(), 1e-300))
        for name in first
        if first[name].dtype.kind == "f" and first[name].size
    )
