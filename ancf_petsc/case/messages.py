"""From what pydantic found to one line a user understands: file, key, found, expected, cure."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from json import dumps
from pathlib import Path
from reprlib import Repr
from types import UnionType
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ancf_petsc.case.schema import CaseSpec
from ancf_petsc.errors import CaseError, did_you_mean

BARE = re.compile(r"[A-Za-z0-9_-]+")
LONGEST = 80
ABSENT = object()
FORMAT_PAGE = "docs/case-format.md has examples"

Way = tuple[str | int, ...]


class Place(NamedTuple):
    """Where in the case a problem is: the way to it, the value there, the key's description, the table around it."""

    way: Way
    value: Any
    field: FieldInfo | None
    table: type[BaseModel]


def case_error(
    error: ValidationError, data: dict[str, Any], source: dict[str, Any], file: str | Path | None
) -> CaseError:
    """The first problem of `error` as a CaseError; misspelt keys come first, for what is missing is then clear.

    data: the case as pydantic saw it, lists as tuples; source: the same, a lone [material] not in an array.
    """
    found: dict[str, CaseError] = {}
    hidden = 0
    for detail in sorted(
        error.errors(include_url=False), key=lambda detail: detail["type"] != "extra_forbidden"
    ):
        told = _translate(detail, data, source, file)
        found.setdefault(str(told.key), told)
        hidden += detail.get("ctx", {}).get("more", 0)
    first, others = next(iter(found.values())), len(found) - 1 + hidden
    if others:
        first = CaseError(
            first.problem,
            file=first.file,
            key=first.key,
            got=first.got,
            expected=first.expected,
            cure=f"{first.cure} (and {others} more)",
        )
    return first


def _translate(
    detail: Mapping[str, Any], data: dict[str, Any], source: dict[str, Any], file: str | Path | None
) -> CaseError:
    kind, context = detail["type"], detail.get("ctx", {})
    own = kind == "problem"
    place = _place((*detail["loc"], *(context["at"] if own else ())), data)
    expected, _, cure = ((place.field.description if place.field else "") or "").partition("; ")
    what, got = "", place.value
    if own:
        what, got = context["what"], context["got"]
        expected, cure = context["expected"] or expected, context["cure"] or cure
        if got is None and not what and place.value is not ABSENT:
            got = place.value
    elif kind == "extra_forbidden" or "[key]" in detail["loc"]:
        known = tuple(place.table.model_fields) if kind == "extra_forbidden" else ("x", "y", "z")
        what, got, expected, cure = "unknown key", None, "", did_you_mean(str(place.way[-1]), known)
    elif kind in ("union_tag_invalid", "union_tag_not_found"):
        got, tags = place.value.get("type", ABSENT), ("gravity", "force")
        place = place._replace(way=(*place.way, "type"))
        expected, cure = (
            '"gravity" or "force"',
            did_you_mean(got, tags) if isinstance(got, str) else f'such as "{tags[0]}"',
        )
    elif options := _options_of(place.field):
        cure = did_you_mean(got, options) if isinstance(got, str) else f"one of {', '.join(options)}"
    if got is ABSENT:
        what, got = what or "missing", None
    return CaseError(
        what,
        file=file,
        key=written(place.way, source),
        got=shown(got),
        expected=expected,
        cure=cure or FORMAT_PAGE,
    )


def _place(loc: Sequence[str | int], data: dict[str, Any]) -> Place:
    """Follow pydantic's location through the data, leaving out names of union branches; stop inside a key's value."""
    way: Way = ()
    value: Any = data
    annotation: Any = CaseSpec
    field: FieldInfo | None = None
    table: type[BaseModel] = CaseSpec
    for position, item in enumerate(loc):
        last = position == len(loc) - 1
        inside = (
            (item in value)
            if isinstance(value, dict)
            else isinstance(value, tuple) and item in range(len(value))
        )
        if not inside and not (last and isinstance(value, dict)):
            continue
        inner = _step(annotation, item, value)
        if inner is None:
            break
        annotation, key_field, owner = inner
        field, table = key_field or field, owner or table
        way, value = (*way, item), value[item] if inside else ABSENT
    return Place(way, value, field, table)


def _step(
    annotation: Any, item: str | int, value: Any
) -> tuple[Any, FieldInfo | None, type[BaseModel] | None] | None:
    """The annotation one item further, the key's field and its table; None inside a value that is told as a whole."""
    if hasattr(annotation, "__metadata__"):
        return _step(annotation.__origin__, item, value)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        field = annotation.model_fields.get(str(item))
        return (field.annotation if field else None), field, annotation
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is dict:
        return arguments[1], None, None
    if origin is tuple and list(_tables(arguments[0])):
        return arguments[0], None, None
    if origin in (Union, UnionType):
        tables = list(_tables(annotation))
        whole = [table for table in tables if not _is_value(table, arguments)]
        fits = [
            t
            for t in whole
            if len(whole) == 1 or value.get("type") in get_args(t.model_fields["type"].annotation)
        ]
        inner = (
            fits[0]
            if fits
            else next((a for a in arguments if get_origin(a) is tuple and list(_tables(a))), None)
        )
        return _step(inner, item, value) if inner is not None else None
    return None


def _is_value(table: type[BaseModel], arguments: tuple) -> bool:
    """Whether a table is only one of several ways to write a value, as in damping = { critical = 1 }."""
    return any(other is not type(None) and not list(_tables(other)) for other in arguments)


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and get_origin(annotation) is None:
        if issubclass(annotation, BaseModel):
            yield annotation
        return
    for argument in get_args(annotation):
        yield from _tables(argument)


def _options_of(field: FieldInfo | None) -> tuple[str, ...]:
    """The words a key takes when it takes nothing else."""
    plain = field is not None and get_origin(field.annotation) is Literal
    return tuple(word for word in get_args(field.annotation) if isinstance(word, str)) if plain else ()  # type: ignore[union-attr]


def shown(value: Any) -> Any:
    """A value as the user wrote it, lists again, and cut when it is long."""
    value = _lists(value)
    brief = Repr()
    brief.maxstring = brief.maxother = LONGEST
    return _Brief(brief.repr(value)) if len(repr(value)) > LONGEST else value


class _Brief(str):
    def __repr__(self) -> str:
        return str(self)


def _lists(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _lists(inner) for name, inner in value.items()}
    return [_lists(inner) for inner in value] if isinstance(value, tuple) else value


def written(way: Way, data: Any) -> str:
    """The way to a key with dots, entries of arrays by their name or group where that is theirs alone.

    It is what --set takes.
    """
    names: list[str] = []
    for item in way:
        if isinstance(item, str):
            names.append(_quoted(item))
            data = data.get(item) if isinstance(data, dict) else None
        elif isinstance(data, tuple):
            names.append(entry_name(data, item))
            data = data[item]
    return ".".join(names)


def entry_name(entries: Sequence[Any], index: int) -> str:
    """The name or group of an array's entry if no other has it, else its index."""
    labels = [entry_label(entry) for entry in entries]
    label = labels[index]
    if label is None or labels.count(label) > 1:
        return str(index)
    return _quoted(label)


def _quoted(name: str) -> str:
    return name if BARE.fullmatch(name) else dumps(name, ensure_ascii=False)


def entry_label(entry: Any) -> str | None:
    """`name` or `group` of an entry, if it has one."""
    if not isinstance(entry, dict):
        return None
    label = entry.get("name", entry.get("group"))
    return label if isinstance(label, str) else None
