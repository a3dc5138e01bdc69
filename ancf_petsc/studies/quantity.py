"""One number of a run: a column of its tables at an output or reduced over all, or a value of its summary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.results.tables import read_table
from ancf_petsc.studies.columns import SAME, nearest, shown
from ancf_petsc.studies.ending import summary_of
from ancf_petsc.studies.spec import OutputAt, QuantitySpec

Column = NDArray[np.float64]
TIMES = ("time", "pseudo_time")
MEASURES = {
    "max": lambda values, weights: float(np.abs(values).max()),
    "mean": lambda values, weights: float(np.average(np.abs(values), weights=weights)),
    "rms": lambda values, weights: float(np.sqrt(np.average(values**2, weights=weights))),
}
"""Sizes of a series that a difference is measured by."""


@dataclass(frozen=True)
class Tables:
    """Columns (rows,) by name, of a run's folder or of one CSV file. source: where they are from."""

    source: Path

    @cached_property
    def columns(self) -> Mapping[str, Column]:
        """Of curve.csv and probes.csv; empty where there is none."""
        if self.source.suffix.lower() == ".csv":
            return read_table(self.source)
        found: dict[str, Column] = {}
        for name in ("probes.csv", "curve.csv"):
            if (self.source / name).is_file():
                found |= read_table(self.source / name)
        # A run that was killed while it wrote may have a row more in one of them.
        rows = min((len(values) for values in found.values()), default=0)
        return {name: values[:rows] for name, values in found.items()}

    @cached_property
    def summary(self) -> Mapping[str, Any]:
        """Of summary.json."""
        return summary_of(self.source)

    def column(self, name: str) -> Column:
        """A column that has rows. Raises CaseError."""
        if name not in self.columns:
            cure = did_you_mean(name, tuple(self.columns))
            raise CaseError("no such column", file=self.source, got=name, cure=cure)
        if not len(self.columns[name]):
            raise CaseError("there are no outputs", file=self.source)
        return self.columns[name]

    @property
    def times(self) -> Column | None:
        """The column of time or pseudo-time, None where a table has neither."""
        return next((self.columns[name] for name in TIMES if name in self.columns), None)


def value_of(asked: QuantitySpec, tables: Tables, reference: Tables | None = None) -> float:
    """The number asked for. reference: what a series is compared with. Raises CaseError where there is none that is finite."""
    value = _taken(asked, tables, reference)
    if not np.isfinite(value):
        raise CaseError("not a finite number", file=tables.source, got=value, expected="a number")
    return value


def _taken(asked: QuantitySpec, tables: Tables, reference: Tables | None) -> float:
    if asked.summary is not None:
        return _from_summary(asked.summary, tables)
    assert asked.column is not None
    values = tables.column(asked.column)
    if asked.at is not None:
        return float(values[row_of(asked.at, tables)])
    if asked.against:
        assert reference is not None
        return _difference(asked, tables, reference)
    return _reduced(str(asked.reduce), values, _weights(tables.times, len(values)))


def row_of(at: OutputAt, tables: Tables) -> int:
    """Which output a value is taken at. Raises CaseError where there is none at this place."""
    if at.column == "end":
        return -1
    points = tables.column(at.column)
    found = nearest(list(points[1:]), at.value)
    if found is None:
        raise CaseError(
            f"no output at {at.column} {at.value:g}: {shown(at.column, list(points[1:]))}", file=tables.source
        )
    return found + 1


def _from_summary(path: str, tables: Tables) -> float:
    place: Any = tables.summary
    for name in path.split("."):
        known = tuple(place) if isinstance(place, Mapping) else ()
        if name not in known:
            cure = did_you_mean(name, known)
            raise CaseError("no such value", file=tables.source / "summary.json", key=path, cure=cure)
        place = place[name]
    if isinstance(place, bool) or not isinstance(place, int | float):
        raise CaseError(file=tables.source / "summary.json", key=path, got=place, expected="a number")
    return float(place)


def _weights(times: Column | None, count: int) -> Column:
    """Weights (rows,) of the trapezoidal rule over time; all alike where there is no time."""
    if times is None or count < 2:
        return np.ones(count)
    gaps = np.diff(times)
    weights = np.concatenate(([0.0], gaps)) / 2 + np.concatenate((gaps, [0.0])) / 2
    return weights if weights.sum() > 0 else np.ones(count)


def _reduced(how: str, values: Column, weights: Column) -> float:
    if how == "max":
        return float(values.max())
    if how == "min":
        return float(values.min())
    if how == "drift":
        return float(np.abs(values - values[0]).max())
    if how == "mean":
        return float(np.average(values, weights=weights))
    return float(np.sqrt(np.average(values**2, weights=weights)))


def _difference(asked: QuantitySpec, tables: Tables, reference: Tables) -> float:
    """Size of the difference of two series at the times both have, over the size of the reference's."""
    assert asked.column is not None
    ours, theirs = tables.times, reference.times
    if ours is None or theirs is None:
        raise CaseError("no column time or pseudo_time to compare at", file=reference.source)
    span = max(float(ours[-1]), float(theirs[-1]))
    at = np.searchsorted(theirs, ours - SAME * span)
    shared = (at < len(theirs)) & (np.abs(theirs[np.minimum(at, len(theirs) - 1)] - ours) <= SAME * span)
    if np.count_nonzero(shared) < 2:
        raise CaseError(
            "the series have no outputs at the same times",
            file=reference.source,
            expected="a time of the run, beside the start",
            cure="give both the same outputs: nothing is made up between them",
        )
    known = reference.column(asked.column)[at[shared]]
    size, weights = MEASURES[str(asked.reduce)], _weights(ours[shared], int(shared.sum()))
    whole = size(known, weights)
    if whole == 0.0:
        raise CaseError("the reference is zero throughout", file=reference.source, key=asked.column)
    return size(tables.column(asked.column)[shared] - known, weights) / whole
