"""A study: what its file says, and the case it changes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ancf_petsc.errors import CaseError
from ancf_petsc.input import toml
from ancf_petsc.input.load import CASE_FILE, Case, load_case
from ancf_petsc.studies.spec import StudySpec, check_study

STUDY_FILE = "study.toml"


@dataclass(frozen=True)
class Study:
    """A study that has been checked. name: of its default folder. base: the case before its changes."""

    spec: StudySpec
    file: Path
    folder: Path
    name: str
    base: Case

    @property
    def case_file(self) -> Path:
        """The file of the base case."""
        assert self.base.file is not None
        return self.base.file


def load_study(path: str | Path) -> Study:
    """Read and check a study: a TOML file or a folder with study.toml. Raises CaseError."""
    path = Path(path)
    if "\0" in str(path):
        raise CaseError("a NUL character in a path", got=str(path), expected="a study", cure="remove it")
    file = path / STUDY_FILE if path.is_dir() else path
    if not file.exists():
        cure = f"name a file, or a folder that holds {STUDY_FILE}"
        raise CaseError("there is no such file", file=file, expected="a study file", cure=cure)
    data = toml.read(file)
    if "case" not in data and "mesh" in data:
        raise CaseError(
            "this is a case, not a study",
            file=file,
            cure=f"solve it by ancf run, or write a study of it: case = {file.name!r}",
        )
    spec = check_study(data, file)
    folder = file.resolve().parent
    base = folder / spec.case
    if not base.exists():
        raise CaseError("there is no such file", file=file, key="case", got=spec.case, expected="a case file")
    name = folder.name if file.name == STUDY_FILE else file.stem
    return Study(spec, file, folder, name, load_case(base / CASE_FILE if base.is_dir() else base))
