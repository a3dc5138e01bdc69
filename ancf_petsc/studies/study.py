"""A study from its file to its table."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ancf_petsc.element.catalog import element
from ancf_petsc.errors import CaseError, writing
from ancf_petsc.kernel.warmup import compile_kernels, is_compiled
from ancf_petsc.material import law_named
from ancf_petsc.studies.read import Study, load_study
from ancf_petsc.studies.record import held, read_record
from ancf_petsc.studies.reference import check_files
from ancf_petsc.studies.runner import Runner, StudyProgress, free_cores
from ancf_petsc.studies.runs import StudyRun, runs_of
from ancf_petsc.studies.table import RUNS, StudyOutcome

log = logging.getLogger("ancf")
LOCK = "study.lock"
SELDOM = 3.0
"""Seconds between two writings of the table while runs go on."""


@dataclass(frozen=True)
class Options:
    """jobs: runs beside each other, None for cores over ranks. only: (k, m), every m-th run from the k-th. timing: repeat
    alone what was timed beside others.
    """

    jobs: int | None = None
    ranks: int = 1
    only: tuple[int, int] = (1, 1)
    timing: bool = False


def run_study(
    path: str | Path | Study,
    folder: str | Path | None = None,
    options: Options | None = None,
    progress: Callable[[StudyProgress], None] = lambda now: None,
) -> StudyOutcome:
    """Do what is not done of a study and write its table; folder: default results/NAME.

    Raises CaseError for a wrong study, Interrupted when the user stops it: its table is written all the same.
    """
    options = options or Options()
    study = path if isinstance(path, Study) else load_study(path)
    folder = Path(folder) if folder else default_folder(study)
    _check_folder(folder)
    check_files(study)
    place = folder / RUNS
    runs = runs_of(study, place)
    with writing(folder, "--out"):
        place.mkdir(parents=True, exist_ok=True)
    mine = share(runs, options.only)
    writer = _Writer(study, runs, folder)
    runner = Runner(
        study.case_file,
        place,
        jobs=free_cores(options.jobs, options.ranks),
        ranks=options.ranks,
        timeout=study.spec.timeout,
        changed=writer.now_and_then,
        progress=progress,
    )
    compile_missing(mine, place)
    try:
        runner.go(mine)
        if options.timing:
            runner.time_alone(mine)
    finally:
        outcome = writer.write()
    return outcome


def default_folder(study: Study) -> Path:
    """Where a study's results go."""
    return Path("results") / study.name


def plan_study(study: Study, folder: Path) -> list[StudyRun]:
    """The runs of a study, cheapest first, without doing any. Raises CaseError."""
    return runs_of(study, folder / RUNS)


def share(runs: Sequence[StudyRun], only: tuple[int, int]) -> list[StudyRun]:
    """Every m-th run from the k-th, of those that can be run."""
    k, m = only
    return [run for run in runs if run.facts is not None][k - 1 :: m]


class _Writer:
    """Writes the table, one process at a time, from what all folders say at that moment."""

    def __init__(self, study: Study, runs: Sequence[StudyRun], folder: Path) -> None:
        self.study, self.runs, self.folder = study, runs, folder
        self._last = time.monotonic()

    def now_and_then(self) -> None:
        """Write unless it was written a moment ago."""
        if time.monotonic() - self._last > SELDOM:
            self.write()

    def write(self) -> StudyOutcome:
        """Read all folders and write. The lock makes the last writer the one that has seen all."""
        with held(self.folder / LOCK, wait=True):
            outcome = StudyOutcome(self.study, self.runs, self.folder)
            outcome.write()
        self._last = time.monotonic()
        return outcome


def _check_folder(folder: Path) -> None:
    """Raise CaseError where a study's folder is something else."""
    if folder.exists() and not folder.is_dir():
        raise CaseError("is a file", file=folder, key="--out", expected="a folder", cure="choose another")
    if (folder / "results.h5").exists():
        cure = "choose another folder by --out DIR"
        raise CaseError("a run is in this folder", file=folder, key="--out", expected="a study's", cure=cure)


def compile_missing(runs: Sequence[StudyRun], place: Path) -> None:
    """Compile what is missing once, before runs beside each other do it each for itself."""
    for run in runs:
        if read_record(place, run.name).get("code") == 0:
            continue
        spec = run.case.spec
        row = element(spec.mesh.element)
        laws = [law_named(name) for name in sorted({material.law for material in spec.material})]
        moving = spec.dynamics is not None
        mean = spec.dynamics is not None and spec.dynamics.method.conserves
        if not is_compiled(row, laws, mean=mean, moving=moving):
            names = ", ".join(law.name for law in laws)
            log.info("compiling kernels (%s, %s): once, under a minute", row.code, names)
            compile_kernels(row, laws, mean=mean, moving=moving)
