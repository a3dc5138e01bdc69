"""From a study to its runs: every combination as a checked case, each once, the cheapest first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

from ancf_petsc.analysis.host.versions import program_version
from ancf_petsc.analysis.identity import identity
from ancf_petsc.element.catalog import element
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case
from ancf_petsc.input.messages import shown
from ancf_petsc.input.overrides import SET
from ancf_petsc.studies.columns import check_quantity
from ancf_petsc.studies.facts import Facts, estimate, facts_of
from ancf_petsc.studies.read import Study
from ancf_petsc.studies.record import read_record

REMOVED = ""
"""The value that takes a key away, as `--set KEY=` does."""
Changes = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class StudyRun:
    """One run.

    changes: (path, value) beyond the base case. name: its hash. identity: hash of case and mesh alone. base_text: the
    base case as TOML.

    facts: sizes; None for a case that cannot be planned on its mesh, whose error is in `problem`. in_table: whether it
    is a row of study.csv, not a further run of a reference. values: of the varied keys. label: those that differ, in words.
    """

    changes: Changes
    case: Case
    name: str
    identity: str
    base_text: str
    facts: Facts | None = None
    seconds: float = 0.0
    problem: str = ""
    in_table: bool = True
    values: dict[str, Any] = field(default_factory=dict)
    label: str = "the case as it is"


def runs_of(study: Study, runs_folder: Path) -> list[StudyRun]:
    """All runs of a study, cheapest first; of combinations that make the same case one.

    runs_folder: where sizes of runs may be recorded. Raises CaseError for a value that a case refuses, and where no
    combination at all can be planned.
    """
    found: dict[str, StudyRun] = {}
    for where, changes in combinations(study):
        run = run_of(study, changes, where)
        found.setdefault(run.name, replace(run, values=_values(study, changes)))
    for name, source in study.spec.reference.items():
        if source.kind == "run":
            run = run_of(study, _with_common(study, source.changes), f"reference.{name}")
            found.setdefault(run.name, replace(run, in_table=False))
    sized = [sized_run(run, runs_folder) for run in _labelled(study, list(found.values()))]
    if all(run.facts is None for run in sized):
        raise CaseError(sized[0].problem)
    return sorted(sized, key=lambda run: (run.seconds, run.name))


def _labelled(study: Study, runs: list[StudyRun]) -> list[StudyRun]:
    """Runs with the keys that tell them apart as their label."""
    differing = [key for key in study.spec.keys if len({repr(run.values.get(key)) for run in runs}) > 1]
    labels = [
        described(tuple((key, run.values.get(key)) for key in differing))
        if run.in_table
        else described(run.changes)
        for run in runs
    ]
    return [replace(run, label=label or run.label) for run, label in zip(runs, labels, strict=True)]


def combinations(study: Study) -> Iterator[tuple[str, Changes]]:
    """(where in the file, changes) of the product of [vary], then of each of [[rows]]; those of [set] first."""
    spec = study.spec
    if spec.vary:
        for values in product(*spec.vary.values()):
            yield "vary", _with_common(study, zip(spec.vary, values, strict=True))
    for index, row in enumerate(spec.combinations):
        yield f"rows.{index}", _with_common(study, row)


def _with_common(study: Study, changes: Iterable[tuple[str, Any]]) -> Changes:
    return tuple({**study.spec.common, **dict(changes)}.items())


def reference_run(study: Study, name: str) -> str:
    """The hash of the further run that is a quantity's reference."""
    changes = _with_common(study, study.spec.reference[name].changes)
    return run_of(study, changes, f"reference.{name}").name


def _values(study: Study, changes: Changes) -> dict[str, Any]:
    """The varied keys of a row: its own changes, and what the base case says where it leaves a key alone."""
    own = dict(changes)
    from ancf_petsc.input import toml

    base = toml.parse(study.base.text)
    return {path: own[path] if path in own else _looked_up(base, path) for path in study.spec.keys}


def _looked_up(data: Any, path: str) -> Any:
    """The value of a plain path in a case's tables, None where there is none."""
    for name in path.split("."):
        if not isinstance(data, dict) or name not in data:
            return None
        data = data[name]
    return data


def run_of(study: Study, changes: Changes, where: str) -> StudyRun:
    """A combination as a checked case with its hash."""
    label = f"{study.file}: {where}: {described(changes)}"
    try:
        case = study.base.with_changes({path: None if value == REMOVED else value for path, value in changes})
        element(case.spec.mesh.element)
        known = identity(case)
    except CaseError as error:
        file = label if error.file in (None, SET, study.base.file) else f"{label}: {error.file}"
        raise CaseError(
            error.problem,
            file=file,
            key=error.key,
            got=error.got,
            expected=error.expected,
            cure=error.cure,
        ) from None
    for name, asked in study.spec.quantity.items():
        check_quantity(name, asked, case.spec, study.file)
    return StudyRun(tuple(changes), case, known.of_program(), known.hash, study.base.text)


def sized_run(run: StudyRun, runs_folder: Path) -> StudyRun:
    """The run with its sizes, recorded or from its mesh."""
    recorded = read_record(runs_folder, run.name).get("facts")
    try:
        facts = Facts(**recorded) if isinstance(recorded, dict) else facts_of(run.case)
    except CaseError as error:
        return replace(run, problem=" ".join(str(error).split()))
    return replace(run, facts=facts, seconds=estimate(run.case.spec, facts))


def described(changes: Changes) -> str:
    """Changes in a few words."""
    return ", ".join(f"{path} = {shown(value)!r}" for path, value in changes)


def version() -> str:
    """The program's version, part of each run's hash."""
    return program_version()
