"""Studies of tiny bodies for the tests, and their runs within the process of the tests."""

from __future__ import annotations

import csv
from pathlib import Path

from ancf_petsc.cli import main
from ancf_petsc.studies.process import run_words

CASE = """
title = "Short cantilever"
[mesh]
body = "cantilever"
divisions = [2, 1, 1]
element = "3413"
[material]
law = "svk"
young = 1e7
poisson = 0.3
density = 1000.0
[[constraint]]
group = "clamp"
fix = ["x", "y", "z"]
[[constraint]]
group = "end"
move = { z = -0.05 }
[statics]
steps = 2
[output]
curve = { force = "end.z", stroke = "end.z" }
[[probe]]
name = "tip"
group = "end"
"""
STUDY = """
title = "Elements"
case = "case.toml"
[vary]
"mesh.element" = ["3413", "3-10-1-3"]
"mesh.divisions" = [[2, 1, 1], [4, 1, 1], [8, 1, 1]]
[quantity]
force = { column = "force", at = { stroke = 0.025 } }
energy = { column = "strain_energy", at = "end" }
[reference]
force = "richardson"
energy = "finest"
"""
CHANGING = ("solve_seconds", "total_seconds", "seconds_alone", "memory_peak_bytes")
"""Columns of study.csv that differ from one repetition to the next."""


def write(folder: Path, study: str = STUDY, case: str = CASE) -> Path:
    """A study file beside its case."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.toml").write_text(case)
    (folder / "study.toml").write_text(study)
    return folder / "study.toml"


class InProcess:
    """Stands for `studies.process.Process`: the same command line, in the process of the tests, done when it begins."""

    commands: list[list[str]] = []

    def __init__(self, run, case_file: Path, folder: Path, ranks: int) -> None:
        self.run, self.folder, self.seconds = run, folder, 0.1
        words = run_words(run, case_file, folder)
        self.commands.append(words)
        self._code = main(words)

    def code(self) -> int:
        return self._code

    def reason(self) -> str:
        return "the reason"

    def ask_to_stop(self) -> None: ...

    def end(self, patience: float = 0.0) -> None: ...


def table(folder: Path) -> list[dict[str, str]]:
    """Rows of a study.csv."""
    with (folder / "study.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def lasting(folder: Path) -> list[dict[str, str]]:
    """Rows of a study.csv without what differs from one repetition to the next."""
    return [{name: cell for name, cell in row.items() if name not in CHANGING} for row in table(folder)]
