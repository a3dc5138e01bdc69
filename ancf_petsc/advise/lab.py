"""Runs for advice: each once, one after the other, kept in a folder of a study's kind."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ancf_petsc.errors import CaseError, writing
from ancf_petsc.input.load import Case
from ancf_petsc.studies.facts import Facts
from ancf_petsc.studies.read import Study
from ancf_petsc.studies.rows import RunRow, fill, read_rows
from ancf_petsc.studies.runner import Runner
from ancf_petsc.studies.runs import StudyRun, run_of, sized_run
from ancf_petsc.studies.spec import QuantitySpec, StudySpec
from ancf_petsc.studies.study import compile_missing
from ancf_petsc.studies.table import RUNS

ASKED, DRIFT = "quantity", "drift"
Changes = Mapping[str, Any]


@dataclass(frozen=True)
class Trial:
    """A run that has been made. value: of the quantity, None where it has none. seconds: of the whole run."""

    changes: dict[str, Any]
    row: RunRow
    value: float | None
    drift: float | None

    @property
    def facts(self) -> Facts:
        """Sizes."""
        assert self.row.run.facts is not None
        return self.row.run.facts

    @property
    def seconds(self) -> float:
        """Of the whole run, its start included."""
        return self._seconds("total")

    @property
    def solution(self) -> float:
        """Of the solution alone."""
        return self._seconds("solve")

    @property
    def iterations(self) -> int:
        """Of Newton."""
        summary = self.row.end.summary if self.row.end else {}
        return int(summary.get("iterations", {}).get("newton", 0))

    @property
    def failure(self) -> str:
        """Why it did not come to its end, as one word; empty where it did."""
        return "" if self.row.done else self.row.outcome

    def _seconds(self, part: str) -> float:
        """Of the clock; where others had the machine's cores too, as much less as the processor worked less for the run."""
        summary, record = self.row.end.summary if self.row.end else {}, self.row.record
        found = float((summary.get("seconds") or {}).get(part, 0.0))
        wall, processor = record.get("wall"), record.get("processor")
        if record.get("alone") or not wall or processor is None:
            return found
        return found * min(1.0, processor / wall)


class Lab:
    """Makes trials of a case within a budget. say: gets one line for each.

    drift: the column whose drift is watched beside the quantity, "" for none.
    """

    def __init__(
        self,
        case: Case,
        asked: QuantitySpec,
        folder: Path,
        budget: float,
        drift: str = "",
        say: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.folder, self.say, self.asked, self.budget = folder / RUNS, say, asked, budget
        quantities = {ASKED: asked}
        if drift:
            quantities[DRIFT] = QuantitySpec(column=drift, reduce="drift")
        spec = StudySpec(title="Advice", case="case.toml", vary={}, quantity=quantities)
        assert case.file is not None
        self.study = Study(spec, case.file, case.folder, "advice", case)
        self.case_file = case.file
        self.trials: dict[str, Trial] = {}
        self.refused: dict[str, str] = {}
        self._begun = time.monotonic()
        with writing(self.folder, "--out"):
            self.folder.mkdir(parents=True, exist_ok=True)

    @property
    def spent(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self._begun

    @property
    def left(self) -> float:
        """Seconds that remain of the budget."""
        return self.budget - self.spent

    def plan(self, changes: Changes) -> StudyRun | None:
        """The run of these changes, with its sizes; None where the case or its mesh refuses them."""
        try:
            run = run_of(self.study, tuple(changes.items()), "advice")
        except CaseError as error:
            self.refused.setdefault(str(error), "")
            return None
        run = sized_run(run, self.folder)
        return run if run.facts is not None else None

    def known(self, changes: Changes) -> Trial | None:
        """The trial of these changes, if it has been made."""
        return self.trials.get(repr(sorted(changes.items(), key=str)))

    def make(self, changes: Changes, label: str) -> Trial | None:
        """Run, or take what has run before; None where it cannot be run."""
        key = repr(sorted(changes.items(), key=str))
        if key in self.trials:
            return self.trials[key]
        run = self.plan(changes)
        if run is None:
            return None
        run = replace(run, label=label)
        compile_missing([run], self.folder)
        runner = Runner(self.case_file, self.folder, jobs=1, ranks=1, timeout=max(1.0, 2.0 * self.left))
        runner.go([run])
        (row,) = read_rows([run], self.folder)
        for name, asked in self.study.spec.quantity.items():
            fill(row, name, asked)
        value = row.found.get(ASKED) if row.counts_for(self.asked) else None
        trial = self.trials[key] = Trial(dict(changes), row, value, row.found.get(DRIFT))
        found = "" if value is None else f"{value:.7g}, "
        end = f", {trial.failure}: {row.reason}" if trial.failure else ""
        self.say(f"{label}: {found}{trial.facts.dof} degrees of freedom, {trial.seconds:.3g} s{end}")
        return trial
