"""Changes to a case before it is checked: `--set constraint.top.fix=[]` (`--set dynamics.step=` removes the key), and
PETSc options after `--`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from typing import Any

from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.input.messages import entry_label
from ancf_petsc.input.schema import CaseSpec

SET = "--set"
PART = re.compile(r'"(?P<quoted>(?:[^"\\]|\\.)*)"|\'(?P<literal>[^\']*)\'|(?P<bare>[^."\'=\s]+)')
BARE_WORD = re.compile(r"[^\s\"'\[\]{}=,#][^\"'\[\]{}=,#\n]*")
TEXTS = {("mesh", "element"), ("mesh", "file"), ("title",), ("units",)}


def apply_settings(data: dict[str, Any], settings: Iterable[str]) -> None:
    """Apply `path=value` texts to the tables of a case, in order; `path=` alone takes the key away."""
    for setting in settings:
        keys, rest = split_path(setting)
        if not rest.startswith("="):
            raise CaseError(
                file=SET, got=setting, expected="key=value", cure="such as --set material.law=neo_hooke"
            )
        text = rest[1:].strip()
        if text:
            set_value(data, keys, _value(keys, text))
        else:
            remove_value(data, keys)


def split_path(text: str) -> tuple[tuple[str, ...], str]:
    """The names of a dotted path at the head of `text`, quoted ones without quotes, and what follows it."""
    names: list[str] = []
    position = 0
    while found := PART.match(text, position):
        quoted = found["quoted"]
        names.append(_unquoted(quoted) if quoted is not None else found["literal"] or found["bare"] or "")
        position = found.end()
        if not text.startswith(".", position):
            break
        position += 1
    if not names or text[position - 1] == ".":
        raise CaseError(
            file=SET, got=text, expected="a dotted path to a key", cure="such as --set material.law=neo_hooke"
        )
    return tuple(names), text[position:].strip()


def _unquoted(text: str) -> str:
    try:
        return tomllib.loads(f'text = "{text}"')["text"]
    except tomllib.TOMLDecodeError:
        return text


def _value(keys: tuple[str, ...], text: str) -> Any:
    """The TOML value of `text`; a word that is none is text, so are numbers where codes or names stand."""
    try:
        tables = tomllib.loads(f"value = {text}")
        value = tables["value"] if len(tables) == 1 else None
    except (tomllib.TOMLDecodeError, RecursionError):
        value = text if text and (keys in TEXTS or BARE_WORD.fullmatch(text)) else None
    if value is None:
        raise CaseError(
            file=SET,
            key=".".join(keys),
            got=text,
            expected="a TOML value",
            cure="such as 1e-3, neo_hooke, '[0, 0, -9.81]' or '{ z = -0.025 }'; quote it for the shell",
        )
    return text if keys in TEXTS and not isinstance(value, str | list | dict) else value


def set_value(data: dict[str, Any], keys: Sequence[str], value: Any) -> None:
    """Put `value` at the end of the path `keys`; None takes the key away.

    Entries of arrays go by their name or group, or by index from 0. Tables on the path are made when the
    format knows them. Raises CaseError for a path that leads nowhere.
    """
    place: Any = data
    for depth, name in enumerate(keys[:-1]):
        here = keys[: depth + 1]
        if isinstance(place, dict):
            if name not in place:
                place[name] = _new_table(data, here)
            place = place[name]
        elif isinstance(place, list):
            place = place[_index(place, here)]
        else:
            raise _nowhere(keys[:depth], f"is no table: it holds {place!r}")
    _assign(place, keys, value)


def remove_value(data: dict[str, Any], keys: Sequence[str]) -> None:
    """Remove the key, table or entry at the end of the path `keys`. Raises CaseError where there is none."""
    place: Any = data
    for depth in range(len(keys)):
        here = keys[: depth + 1]
        if isinstance(place, list):
            key: Any = _index(place, here)
        elif isinstance(place, dict) and keys[depth] in place:
            key = keys[depth]
        else:
            there = tuple(place) if isinstance(place, dict) else ()
            raise CaseError(
                "nothing to remove: the case has no such key",
                file=SET,
                key=".".join(here),
                expected="a key of the case; key= without a value removes it",
                cure=did_you_mean(keys[depth], there),
            )
        if depth < len(keys) - 1:
            place = place[key]
    del place[key]


def _assign(place: Any, keys: Sequence[str], value: Any) -> None:
    if isinstance(place, list):
        where: Any = _index(place, keys)
    elif isinstance(place, dict):
        where = keys[-1]
    else:
        raise _nowhere(keys[:-1], f"is no table: it holds {place!r}")
    if value is not None:
        place[where] = value
    elif isinstance(place, list) or where in place:
        del place[where]


def _new_table(data: dict[str, Any], keys: Sequence[str]) -> dict[str, Any]:
    arrays = ("constraint", "load", "probe")
    known = tuple(name for name in CaseSpec.model_fields if name not in arrays)
    if len(keys) == 1 and keys[0] not in known:
        if keys[0] in arrays:
            raise CaseError(
                "the case has none",
                file=SET,
                key=keys[0],
                expected=f"a [[{keys[0]}]] in the file",
                cure="add it there",
            )
        raise CaseError(
            "unknown key", file=SET, key=keys[0], cure=did_you_mean(keys[0], tuple(CaseSpec.model_fields))
        )
    return {}


def _nowhere(keys: Sequence[str], what: str) -> CaseError:
    return CaseError(
        what, file=SET, key=".".join(keys), expected="a table on the path", cure="shorten the path"
    )


def _index(entries: list[Any], keys: Sequence[str]) -> int:
    """Which entry of an array the last of `keys` means."""
    name = keys[-1]
    labels = [entry_label(entry) for entry in entries]
    count = labels.count(name)
    if count == 1:
        return labels.index(name)
    listing = [label or str(index) for index, label in enumerate(labels)]
    if count > 1:
        places = [str(index) for index, label in enumerate(labels) if label == name]
        raise CaseError(
            f"{count} entries are called {name!r}",
            file=SET,
            key=".".join(keys),
            expected="one entry",
            cure=f"use the index: {' or '.join(places)}",
        )
    if name.isdecimal() and int(name) < len(entries):
        return int(name)
    raise CaseError(
        f"no entry {name!r}",
        file=SET,
        key=".".join(keys),
        expected=f"a name, a group or an index from 0 to {len(entries) - 1}",
        cure=did_you_mean(name, tuple(listing)),
    )


def petsc_table(options: Sequence[str]) -> dict[str, Any]:
    """The options of a PETSc command line, `-name value` or `-name` alone, as the keys of [petsc]."""
    table: dict[str, Any] = {}
    name = ""
    for word in options:
        if re.match(r"-[^\d.]", word):
            name = word.lstrip("-")
            table[name] = True
        elif not name:
            raise CaseError(
                file="--", got=word, expected="PETSc options", cure="such as -- -ksp_type cg -ksp_rtol 1e-8"
            )
        else:
            table[name], name = word, ""
    return table
