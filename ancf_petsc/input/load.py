"""A case: its checked specification and where it comes from."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.input import toml
from ancf_petsc.input.checks import check
from ancf_petsc.input.messages import case_error
from ancf_petsc.input.overrides import apply_settings, petsc_table, set_value, split_path
from ancf_petsc.input.schema import CaseSpec

CASE_FILE = "case.toml"


@dataclass(frozen=True)
class Case:
    """A case that has been checked.

    spec: what it says. file: where it was read, None for one made in a script. folder: what its file
    names refer to. name: the folder's name for NAME/case.toml, else the file's. text: the case as TOML,
    changes included.
    """

    spec: CaseSpec
    file: Path | None
    folder: Path
    name: str
    text: str

    def with_changes(self, changes: Mapping[str, Any]) -> Case:
        """The case with other values at dotted paths, such as {"material.law": "neo_hooke"}.

        None takes a key away. Raises CaseError.
        """
        data = toml.parse(self.text)
        for path, value in changes.items():
            keys, rest = split_path(path)
            if rest:
                raise CaseError(
                    got=path, expected="a dotted path to a key", cure='quote odd names: groups."a b".at'
                )
            set_value(data, keys, deepcopy(value))
        return _checked(data, self.file, self.folder, self.name)


def load_case(path: str | Path, overrides: Sequence[str] = (), petsc_options: Sequence[str] = ()) -> Case:
    """Read and check a case: a TOML file or a folder with case.toml.

    overrides: texts `key=value` as --set takes them. petsc_options: words such as ["-ksp_type", "cg"],
    stronger than the file's. Raises CaseError.
    """
    file = _case_file(Path(path))
    data = toml.read(file)
    _change(data, overrides, petsc_options)
    name = Path(os.path.realpath(file)).parent.name if file.name == CASE_FILE else file.stem
    return _checked(data, file, Path(os.path.realpath(file)).parent, name, _with_changes(file, overrides))


def case_from_text(
    text: str,
    source: Path,
    folder: Path,
    name: str,
    overrides: Sequence[str] = (),
    petsc_options: Sequence[str] = (),
) -> Case:
    """A case from TOML text that `source`, named in messages, holds; file names refer to `folder`. Raises CaseError."""
    data = toml.parse(text, source)
    _change(data, overrides, petsc_options)
    return _checked(data, source, folder, name, _with_changes(source, overrides))


def _change(data: dict[str, Any], overrides: Sequence[str], petsc_options: Sequence[str]) -> None:
    apply_settings(data, overrides)
    if petsc_options:
        for name, value in petsc_table(petsc_options).items():
            set_value(data, ("petsc", name), value)


def _with_changes(file: Path, overrides: Sequence[str]) -> str | Path:
    """The source of a case, for messages."""
    return f"{file} with --set {shlex.join(overrides)}" if overrides else file


def case_from_dict(data: Mapping[str, Any], folder: str | Path, name: str = "case") -> Case:
    """A case from the tables of a script; file names refer to `folder`. Raises CaseError."""
    return _checked(deepcopy(dict(data)), None, Path(folder).resolve(), name)


def _checked(
    data: dict[str, Any], file: Path | None, folder: Path, name: str, label: str | Path | None = None
) -> Case:
    refuse_nul(data, label or file or name)
    source = as_tuples(data)
    frozen = dict(source)
    if isinstance(source.get("material"), dict):
        frozen["material"] = (source["material"],)
    try:
        spec = CaseSpec.model_validate(frozen)
        check(spec)
    except ValidationError as error:
        raise case_error(error, frozen, source, label or file or name, CaseSpec) from None
    return Case(spec, file, folder, name, toml.write(data))


def as_tuples(value: Any) -> Any:
    """Lists as tuples, arrays as numbers: what is checked cannot change any more."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {name: as_tuples(inner) for name, inner in value.items()}
    return tuple(map(as_tuples, value)) if isinstance(value, list | tuple) else value


def refuse_nul(value: Any, file: str | Path, path: tuple[str, ...] = ()) -> None:
    """Raise CaseError for a text with a NUL character, which neither file names nor result files can hold."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            refuse_nul(str(name), file, (*path, str(name)))
            refuse_nul(inner, file, (*path, str(name)))
    elif isinstance(value, list | tuple):
        for index, inner in enumerate(value):
            refuse_nul(inner, file, (*path, str(index)))
    elif isinstance(value, str) and "\0" in value:
        raise CaseError(
            "a NUL character", file=file, key=".".join(path), got=value, expected="text", cure="remove it"
        )


def _case_file(path: Path) -> Path:
    if "\0" in str(path):
        raise CaseError("a NUL character in a path", got=str(path), expected="a case", cure="remove it")
    if os.path.isdir(path):
        if (path / CASE_FILE).is_file():
            return path / CASE_FILE
        others = ", ".join(sorted(file.name for file in path.glob("*.toml"))) or "none"
        again = f"a run is here: ancf run {shlex.quote(str(path))} --again repeats it"
        cure = again if (path / "results.h5").is_file() else f"*.toml here: {others}"
        raise CaseError(f"no {CASE_FILE} in this folder", file=path, expected=CASE_FILE, cure=cure)
    if os.path.isfile(path):
        return path
    raise CaseError(
        "no such file or folder",
        file=path,
        expected="a case",
        cure=did_you_mean(str(path), _neighbours(path)),
    )


def _neighbours(path: Path) -> tuple[str, ...]:
    """Cases beside `path`, above it and in ./cases."""
    places = dict.fromkeys((path.parent, path.parent.parent, Path("cases")))
    found = (case.parent for place in places if place.is_dir() for case in place.glob(f"*/{CASE_FILE}"))
    files = (file for file in path.parent.glob("*.toml") if file.name not in (CASE_FILE, "pyproject.toml"))
    return tuple(sorted(dict.fromkeys(str(case) for case in (*found, *files))))
