"""From what pydantic found to one line a user understands: file, key, found, expected, cure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from json import dumps
from pathlib import Path
from reprlib import Repr
from types import NoneType, UnionType
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.input.loads import LOADS
from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.input.toml import BARE

LONGEST = 80
ABSENT = object()
FORMAT_PAGE = "docs/case-format.md has examples"

KeyPath = tuple[str | int, ...]


class Place(NamedTuple):
    """Where in the case a problem is: the path to it, the value there, the key's field and its table."""

    path: KeyPath
    value: Any
    field: FieldInfo | None
    table: type[BaseModel]


def case_error(
    error: ValidationError,
    data: dict[str, Any],
    source: dict[str, Any],
    file: str | Path | None,
    root: type[BaseModel],
    page: str = FORMAT_PAGE,
) -> CaseError:
    """The first problem of `error` as a CaseError; misspelt keys first: they explain what is missing.

    data: the case as pydantic saw it, lists as tuples; source: the same, a lone [material] not in an array.
    root: the table that was checked. page: the cure where nothing nearer is known.
    """
    found: dict[str, CaseError] = {}
    hidden = 0
    for detail in sorted(
        error.errors(include_url=False), key=lambda detail: detail["type"] != "extra_forbidden"
    ):
        problem = _translate(detail, data, source, file, root, page)
        found.setdefault(str(problem.key), problem)
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
    detail: Mapping[str, Any],
    data: dict[str, Any],
    source: dict[str, Any],
    file: str | Path | None,
    root: type[BaseModel],
    page: str,
) -> CaseError:
    kind, context = detail["type"], detail.get("ctx", {})
    place = _below(_place(detail["loc"], data, root), context.get("at", ()))
    path, got = place.path, place.value
    what, (expected, _, cure) = "", ((place.field and place.field.description) or "").partition("; ")
    if kind == "problem":
        what = context["what"]
        got = context["got"] if what or context["got"] is not None else got
        expected, cure = context["expected"] or expected, context["cure"] or cure
    elif kind == "extra_forbidden":
        what, got, expected = "unknown key", None, ""
        cure = did_you_mean(str(path[-1]), tuple(place.table.model_fields))
    elif "[key]" in detail["loc"]:
        what, got, expected, cure = "unknown key", None, f"one of {', '.join(AXES)}", cure
    elif kind.startswith("union_tag"):
        path, got = (*path, "type"), got.get("type", ABSENT)
        expected, cure = " or ".join(f'"{name}"' for name in LOADS), _nearest(got, LOADS)
    elif options := _options_of(place.field):
        cure = _nearest(got, options)
    if got is ABSENT:
        what, got = what or "missing", None
    key = written(path, source)
    return CaseError(what, file=file, key=key, got=shown(got), expected=expected, cure=cure or page)


def _nearest(got: Any, known: tuple[str, ...]) -> str:
    return did_you_mean(got, known) if isinstance(got, str) else f"there are: {', '.join(known)}"


def _place(loc: Sequence[str | int], data: dict[str, Any], root: type[BaseModel]) -> Place:
    """Follow pydantic's location through the data, as far as a key whose value is named as a whole.

    Names of union branches, which pydantic mixes in, are left out.
    """
    path: KeyPath = ()
    value: Any = data
    annotation: Any = root
    field: FieldInfo | None = None
    table: type[BaseModel] = root
    for position, item in enumerate(loc):
        last = position == len(loc) - 1
        table_here = isinstance(value, dict)
        inside = item in value if table_here else isinstance(value, tuple) and item in range(len(value))
        if not inside and not (last and table_here):
            continue
        inner = _step(annotation, item, value)
        if inner is None:
            break
        annotation, key_field, owner = inner
        field, table = key_field or field, owner or table
        path, value = (*path, item), value[item] if inside else ABSENT
    return Place(path, value, field, table)


def _below(place: Place, path: KeyPath) -> Place:
    """The place that a check names itself, as far below the table it checked."""
    value = place.value
    for item in path:
        inside = isinstance(item, int) or (isinstance(value, dict) and item in value)
        value = value[item] if inside else ABSENT
    return place._replace(path=(*place.path, *path), value=value)


def _step(
    annotation: Any, item: str | int, value: Any
) -> tuple[Any, FieldInfo | None, type[BaseModel] | None] | None:
    """The annotation one item further, the key's field and its table; None inside a key's value."""
    annotation = _narrowed(annotation, value)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        field = annotation.model_fields.get(str(item))
        return (field.annotation if field else None), field, annotation
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is dict:
        return arguments[1], None, None
    if origin is tuple and isinstance(value[item], dict):
        return arguments[0], None, None
    return None


def _narrowed(annotation: Any, value: Any) -> Any:
    """The annotation without None, and of several tables the one that the key `type` names."""
    if hasattr(annotation, "__metadata__"):
        return _narrowed(annotation.__origin__, value)
    if get_origin(annotation) not in (Union, UnionType):
        return annotation
    choices = [choice for choice in get_args(annotation) if choice is not NoneType]
    if len(choices) == 1:
        return _narrowed(choices[0], value)
    typed = [choice for choice in choices if "type" in getattr(choice, "model_fields", ())]
    named = (c for c in typed if value.get("type") in get_args(c.model_fields["type"].annotation))
    return next(named, None)


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


def written(path: KeyPath, data: Any) -> str:
    """The path to a key with dots, entries of arrays by their name or group where that is theirs alone.

    It is what --set takes.
    """
    names: list[str] = []
    for item in path:
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
