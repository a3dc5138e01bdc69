"""What the runs of a study gave: one `Row` a run, with its quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.errors import CaseError
from ancf_petsc.results.reader import open_results
from ancf_petsc.studies.ending import RunEnd, one_line, read_end
from ancf_petsc.studies.quantity import Tables, row_of, value_of
from ancf_petsc.studies.record import read_record
from ancf_petsc.studies.runs import StudyRun, version
from ancf_petsc.studies.spec import QuantitySpec


@dataclass
class RunRow:
    """A run as it stands. end: None while it has not run. record: what the study noted. found: quantity -> its number."""

    run: StudyRun
    folder: Path
    end: RunEnd | None
    record: Mapping[str, Any]
    tables: Tables
    found: dict[str, float] = field(default_factory=dict)
    doubt: str = ""

    @property
    def done(self) -> bool:
        """Whether it came to its end."""
        return self.end is not None and self.end.status == "done"

    @property
    def status(self) -> str:
        """done, failed or skipped."""
        return self.end.status if self.end else "skipped"

    @property
    def outcome(self) -> str:
        """A short name for how it ended."""
        if self.end:
            return self.end.outcome
        if self.run.problem:
            return "wrong_input"
        return "interrupted" if self.record.get("code") == 130 else "not_run"

    @property
    def reason(self) -> str:
        """One line."""
        if self.end:
            return self.end.reason or self.doubt
        return self.run.problem

    def counts_for(self, asked: QuantitySpec) -> bool:
        """Whether the number may stand among errors and levels: a run that ended early has no end to compare."""
        whole = asked.summary is not None or asked.reduce is not None or asked.at and asked.at.column == "end"
        return self.done or not whole

    def stretch_at(self, asked: QuantitySpec) -> float | None:
        """The smallest stretch in the body where the number was taken, of the elements' means; None without fields."""
        with suppress(CaseError, OSError, KeyError, ValueError):
            index = row_of(asked.at, self.tables) if asked.at else -1
            strain = open_results(self.folder).field("green_lagrange", index)
            least = np.linalg.eigvalsh(strain.reshape(-1, 3, 3)).min()
            return float(np.sqrt(max(0.0, 1.0 + 2.0 * least)))
        return None


def read_rows(runs: Sequence[StudyRun], folder: Path) -> list[RunRow]:
    """All runs as their folders have them, in the order given."""
    rows = []
    for run in runs:
        record, place = read_record(folder, run.name), folder / run.name
        end = read_end(place, run.identity, version(), record)
        rows.append(RunRow(run, place, end, record, Tables(place)))
    return rows


def fill(row: RunRow, name: str, asked: QuantitySpec, reference: Tables | None = None) -> None:
    """Enter one of a row's numbers; where a finished run has none, the row says why."""
    if row.end is None or asked.against and reference is None:
        return
    try:
        row.found[name] = value_of(asked, row.tables, reference)
    except CaseError as error:
        if row.done and not row.doubt:
            row.doubt = one_line(f"quantity {name}: {error}")
