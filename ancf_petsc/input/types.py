"""The kinds of values a case file holds: vectors, ramps, directions; and how a check says what is wrong."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PlainValidator
from pydantic_core import PydanticCustomError

from ancf_petsc.axes import AXES
from ancf_petsc.errors import did_you_mean

RAMPS = ("linear", "cosine", "constant")

Axis = Literal["x", "y", "z"]
Vector = tuple[float, float, float]
Count = Annotated[int, Field(ge=1)]
Ramp = Literal["linear", "cosine", "constant"] | tuple[tuple[float, float], ...]


class Table(BaseModel):
    """A table of the case file: known keys only, exact types, finite numbers, unchangeable."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


class Direction(NamedTuple):
    """One component of the displacement of a group, written `group.axis`."""

    group: str
    axis: str

    @property
    def component(self) -> int:
        """0, 1 or 2."""
        return AXES.index(self.axis)


def key(expected: str, default: Any = ..., **limits: Any) -> Any:
    """A key of a table. `expected` says in words what it holds, and after "; " the cure of a wrong value."""
    return Field(default, description=expected, **limits)


def problem(
    what: str = "",
    *,
    at: Sequence[str | int] = (),
    got: object = None,
    expected: str = "",
    cure: str = "",
    more: int = 0,
) -> PydanticCustomError:
    """What a check raises. `at` leads from the checked table to the key; `more` counts further problems."""
    context = {"what": what, "at": tuple(at), "got": got, "expected": expected, "cure": cure, "more": more}
    return PydanticCustomError("problem", "{what}", context)


def one_of(known: Collection[str] | Callable[[], Collection[str]], what: str) -> AfterValidator:
    """A string out of `known`, or of what it gives when a case is read."""

    def check(word: str) -> str:
        names = known() if callable(known) else known
        if word not in names:
            raise problem(got=word, expected=what, cure=did_you_mean(word, tuple(names)))
        return word

    return AfterValidator(check)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _ramp(value: object) -> object:
    """A name of a ramp, or a table of (s, factor) with s rising within [0, 1]."""
    if isinstance(value, str):
        if value in RAMPS:
            return value
        raise problem(
            got=value, expected="a ramp", cure=did_you_mean(value, RAMPS) + ", or a table [[s, factor], ...]"
        )
    table = "a table [[s, factor], ...] of at least two rows, s rising within [0, 1]"
    rows = value if isinstance(value, tuple) else ()
    whole = len(rows) >= 2 and all(
        isinstance(row, tuple) and len(row) == 2 and all(map(_is_number, row)) for row in rows
    )
    if not whole:
        raise problem(
            expected=f'"linear", "cosine", "constant" or {table}', cure="such as [[0, 0], [0.5, 1], [1, 0]]"
        )
    s = [row[0] for row in rows]
    if not (s[0] >= 0 and s[-1] <= 1 and all(a < b for a, b in zip(s, s[1:], strict=False))):
        raise problem(
            "s is not rising within [0, 1]", got=s, expected=table, cure="sort the rows, each s once"
        )
    return value


def _direction(value: object) -> Direction:
    """`group.axis`; a group's name may hold dots, so the last one counts."""
    group, _, axis = value.rpartition(".") if isinstance(value, str) else ("", "", "")
    if not group or axis not in AXES:
        raise problem(expected='"group.axis"', cure='such as "top.z": a group, a dot, then x, y or z')
    return Direction(group, axis)


def _points(value: object) -> object:
    """One point alone is a list of one."""
    return (value,) if isinstance(value, tuple) and len(value) == 3 and all(map(_is_number, value)) else value


def _each_once(kind: str) -> Callable[[tuple], tuple]:
    def check(values: tuple) -> tuple:
        twice = next((value for value in values if values.count(value) > 1), None)
        if twice is not None:
            raise problem(
                f"{twice!r} twice", got=values, expected=f"each {kind} once", cure="drop one of them"
            )
        return values

    return check


RampKey = Annotated[Ramp, BeforeValidator(_ramp)]
DirectionKey = Annotated[Direction, PlainValidator(_direction)]
Points = Annotated[tuple[Vector, ...], BeforeValidator(_points), Field(min_length=1)]
Axes = Annotated[tuple[Axis, ...], AfterValidator(_each_once("axis"))]
Fixed = Annotated[tuple[Axis | Literal["normal"], ...], AfterValidator(_each_once("direction"))]
Name = Annotated[str, Field(min_length=1)]
