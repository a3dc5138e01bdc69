"""What makes two runs the same: the effective case and its mesh, as one hash.

The same hash: other order of keys, other spelling of numbers (1e-3, 0.001), a default written out, the folder
moved, the mesh under another path. Another hash: any other value, any other byte of the mesh. PETSc options
that only report count for nothing.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from ancf_petsc.analysis.host.versions import program_version
from ancf_petsc.errors import MeshError
from ancf_petsc.input.load import Case
from ancf_petsc.launcher import is_general_option
from ancf_petsc.plan.case_mesh import mesh_file

SHORT = 16  # hexadecimal digits: 64 bits distinguish any number of runs
PACKAGE = Path(__file__).parents[1]
WITHOUT_NUMBERS = ("cli", "post", "bench", "studies", "advise", "export", "reduce")
"""Folders of the program that no number of a run comes from."""
BLOCK = 1 << 22  # bytes read at once
INCLUDES = {  # formats of several files: where a file names another, by the suffix of the first
    ".inp": re.compile(rb"^\*INCLUDE\s*,\s*INPUT\s*=\s*(?P<name>[^,\r\n]+)", re.IGNORECASE | re.MULTILINE),
    ".bdf": re.compile(rb"^INCLUDE\s+['\"]?(?P<name>[^'\"\r\n]+)", re.IGNORECASE | re.MULTILINE),
    ".xdmf": re.compile(rb">\s*(?P<name>[^<>:\r\n]+?):/", re.MULTILINE),
}
INCLUDES |= {".nas": INCLUDES[".bdf"], ".dat": INCLUDES[".bdf"], ".xmf": INCLUDES[".xdmf"]}


@dataclass(frozen=True)
class Identity:
    """Of a case: `case` and `mesh` are hashes on their own, to say which of them changed."""

    case: str
    mesh: str

    @cached_property
    def hash(self) -> str:
        """Of both: the same for runs that compute the same with one version of the program."""
        return _digest(f"{self.case} {self.mesh}".encode())[:SHORT]

    def of_program(self, version: str | None = None) -> str:
        """Of both and the program: the name of a run whose numbers may be used again. version: default that of this program, and its
        source as it is now.
        """
        program = version or f"{program_version()} {source_digest()}"
        return _digest(f"{self.case} {self.mesh} {program}".encode())[:SHORT]


@cache
def source_digest() -> str:
    """Of the program's files that numbers come from: between two releases they change under one version."""
    digest = sha256()
    for file in sorted(PACKAGE.glob("**/*.py")):
        place = file.relative_to(PACKAGE)
        if place.parts[0] not in WITHOUT_NUMBERS:
            digest.update(place.as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def identity(case: Case) -> Identity:
    """The identity of a case with all its changes. Raises MeshError where the mesh cannot be read."""
    return Identity(case_hash(case), mesh_hash(mesh_file(case)))


def case_hash(case: Case) -> str:
    """Of all values that the case has, but not of where its mesh lies."""
    return _digest(json.dumps(values_of(case), sort_keys=True, ensure_ascii=True).encode())


def values_of(case: Case) -> dict[str, Any]:
    """All values of a case that its numbers hang on, in one spelling; not where its mesh lies."""
    values = case.spec.model_dump(exclude_defaults=True, warnings=False)
    values["mesh"].pop("file", None)
    values.get("output", {}).pop("checkpoint", None)
    options = {name: value for name, value in case.spec.petsc.items() if not is_general_option(name)}
    values["petsc"] = {name: _as_number(value) for name, value in options.items()}
    return _canonical(values)


def mesh_hash(file: Path) -> str:
    """Of a mesh file's bytes and of those of the files it includes: of one file alone what sha256sum prints."""
    try:
        digests = [file_hash(part) for part in files_of(file)]
    except OSError as error:
        raise MeshError(f"cannot be read: {error.strerror}", file=error.filename or file) from error
    return digests[0] if len(digests) == 1 else _digest(" ".join(digests).encode())


def file_hash(file: Path) -> str:
    """SHA-256 of a file's bytes."""
    digest = sha256()
    with file.open("rb") as source:
        while block := source.read(BLOCK):
            digest.update(block)
    return digest.hexdigest()


def files_of(file: Path) -> list[Path]:
    """The mesh file and those it includes, each once, in the order in which they are named."""
    found = [file]
    for part in found:  # grows
        found += [other for other in _included(part) if other not in found]
    return found


def _included(file: Path) -> Iterator[Path]:
    pattern = INCLUDES.get(file.suffix.lower())
    if pattern is None:
        return
    for match in pattern.finditer(file.read_bytes()):
        name = match["name"].strip().strip(b"\"'").decode("utf-8", "replace")
        other = Path(os.path.realpath(file.parent / name))
        if os.path.isfile(other):
            yield other


def _canonical(value: Any) -> Any:
    """One spelling of a number, whole or not, and of nought; tables without what is empty."""
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return value
    if isinstance(value, int | float):
        return repr(float(value) + 0.0) if abs(value) <= 2**53 else repr(value)
    if isinstance(value, dict):
        inner = {str(name): _canonical(item) for name, item in value.items()}
        return {name: item for name, item in inner.items() if item != {}}
    return [_canonical(item) for item in value]


def _as_number(value: Any) -> Any:
    """A PETSc option from the command line is text, from the case a number: the same."""
    if not isinstance(value, str):
        return value
    if value.lower() in ("true", "false"):
        return value.lower() == "true"
    try:
        return float(value)
    except ValueError:
        return value


def _digest(text: bytes) -> str:
    return sha256(text).hexdigest()
