"""A study from Python: run, tabulated and drawn."""

from __future__ import annotations

from pathlib import Path

from ancf_petsc.post.charts.draw import charts_of, save_charts
from ancf_petsc.post.charts.study_table import read_study
from ancf_petsc.studies.study import Options, run_study
from ancf_petsc.studies.table import StudyOutcome


def study(
    path: str | Path,
    folder: str | Path | None = None,
    *,
    jobs: int | None = None,
    ranks: int = 1,
    timing: bool = False,
    draw: bool = True,
) -> StudyOutcome:
    """Do what is not done of a study file, write its table and draw its charts; `pandas.DataFrame(outcome.table)` has it.

    folder: where it goes, default results/NAME. jobs: runs beside each other, default cores over ranks. timing: repeat
    alone, for its seconds, what ran beside others. Not collective: the runs are processes of their own. Raises
    CaseError, Interrupted.
    """
    outcome = run_study(path, folder, Options(jobs=jobs, ranks=ranks, timing=timing))
    if draw:
        charts, _ = charts_of(read_study(outcome.folder))
        save_charts(charts, outcome.folder / "charts", ("png", "svg"))
    return outcome
