"""What is known from elsewhere, laid over the curves of runs: tables of curves, and single values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ancf_petsc.errors import CaseError
from ancf_petsc.results.reader import Columns, Results
from ancf_petsc.results.tables import read_table

ABSCISSAS = ("time", "pseudo_time", "stroke")


@dataclass(frozen=True)
class ReferenceCurve:
    """A table that figures draw beside runs, as one more run, where its columns have the runs' names."""

    title: str
    folder: Path
    units: str
    curve: Columns
    note: str = ""

    @property
    def probes(self) -> Columns:
        return self.curve


@dataclass(frozen=True)
class Level:
    """A value to be drawn across the axes."""

    label: str
    value: float


def read_reference(path: Path, beside: Results) -> ReferenceCurve:
    """The CSV table in `path`, its numbers in the units of the run it is drawn beside."""
    table = read_table(path)
    abscissas = [name for name in ABSCISSAS if name in table]
    known = [name for name in table if name in {*beside.curve, *beside.probes} and name not in abscissas]
    if not (abscissas and known):
        raise CaseError(
            "no curve to lay over the run",
            file=path,
            got=f"columns {', '.join(table)}",
            expected=f"{' or '.join(ABSCISSAS)}, and names of columns of the run's curve.csv or probes.csv",
        )
    return ReferenceCurve(path.stem, path, beside.units, table)


def read_level(text: str) -> Level:
    """A level written LABEL=VALUE."""
    label, _, value = text.rpartition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not (label and math.isfinite(number)):
        raise CaseError(key="--level", got=text, expected='LABEL=NUMBER, as in "Abaqus, 5000 C3D8=-0.069"')
    return Level(label, number)
