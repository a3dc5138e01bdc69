"""What errors are against: a number, the finest run, a further run, a CSV file, or the limit that ladders show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ancf_petsc.errors import CaseError
from ancf_petsc.studies.facts import step_count
from ancf_petsc.studies.ladders import (
    COUNTS,
    MESH,
    MESHES,
    NUMBERS,
    LadderLine,
    ladder_keys,
    lines_of,
    size_of,
)
from ancf_petsc.studies.quantity import Tables, value_of
from ancf_petsc.studies.read import Study
from ancf_petsc.studies.richardson import ASYMPTOTIC
from ancf_petsc.studies.rows import RunRow
from ancf_petsc.studies.runs import described, reference_run
from ancf_petsc.studies.spec import QuantitySpec, ReferenceSource


@dataclass(frozen=True)
class StudyReference:
    """value None where there is none yet; uncertainty: absolute, None where it is not known. tables: of its series."""

    kind: str
    value: float | None
    uncertainty: float | None
    words: str
    tables: Tables | None = None

    def relative(self) -> float | None:
        """The uncertainty relative to the value; absolute where that is zero."""
        if self.uncertainty is None or self.value is None:
            return None
        return self.uncertainty / abs(self.value) if self.value else self.uncertainty

    def error(self, found: float) -> float | None:
        """|found / value - 1|; |found| where the value is zero."""
        if self.value is None:
            return None
        return abs(found / self.value - 1.0) if self.value else abs(found)


def check_files(study: Study) -> None:
    """Raise CaseError where a reference's CSV file is not there, or has nothing to compare with."""
    for name, source in study.spec.reference.items():
        if source.kind == "file":
            tables, asked = _file(study, name, source), study.spec.quantity[name]
            if asked.against:
                tables.column(asked.column or "")
            else:
                _value_in_file(study, name, tables)


def series_of(study: Study, name: str, rows: Sequence[RunRow]) -> Tables | None:
    """The tables a quantity's series is compared with, None where they are not there yet."""
    source = study.spec.reference[name]
    if source.kind == "file":
        return _file(study, name, source)
    if source.kind == "run":
        wanted = reference_run(study, name)
        return next((row.tables for row in rows if row.run.name == wanted and row.end), None)
    finest = _finest([row for row in rows if row.done and row.run.in_table])
    return finest.tables if finest else None


def reference_of(
    study: Study, name: str, rows: Sequence[RunRow], lines: Sequence[LadderLine]
) -> StudyReference:
    """The reference of a quantity from what has run. lines: the quantity's ladders. Raises CaseError for a wrong file."""
    asked, source = study.spec.quantity[name], study.spec.reference[name]
    if asked.against:
        return StudyReference(
            source.kind, 0.0, None, "the series is compared with the reference's: its error is itself"
        )
    if source.kind == "number":
        return StudyReference("number", source.value, None, "a number of the study file")
    if source.kind == "file":
        return StudyReference(
            "file", _value_in_file(study, name, _file(study, name, source)), None, source.file
        )
    if source.kind == "run":
        wanted = reference_run(study, name)
        found = next((row.found.get(name) for row in rows if row.run.name == wanted), None)
        words = f"a further run with {described(source.changes)}"
        return StudyReference("run", found, None, words if found is not None else f"{words}: no value yet")
    if source.kind == "finest":
        return _of_finest(name, asked, rows, lines)
    return _of_lines(study.spec.keys, rows, lines, source)


def _file(study: Study, name: str, source: ReferenceSource) -> Tables:
    path = study.folder / source.file
    if not path.is_file():
        raise CaseError(
            "there is no such file",
            file=study.file,
            key=f"reference.{name}",
            got=source.file,
            expected="a CSV file, from the study's folder",
        )
    return Tables(path)


def _value_in_file(study: Study, name: str, tables: Tables) -> float:
    try:
        return value_of(study.spec.quantity[name], tables)
    except CaseError as error:
        raise CaseError(str(error), file=study.file, key=f"reference.{name}") from None


def _finest(rows: Sequence[RunRow]) -> RunRow | None:
    """The run with the most degrees of freedom; of those that have as many, the one of the most steps."""
    return max(
        rows,
        key=lambda row: (
            row.run.facts.dof if row.run.facts else 0,
            step_count(row.run.case.spec),
        ),
        default=None,
    )


def _of_finest(
    name: str, asked: QuantitySpec, rows: Sequence[RunRow], lines: Sequence[LadderLine]
) -> StudyReference:
    good = [row for row in rows if row.run.in_table and name in row.found and row.counts_for(asked)]
    finest = _finest(good)
    if finest is None:
        return StudyReference("finest", None, None, "no run has a value yet")
    words = f"the finest run: {described(tuple(finest.run.values.items()))}"
    gaps = [
        (line.result.gap or 0.0) + (line.result.uncertainty or 0.0)
        for line in lines
        if line.result.verdict == ASYMPTOTIC and line.rows[-1] is finest
    ]
    if not gaps:
        words += "; nothing says how far it is from the limit"
    return StudyReference("finest", finest.found[name], max(gaps) if gaps else None, words)


def _of_lines(
    keys: Sequence[str], rows: Sequence[RunRow], lines: Sequence[LadderLine], source: ReferenceSource
) -> StudyReference:
    """Of all ladders along one key the limit that is least uncertain, checked against the others."""
    table = [row for row in rows if row.run.in_table]
    key = source.key or next(iter(ladder_keys(keys, table)), "")
    if not key:
        return StudyReference(
            "richardson", None, None, "no key of the study makes levels: vary a size, a step or a tolerance"
        )
    ours = _finest_of_others([line for line in lines if line.key == key], key)
    good = [line for line in ours if line.result.verdict == ASYMPTOTIC]
    if not good:
        said = "; ".join(f"{_name(line)}{line.result.verdict}: {line.result.words}" for line in ours)
        return StudyReference("richardson", None, None, f"along {key}: {said or 'no levels yet'}")
    best = min(good, key=lambda line: line.result.uncertainty or 0.0)
    limit, uncertainty = best.result.limit, best.result.uncertainty
    assert limit is not None
    assert uncertainty is not None
    words = f"limit along {key} {_name(best)}{best.result.words}"
    apart = 0.0
    for line in good:
        other = line.result
        assert other.limit is not None
        assert other.uncertainty is not None
        beyond = abs(other.limit - limit) - other.uncertainty - uncertainty
        if line is not best and beyond > 0:
            apart = max(apart, abs(other.limit - limit) - other.uncertainty)
            words += f"; the limit {_name(line)}disagrees: {other.limit:.6g} (+- {other.uncertainty:.2g})"
    return StudyReference("richardson", limit, max(uncertainty, apart), words)


def _finest_of_others(lines: list[LadderLine], key: str) -> list[LadderLine]:
    """Of ladders that differ in another key that refines too, those at its finest value: the others have other limits."""
    for other in (*MESHES, *NUMBERS, *COUNTS):
        if not lines or other not in lines[0].values or (key == MESH and other in MESHES):
            continue
        sizes = [min((size_of(row, other) for row in line.rows), default=0.0) for line in lines]
        known = [size for size in sizes if size > 0]
        if known:
            lines = [line for line, size in zip(lines, sizes, strict=True) if size <= min(known) * (1 + 1e-9)]
    return lines


def _name(line: LadderLine) -> str:
    return f"of {described(tuple(line.values.items()))}, " if line.values else ""


def all_lines(study: Study, rows: Sequence[RunRow]) -> dict[str, list[LadderLine]]:
    """The ladders of every quantity, along every key that makes some."""
    table = [row for row in rows if row.run.in_table]
    keys = study.spec.keys
    found: dict[str, list[LadderLine]] = {}
    for name, asked in study.spec.quantity.items():
        source = study.spec.reference.get(name)
        named = [source.key] if source and source.key else []
        along = dict.fromkeys([*named, *ladder_keys(keys, table)]) if not asked.against else {}
        found[name] = [line for key in along for line in lines_of(name, asked, key, keys, table)]
    return found
