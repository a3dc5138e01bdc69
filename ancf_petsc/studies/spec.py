"""The study file, format 1: its tables with their keys and limits. docs/study.md is for users."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, PlainValidator, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from ancf_petsc.errors import did_you_mean
from ancf_petsc.input.load import as_tuples, refuse_nul
from ancf_petsc.input.messages import case_error
from ancf_petsc.input.types import Name, Table, key, one_of, problem
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.studies.chart_spec import chart_problems

PAGE = "docs/study.md has examples"
ABSCISSAS = ("stroke", "time", "pseudo_time")
END = "end"
REDUCTIONS = ("max", "min", "mean", "rms", "drift")
COMPARED = ("max", "mean", "rms")
"""Reductions that a difference of two series can be measured by."""
RESERVED = (
    "status", "outcome", "reason", "elements", "dof", "h", "ranks", "steps", "newton", "linear",
    "solve_seconds", "total_seconds", "seconds_alone", "memory_peak_bytes", "run",
)  # fmt: skip
"""Columns of study.csv that no quantity may take the name of."""


class OutputAt(NamedTuple):
    """The output that a value is taken at: the last one ("end"), or where a column has a value."""

    column: str
    value: float = 0.0


class ReferenceSource(NamedTuple):
    """What a reference is: kind "richardson", "finest", "number", "file" or "run".

    value: of a number. file: of a CSV file. key: what Richardson's levels differ in, "" to be found out.
    changes: (path, value) of the further run.
    """

    kind: str
    value: float = 0.0
    file: str = ""
    key: str = ""
    changes: tuple[tuple[str, Any], ...] = ()


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < float("inf")


def _at(value: object) -> OutputAt:
    if isinstance(value, OutputAt):
        return value
    if value == END:
        return OutputAt(END)
    if isinstance(value, Mapping) and len(value) == 1:
        ((name, number),) = value.items()
        if name not in ABSCISSAS:
            raise problem("unknown key", got=name, cure=did_you_mean(str(name), ABSCISSAS))
        if _is_number(number):
            return OutputAt(name, float(number))
    raise problem(
        expected='"end", or one of stroke, time, pseudo_time with a number',
        cure="such as at = { stroke = 0.010 }",
    )


def _source(value: object) -> ReferenceSource:
    if _is_number(value):
        return ReferenceSource("number", value=float(value))  # type: ignore[arg-type]
    if value in ("richardson", "finest"):
        return ReferenceSource(str(value))
    if isinstance(value, str) and value.lower().endswith(".csv"):
        return ReferenceSource("file", file=value)
    if isinstance(value, str):
        raise problem(
            expected='"richardson", "finest", a number, a file.csv or a table of keys',
            cure=did_you_mean(value, ("richardson", "finest")),
        )
    if isinstance(value, Mapping) and value:
        if set(value) == {"richardson"} and isinstance(value["richardson"], str):
            return ReferenceSource("richardson", key=value["richardson"])
        return ReferenceSource("run", changes=tuple(flattened(value)))
    raise problem(
        expected='"richardson", "finest", a number, a file.csv or a table of keys', cure='such as "finest"'
    )


def flattened(table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """(path, value) of a table whose keys are paths, quoted ("mesh.size" = 1) or not (mesh.size = 1)."""
    from ancf_petsc.input.schema import CaseSpec

    for name, value in table.items():
        if isinstance(value, Mapping) and name in CaseSpec.model_fields:
            yield from ((f"{name}.{path}", inner) for path, inner in _leaves(value))
        else:
            yield name, value


def _leaves(table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from ((f"{name}.{path}", inner) for path, inner in _leaves(value))
        else:
            yield name, value


def _lists(value: dict[str, Any]) -> dict[str, Any]:
    found = dict(flattened(value))
    for name, values in found.items():
        if not isinstance(values, tuple) or not values:
            raise problem(
                at=[name], got=values, expected="a list of values", cure=f'such as "{name}" = [1, 2]'
            )
    return found


def _free_name(name: str) -> str:
    if name in RESERVED or name.endswith(("_error", "_uncertainty")):
        raise problem(
            "study.csv has a column of this name", got=name, expected="another name", cure="rename it"
        )
    return name


AtKey = Annotated[OutputAt, PlainValidator(_at)]
SourceKey = Annotated[ReferenceSource, PlainValidator(_source)]
Lists = Annotated[dict[Name, Any], AfterValidator(_lists)]
QuantityName = Annotated[Name, AfterValidator(_free_name)]


class QuantitySpec(Table):
    """One entry of [quantity]: one number of each run."""

    column: Name | None = key('a column of curve.csv or probes.csv; such as "force"', None)
    at: AtKey | None = key('"end" or { stroke | time | pseudo_time = a number }', None)
    reduce: Annotated[str, one_of(lambda: REDUCTIONS, "a reduction over all outputs")] | None = key(
        'a reduction over all outputs; such as "max"', None
    )
    against: Literal["reference"] | None = key('"reference"; the series is compared with its series', None)
    summary: Name | None = key('a value of summary.json; such as "end.smallest_stretch"', None)

    @model_validator(mode="after")
    def _check(self) -> QuantitySpec:
        if (self.column is None) == (self.summary is None):
            raise problem(
                expected="exactly one of column and summary",
                cure='such as { column = "force", at = "end" } or { summary = "end.smallest_stretch" }',
            )
        if self.summary is not None:
            given = [name for name in ("at", "reduce", "against") if getattr(self, name) is not None]
            if given:
                raise problem("a value of summary.json has no outputs", at=given[:1], cure="drop it")
        elif (self.at is None) == (self.reduce is None):
            raise problem(
                expected="exactly one of at and reduce", cure='such as at = "end" or reduce = "max"'
            )
        if self.against and self.reduce not in COMPARED:
            raise problem(
                at=["reduce"],
                got=self.reduce,
                expected=f"one of {', '.join(COMPARED)} with against",
                cure='such as reduce = "rms"',
            )
        return self


class StudySpec(Table):
    """A whole study file."""

    format: Literal[1] = key("1; this program reads format 1", 1)
    title: Name = key('a title in quotes; such as title = "Element and mesh for the force at 10 mm"')
    note: str = key("a remark in quotes; it stands under every chart", "")
    case: Name = key('a case file; from the study\'s folder, such as "case.toml"')
    set: dict[Name, Any] = key("a table [set]; paths of keys with a value each, for all runs", {})
    vary: Lists = key("a table [vary]; paths of keys with lists of values", {})
    rows: tuple[dict[Name, Any], ...] = key("tables; write [[rows]]", ())
    quantity: dict[QuantityName, QuantitySpec] = key(
        'a table [quantity]; such as force = { column = "force", at = "end" }', min_length=1
    )
    reference: dict[Name, SourceKey] = key("a table [reference]; of the quantities", {})
    chart: tuple[ChartSpec, ...] = key("tables; write [[chart]]", ())
    timeout: float | None = key("a number > 0; seconds that a run may take", None, gt=0)

    @property
    def common(self) -> dict[str, Any]:
        """Path -> value of [set], before what a run changes itself."""
        return dict(flattened(self.set))

    @property
    def combinations(self) -> list[tuple[tuple[str, Any], ...]]:
        """The (path, value) of each of [[rows]], in the file's order."""
        return [tuple(flattened(row)) for row in self.rows]

    @property
    def keys(self) -> tuple[str, ...]:
        """The paths that runs differ in, in the order in which the file names them."""
        names = [*self.vary, *(name for row in self.combinations for name, _ in row)]
        return tuple(dict.fromkeys(names))


def check_study(data: dict[str, Any], file: Path) -> StudySpec:
    """The tables of a study file, checked. Raises CaseError with file and key."""
    refuse_nul(data, file)
    frozen = as_tuples(data)
    try:
        spec = StudySpec.model_validate(frozen)
        for found in _problems(spec):
            raise ValidationError.from_exception_data(
                "study", [InitErrorDetails(type=found, loc=(), input=None)]
            )
    except ValidationError as error:
        raise case_error(error, frozen, frozen, file, StudySpec, PAGE) from None
    return spec


def _problems(spec: StudySpec) -> Iterator[PydanticCustomError]:
    """What must hold between the tables."""
    if not spec.vary and not spec.rows:
        yield problem(
            "missing", at=["vary"], expected="[vary] or [[rows]]", cure='such as "mesh.element" = ["3413"]'
        )
    for index, row in enumerate(spec.rows):
        if not row:
            yield problem("no keys", at=["rows", index], expected="paths with values", cure="drop it")
    for name, source in spec.reference.items():
        if name not in spec.quantity:
            yield problem(
                "no such quantity",
                at=["reference", name],
                got=name,
                expected="a name of [quantity]",
                cure=did_you_mean(name, tuple(spec.quantity)),
            )
        elif source.kind == "richardson" and source.key and source.key not in spec.keys:
            yield problem(
                at=["reference", name],
                got=source.key,
                expected="a key that runs differ in",
                cure=did_you_mean(source.key, spec.keys),
            )
    for name, asked in spec.quantity.items():
        kind = spec.reference[name].kind if name in spec.reference else ""
        if asked.against and kind not in ("finest", "file", "run"):
            yield problem(
                at=["reference", name] if kind else ["quantity", name, "against"],
                expected='"finest", a file.csv or a table of keys: something with a series to compare with',
                cure=f'such as {name} = "finest" under [reference]',
            )
        if asked.summary and kind == "file":
            yield problem(
                at=["reference", name],
                expected="a number or a run: tables have no summary",
                cure='such as "finest"',
            )
    yield from chart_problems(spec.chart, spec.keys, tuple(spec.quantity))
