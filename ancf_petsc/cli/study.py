"""`ancf study`: many runs of a case, one table."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ancf_petsc.studies.runner import StudyProgress
    from ancf_petsc.studies.table import StudyOutcome

HELP = "run a case with keys varied, and tabulate errors and costs"
EPILOG = """\
a study can be interrupted, killed, extended and started again, also several times at once: finished runs are
reused, none is done twice. docs/study.md has the file's format; ancf plot DIR draws the charts"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", metavar="STUDY", type=Path, help="a study file, or a folder with study.toml")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where it goes (default results/NAME)")
    parser.add_argument(
        "--jobs", type=int, metavar="N", help="runs beside each other (default: cores over ranks)"
    )
    parser.add_argument("--ranks", type=int, metavar="N", default=1, help="ranks of each run (default 1)")
    parser.add_argument("--only", metavar="K/M", help="every M-th run from the K-th, for a job array")
    parser.add_argument("--list", action="store_true", help="show the runs, cheapest first, and stop")
    parser.add_argument(
        "--timing", action="store_true", help="repeat alone, for its seconds, what ran beside others"
    )
    parser.add_argument("--quiet", action="store_true", help="warnings only")


def execute(arguments: argparse.Namespace) -> int:
    from ancf_petsc import log
    from ancf_petsc.studies.read import load_study
    from ancf_petsc.studies.study import Options, default_folder, run_study

    options = Options(arguments.jobs, arguments.ranks, _share(arguments.only), arguments.timing)
    _refuse_wrong(arguments)
    study = load_study(arguments.study)
    folder = arguments.out or default_folder(study)
    if arguments.list:
        return _list(study, folder)
    shown = log.on_terminal() and not arguments.quiet
    log.configure(verbosity=-1 if arguments.quiet or shown else 0)
    with _line(shown=shown) as line:
        outcome = run_study(study, folder, options, line)
    if not arguments.quiet:
        _report(outcome)
    return 0


def _share(text: str | None) -> tuple[int, int]:
    from ancf_petsc.errors import CaseError

    if text is None:
        return 1, 1
    found = re.fullmatch(r"(\d+)/(\d+)", text)
    k, m = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= k <= m:
        raise CaseError(key="--only", got=text, expected="K/M with K from 1 to M", cure="such as --only 1/4")
    return k, m


def _refuse_wrong(arguments: argparse.Namespace) -> None:
    from ancf_petsc.cli import rank_count
    from ancf_petsc.errors import CaseError

    for name in ("jobs", "ranks"):
        value = getattr(arguments, name)
        if value is not None and value < 1:
            raise CaseError(key=f"--{name}", got=value, expected="a number from 1")
    if rank_count() > 1:
        raise CaseError("ancf study starts its runs itself", cure="run it without mpiexec, give it --ranks N")


def _list(study: object, folder: Path) -> int:
    """All runs, what they are expected to take relative to each other, and what is done."""
    from ancf_petsc.cli.console import show_table
    from ancf_petsc.studies.read import Study
    from ancf_petsc.studies.rows import read_rows
    from ancf_petsc.studies.study import plan_study
    from ancf_petsc.studies.table import RUNS

    assert isinstance(study, Study)
    rows = read_rows(plan_study(study, folder), folder / RUNS)
    listed = [
        (
            row.run.label,
            row.run.facts.elements if row.run.facts else None,
            row.run.facts.dof if row.run.facts else None,
            row.outcome,
            row.run.name,
        )
        for row in rows
    ]
    show_table(("run", "elements", "degrees of freedom", "state", "folder"), listed)
    return 0


class _line:
    """One line on the terminal that says how far the study is."""

    def __init__(self, *, shown: bool) -> None:
        self.shown, self._width = shown, 0

    def __enter__(self) -> Callable[[StudyProgress], None]:
        return self._show

    def __exit__(self, *_: object) -> None:
        if self.shown and self._width:
            print(f"\r{' ' * self._width}\r", end="", flush=True)

    def _show(self, now: StudyProgress) -> None:
        if not self.shown:
            return
        left = "" if now.left is None else f", about {_duration(now.left)} left"
        text = f"{now.done} of {now.total} done, {now.running} running, {now.failed} failed{left}"
        print(f"\r{text:<{self._width}}", end="", flush=True)
        self._width = len(text)


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _report(outcome: StudyOutcome) -> None:
    """The table in short, the references and the orders."""
    from ancf_petsc.cli.console import show_table

    spec = outcome.study.spec
    asked = [name for quantity in spec.quantity for name in (quantity, f"{quantity}_error")]
    table = outcome.table
    keys = [key for key in spec.keys if len({str(value) for value in table[key]}) > 1]
    columns = [*keys, "outcome", *asked, "dof", "total_seconds"]
    used = [name for name in columns if any(cell is not None for cell in table[name])]
    show_table(used, list(zip(*(map(_cell, table[name]) for name in used), strict=True)))
    for name, reference in outcome.references.items():
        value = "none" if reference.value is None else f"{reference.value:.8g}"
        doubt = reference.relative()
        about = "" if doubt is None else f" (+- {100 * doubt:.2g} %)"
        print(f"{name}: reference {value}{about}: {reference.words}")
    _report_orders(outcome)
    print(f"table in {outcome.folder / 'study.csv'}; ancf plot {outcome.folder} draws it")


def _report_orders(outcome: StudyOutcome) -> None:
    from ancf_petsc.cli.console import show_table

    rows: list[Sequence[object]] = []
    for lines in outcome.lines.values():
        for line in lines:
            where = ", ".join(f"{value}" for value in line.values.values())
            rows.append((line.quantity, where, line.key, line.result.verdict, line.result.words))
    if rows:
        show_table(("quantity", "ladder", "along", "verdict", "why"), rows)


def _cell(value: object) -> object:
    return value if value is None or isinstance(value, int | float | str) else str(value)
