"""TOML: reading with messages that say where, and writing a case back."""

from __future__ import annotations

import re
import tomllib
from datetime import date, datetime, time
from json import dumps
from pathlib import Path
from typing import Any

from ancf_petsc.errors import CaseError

BARE = re.compile(r"[A-Za-z0-9_-]+")
PLACE = re.compile(
    r"^(?P<what>.*) \(at (?P<where>line (?P<line>\d+), column \d+|end of document)\)$", re.DOTALL
)


def parse(text: str, file: str | Path | None = None) -> dict[str, Any]:
    """The tables of a TOML text. Raises CaseError with line, column and what is wrong."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = PLACE.match(str(error))
        what, where = (found["what"], found["where"]) if found else (str(error), None)
        number = int(found["line"]) if found and found["line"] else 0
        line = text.splitlines()[number - 1].strip() if 0 < number <= len(text.splitlines()) else None
        raise CaseError(
            f"not valid TOML: {what[:1].lower()}{what[1:]}",
            file=file,
            key=where,
            got=line,
            expected="key = value, [table] or [[table]]",
            cure="text stands in quotes, lists in brackets",
        ) from None
    except (RecursionError, ValueError) as error:
        raise CaseError(
            f"not valid TOML: {error}", file=file, expected="a case file", cure="see docs/case-format.md"
        ) from None


def read(file: Path) -> dict[str, Any]:
    """The tables of a TOML file. Raises CaseError when it cannot be read."""
    try:
        return parse(file.read_text(encoding="utf-8-sig"), file)
    except UnicodeDecodeError as error:
        raise CaseError(
            f"not a text file: byte {error.start} is not UTF-8",
            file=file,
            expected="a TOML file",
            cure="save it as UTF-8",
        ) from None
    except OSError as error:
        raise CaseError(
            f"cannot be read: {error.strerror}", file=file, cure="check the file and its rights"
        ) from None


def write(data: dict[str, Any]) -> str:
    """TOML text of `data`: values, a [table] for each dict, a [[table]] for each entry of a list of dicts."""
    plain = {name: value for name, value in data.items() if not _is_table(value)}
    blocks = [_pairs(plain)] if plain else []
    for name, value in data.items():
        if isinstance(value, dict):
            blocks.append(f"[{_key(name)}]\n{_pairs(value)}")
        elif _is_table(value):
            blocks.extend(f"[[{_key(name)}]]\n{_pairs(entry)}" for entry in value)
    return "\n".join(blocks)


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list | tuple) and len(value) > 0 and all(isinstance(entry, dict) for entry in value)
    )


def _pairs(table: dict[str, Any]) -> str:
    return "".join(f"{_key(name)} = {value_text(value)}\n" for name, value in table.items())


def _key(name: str) -> str:
    return name if BARE.fullmatch(name) else _text(name)


def _text(value: str) -> str:
    return dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def value_text(value: Any) -> str:
    """A value as it stands in a file, on one line."""
    if hasattr(
        value, "tolist"
    ):  # numpy's numbers and arrays; np.float64 is a float too, which numpy 2 writes in words
        return value_text(value.tolist())
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    if isinstance(value, dict):
        inner = ", ".join(f"{_key(name)} = {value_text(part)}" for name, part in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    raise CaseError(
        got=value, expected="a number, text, true or false, a list or a table", cure="convert it first"
    )
