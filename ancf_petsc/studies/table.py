"""study.csv and study.json: what the runs of a study gave, one row a run."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ancf_petsc.analysis.host.machine import machine
from ancf_petsc.analysis.host.versions import versions
from ancf_petsc.errors import writing
from ancf_petsc.post.charts.study_table import FACTS, TABLE
from ancf_petsc.post.units import read_units
from ancf_petsc.results.folder import write_atomic
from ancf_petsc.studies.ladders import LadderLine
from ancf_petsc.studies.read import Study
from ancf_petsc.studies.reference import StudyReference, all_lines, reference_of, series_of
from ancf_petsc.studies.rows import RunRow, fill, read_rows
from ancf_petsc.studies.runs import StudyRun
from ancf_petsc.studies.spec import OutputAt, QuantitySpec

RUNS = "runs"
SIZES = [
    "elements", "dof", "h", "ranks", "steps", "newton", "linear",
    "solve_seconds", "total_seconds", "seconds_alone", "memory_peak_bytes", "run",
]  # fmt: skip

Cells = dict[str, Any]


class StudyOutcome:
    """A study as its folder has it.

    table: column -> cells, one a run, None where there is none; made for `pandas.DataFrame(outcome.table)`.
    facts: as in study.json. rows: one a run, those of references alone after the others.
    """

    def __init__(self, study: Study, runs: Sequence[StudyRun], folder: Path) -> None:
        self.study, self.folder = study, folder
        self.rows = read_rows(_ordered(study, runs), folder / RUNS)
        spec = study.spec
        for name, asked in spec.quantity.items():
            for row in self.rows:
                fill(row, name, asked)
        for name, asked in spec.quantity.items():
            known = series_of(study, name, self.rows) if asked.against else None
            for row in self.rows:
                if asked.against:
                    fill(row, name, asked, known)
        self.lines = all_lines(study, self.rows)
        self.references = {
            name: reference_of(study, name, self.rows, self.lines[name]) for name in spec.reference
        }
        self.cells = [self._cells(row) for row in self.rows if row.run.in_table]

    @property
    def table(self) -> dict[str, list[Any]]:
        """Columns of study.csv."""
        return {name: [cells[name] for cells in self.cells] for name in self.columns}

    @property
    def columns(self) -> list[str]:
        """Names of the columns of study.csv, in their order."""
        asked = [
            f"{name}{end}" for name in self.study.spec.quantity for end in ("", "_error", "_uncertainty")
        ]
        return [*self.study.spec.keys, "status", "outcome", "reason", *asked, *SIZES]

    @property
    def facts(self) -> dict[str, Any]:
        """What study.json holds."""
        spec, units = self.study.spec, self.study.base.spec.units
        return {
            "format": spec.format,
            "title": spec.title,
            "note": spec.note,
            "case": spec.case,
            "units": units,
            "axes": [{"key": key, "values": self._values(key)} for key in spec.keys],
            "quantities": {name: self._quantity(name, asked) for name, asked in spec.quantity.items()},
            "orders": [_order(line) for lines in self.lines.values() for line in lines],
            "charts": [chart.model_dump(exclude_unset=True) for chart in spec.chart],
            "versions": versions(),
            "machine": machine(),
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
        }

    def write(self) -> None:
        """Both files, each as a whole. By the holder of the study's lock."""
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        rows.writerow(self.columns)
        rows.writerows([_text(cells[name]) for name in self.columns] for cells in self.cells)
        with writing(self.folder / TABLE):
            write_atomic(self.folder / TABLE, text.getvalue())
        with writing(self.folder / FACTS):
            write_atomic(self.folder / FACTS, json.dumps(self.facts, indent=1) + "\n")

    def _cells(self, row: RunRow) -> Cells:
        cells: Cells = dict.fromkeys(self.columns)
        cells |= row.run.values
        cells |= {"status": row.status, "outcome": row.outcome, "reason": row.reason}
        for name, asked in self.study.spec.quantity.items():
            cells |= self._numbers(row, name, asked)
        return cells | _sizes(row, self.folder)

    def _numbers(self, row: RunRow, name: str, asked: QuantitySpec) -> Cells:
        """A quantity of a row with its error, where the run came far enough to compare it."""
        found = row.found.get(name)
        reference = self.references.get(name)
        if found is None or reference is None or not row.counts_for(asked):
            return {name: found}
        error, doubt = reference.error(found), reference.relative()
        return {
            name: found,
            f"{name}_error": error,
            f"{name}_uncertainty": doubt if error is not None else None,
        }

    def _values(self, key: str) -> list[Any]:
        """The values of a key, in the order of the rows, each once."""
        found: dict[str, Any] = {}
        for cells in self.cells:
            found.setdefault(json.dumps(cells[key], default=str), cells[key])
        return list(found.values())

    def _quantity(self, name: str, asked: QuantitySpec) -> Cells:
        reference = self.references.get(name)
        said: Cells = {
            "column": asked.column,
            "summary": asked.summary,
            "reduce": asked.reduce,
            "against": asked.against,
        }
        if isinstance(asked.at, OutputAt):
            said["at"] = "end" if asked.at.column == "end" else {asked.at.column: asked.at.value}
        said["unit"] = "" if asked.against else unit_of(asked.column or "", self.study.base.spec.units)
        said["reference"] = None if reference is None else _said(reference)
        return {key: value for key, value in said.items() if value is not None or key == "reference"}


def _ordered(study: Study, runs: Sequence[StudyRun]) -> list[StudyRun]:
    """Rows of the table in the order of the study file, then runs of references alone."""
    from ancf_petsc.studies.runs import combinations

    places: dict[str, int] = {}
    for index, (_, changes) in enumerate(combinations(study)):
        places.setdefault(repr(dict(changes)), index)
    last = len(places)
    return sorted(
        runs, key=lambda run: places.get(repr(dict(run.changes)), last) if run.in_table else last + 1
    )


def _said(reference: StudyReference) -> Cells:
    return {
        "kind": reference.kind,
        "value": reference.value,
        "uncertainty": reference.relative(),
        "words": reference.words,
    }


def _order(line: LadderLine) -> Cells:
    result = line.result
    relative = None
    if result.uncertainty is not None and result.limit is not None:
        relative = result.uncertainty / abs(result.limit) if result.limit else result.uncertainty
    return {
        "quantity": line.quantity,
        "key": line.key,
        "line": line.values,
        "order": result.order,
        "limit": result.limit,
        "uncertainty": relative,
        "verdict": result.verdict,
        "words": result.words,
    }


def _sizes(row: RunRow, folder: Path) -> Cells:
    """What the run took; seconds of the run that was repeated alone, where there was one."""
    summary = row.end.summary if row.end else {}
    seconds = row.record.get("seconds") or summary.get("seconds") or {}
    iterations: Mapping[str, Any] = summary.get("iterations") or {}
    memory = summary.get("memory_peak_bytes")
    known = row.run.facts
    return {
        "elements": summary.get("elements", known.elements if known else None),
        "dof": summary.get("dof", known.dof if known else None),
        "h": known.h if known else None,
        "ranks": summary.get("ranks"),
        "steps": summary.get("steps"),
        "newton": iterations.get("newton"),
        "linear": iterations.get("linear"),
        "solve_seconds": seconds.get("solve"),
        "total_seconds": seconds.get("total"),
        "seconds_alone": bool(row.record.get("alone")) if seconds else None,
        "memory_peak_bytes": sum(memory) if memory else None,
        "run": str(row.folder.relative_to(folder)) if row.end and row.end.summary else None,
    }


def unit_of(column: str, units: str) -> str:
    """The unit of a column of curve.csv or probes.csv, empty where the case's label does not say."""
    known, last = read_units(units), column.rpartition(".")[2]
    if column in ("time", "stroke"):
        return known.time if column == "time" else known.length
    if column.startswith(("momentum.", "angular_momentum.")):
        return known.momentum if column.startswith("momentum.") else known.angular_momentum
    if column.startswith("force") or last in ("rx", "ry", "rz"):
        return known.force
    if column.endswith(("_energy", "_work", "_drift")):
        return known.energy
    return known.length if "." in column and last in ("x", "y", "z", "ux", "uy", "uz") else ""


def _text(value: Any) -> str:
    """A cell: nothing for None, all digits of a number, lists and tables as JSON."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    return value if isinstance(value, str) else json.dumps(value)
