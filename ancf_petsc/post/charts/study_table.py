"""A study as its folder holds it: study.csv, study.json and the tables of its runs."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ancf_petsc.errors import CaseError
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.units import Units, read_units

TABLE, FACTS = "study.csv", "study.json"
NEEDED = ("status", "outcome", "run")
NOT_RUN = "not_run"
"""Outcome of runs that are still to come, or that another share of the study does."""
ENDED = ("reached", "cut_steps", "energy_grown")
"""Outcomes of runs that came to the end that was asked for."""


@dataclass(frozen=True)
class StudyRow:
    """One run. cells: what study.csv says, as text, by column; empty where it is not known."""

    cells: Mapping[str, str]

    def text(self, column: str) -> str:
        return self.cells.get(column, "")

    def number(self, column: str) -> float:
        """nan where there is none."""
        try:
            return float(self.cells.get(column, ""))
        except ValueError:
            return float("nan")

    @property
    def outcome(self) -> str:
        return self.text("outcome") or self.text("status")

    @property
    def ended(self) -> bool:
        """Whether the run came to its end."""
        return self.outcome in ENDED or (self.outcome == self.text("status") == "done")

    @property
    def alone(self) -> bool:
        """Whether the run had the machine's cores to itself."""
        return self.text("seconds_alone").lower() in ("true", "1")


@dataclass(frozen=True)
class StudyTable:
    """keys: values of each varied key in the order of the study. quantities, orders: as in study.json; facts: all of it."""

    folder: Path
    title: str
    units: Units
    keys: dict[str, list[Any]]
    rows: list[StudyRow]
    quantities: dict[str, dict[str, Any]] = field(default_factory=dict)
    orders: list[dict[str, Any]] = field(default_factory=list)
    charts: list[ChartSpec] = field(default_factory=list)
    note: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)

    def is_numeric(self, key: str) -> bool:
        """Whether all values of a key or column are numbers; a code such as 3413, in quotes in the study, is none."""
        if key in self.keys:
            return all(_is_number(value) for value in self.keys[key])
        return any(row.number(key) == row.number(key) for row in self.rows)

    def values(self, key: str) -> list[str]:
        """The different values of a key in study.csv: numbers ascending, others as they first appear.

        The empty text, a key that is taken away, is a value where the study varies it.
        """
        removed = any(value in ("", None) for value in self.keys.get(key, ()))
        found = list(dict.fromkeys(row.text(key) for row in self.rows if row.text(key) or removed))
        return sorted(found, key=float) if self.is_numeric(key) and all(map(_reads, found)) else found

    def reference(self, quantity: str) -> Mapping[str, Any]:
        return self.quantities.get(quantity, {}).get("reference") or {}


def is_study(folder: Path) -> bool:
    """Whether `ancf study` has written a table here."""
    return (folder / FACTS).is_file() or (folder / TABLE).is_file()


def read_study(folder: str | Path) -> StudyTable:
    """The study in a folder. Raises CaseError where there is none, or its files are not of this kind."""
    folder = Path(folder)
    facts, rows = _facts(folder / FACTS), _rows(folder / TABLE)
    try:
        keys = {axis["key"]: list(axis["values"]) for axis in facts["axes"]}
        quantities, orders = dict(facts["quantities"]), list(facts.get("orders", ()))
        charts = [_chart(table, k, folder / FACTS) for k, table in enumerate(facts.get("charts") or ())]
        title = str(facts["title"])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise CaseError(
            f"not the facts of a study: {type(error).__name__}: {error}",
            file=folder / FACTS,
            expected="title, axes, quantities and charts",
            cure="run ancf study again: finished runs are not repeated",
        ) from error
    units, note = read_units(str(facts.get("units") or "")), str(facts.get("note") or "")
    return StudyTable(folder, title, units, keys, rows, quantities, orders, charts, note, facts)


def _facts(path: Path) -> dict[str, Any]:
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        cure = "ancf study STUDY.toml writes one"
        raise CaseError(
            "no study here", file=path.parent, expected=f"{TABLE} and {FACTS}", cure=cure
        ) from error
    except (OSError, ValueError) as error:
        cure = "run ancf study again: finished runs are not repeated"
        raise CaseError(f"cannot be read: {error}", file=path, cure=cure) from error
    if not isinstance(facts, dict):
        raise CaseError(file=path, got=type(facts).__name__, expected="an object")
    return facts


def _rows(path: Path) -> list[StudyRow]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            rows = [StudyRow({k: v or "" for k, v in row.items() if k is not None}) for row in reader]
            rows = [row for row in rows if row.text("outcome") != NOT_RUN]
            columns = reader.fieldnames or ()
    except (OSError, ValueError, csv.Error) as error:
        raise CaseError(f"cannot be read: {error}", file=path, cure="run ancf study again") from error
    missing = [name for name in NEEDED if name not in columns]
    if missing:
        raise CaseError(f"no column {missing[0]!r}", file=path, got=", ".join(columns), expected="study.csv")
    return rows


def _chart(table: Any, index: int, path: Path) -> ChartSpec:
    try:
        return ChartSpec.model_validate(table, strict=False)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(["charts", str(index), *map(str, first["loc"])])
        cure = "run ancf study again with a study file of this version"
        raise CaseError(first["msg"], file=path, key=key, got=first.get("input"), cure=cure) from error


def select(table: StudyTable, only: Mapping[str, Any]) -> list[StudyRow]:
    """Rows whose keys have one of the values asked for."""
    rows = table.rows
    for key, wanted in only.items():
        values = (
            wanted
            if isinstance(wanted, list | tuple) and wanted and not _is_value(table, key, wanted)
            else [wanted]
        )
        rows = [row for row in rows if any(same(row.text(key), value) for value in values)]
    return rows


def _is_value(table: StudyTable, key: str, wanted: Sequence[Any]) -> bool:
    """Whether a list is itself a value of the key, such as divisions."""
    return any(isinstance(value, list) and list(wanted) == value for value in table.keys.get(key, ()))


def same(cell: str, value: Any) -> bool:
    """Whether a cell of study.csv holds a value of the study file."""
    if _is_number(value):
        try:
            return float(cell) == float(value)
        except ValueError:
            return False
    if isinstance(value, str):
        return cell == value
    return written(cell) == written(value)


def written(value: Any) -> str:
    """A value in the fewest characters: lists and tables without quotes and blanks."""
    text = value if isinstance(value, str) else json.dumps(value)
    return "".join(letter for letter in text if letter not in "\"' ")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _reads(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
