"""What a run says of itself: the effective case, its mesh, when, where and by what it was computed."""

from __future__ import annotations

import json
import logging
import os
import shlex
import socket
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ancf_petsc.analysis.host.versions import versions
from ancf_petsc.analysis.identity import Identity, identity
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case, case_from_text
from ancf_petsc.log import RECORD
from ancf_petsc.plan.case_mesh import mesh_file
from ancf_petsc.results.checkpoint_file import all_in
from ancf_petsc.results.tables import file_text

log = logging.getLogger(RECORD)

RECORDED = ("text", "file", "folder", "name", "mesh_file", "mesh_sha256")
"""What it takes to repeat a run."""


@dataclass(frozen=True)
class Provenance:
    """Of one run. command: the words that started it, quoted for a shell."""

    case: Case
    identity: Identity
    date: str
    host: str
    command: str
    ranks: int
    versions: dict[str, str]

    def summary(self) -> dict[str, Any]:
        """For summary.json."""
        return {
            "hash": self.identity.hash,
            "case": {
                "file": str(self.case.file.resolve()) if self.case.file else "",
                "folder": str(self.case.folder),
                "name": self.case.name,
                "text": self.case.text,
            },
            "mesh": {"file": str(mesh_file(self.case)), "sha256": self.identity.mesh},
            "date": self.date,
            "host": self.host,
            "command": self.command,
            "versions": self.versions,
        }

    def attributes(self) -> dict[str, str]:
        """For results.h5: one text each."""
        said = self.summary()
        case, mesh = said.pop("case"), said.pop("mesh")
        return {
            **{f"mesh_{name}": value for name, value in mesh.items()},
            **{f"case_{name}": value for name, value in case.items() if name != "text"},
            "case": case["text"],
            **{name: value if isinstance(value, str) else json.dumps(value) for name, value in said.items()},
            "ranks": str(self.ranks),
        }

    def write_log(self) -> None:
        """Lines for log.txt."""
        ranks = f"{self.ranks} rank{'s' * (self.ranks > 1)}"
        log.info("%s on %s, %s: %s", self.date, self.host, ranks, self.command)
        log.info("%s", ", ".join(f"{name} {version}" for name, version in self.versions.items()))
        log.info("mesh %s, sha256 %s", mesh_file(self.case), self.identity.mesh)
        log.info("case %s, hash %s; with all changes it reads", self.case.file or "", self.identity.hash)
        for line in self.case.text.splitlines():
            log.info("    %s", line)


def provenance_of(case: Case, ranks: int) -> Provenance:
    """Of a run of `case` that begins now in this process. Raises MeshError."""
    now = datetime.now().astimezone().isoformat("T", "seconds")
    words = [os.path.basename(sys.argv[0]) or "python", *sys.argv[1:]]
    return Provenance(case, identity(case), now, socket.gethostname(), shlex.join(words), ranks, versions())


def case_of_run(folder: str | Path, overrides: Sequence[str] = (), petsc_options: Sequence[str] = ()) -> Case:
    """The effective case that the run in a folder computed, with further changes. Raises CaseError.

    The mesh has to be the same, byte for byte, unless a change names another.
    """
    folder = Path(folder)
    said = _recorded(folder)
    source = Path(said["file"] or folder)
    case = case_from_text(said["text"], source, Path(said["folder"]), said["name"], overrides, petsc_options)
    file = mesh_file(case)
    if str(Path(said["mesh_file"])) != str(file):
        return case
    cure = "bring that file back, or name the mesh by --set mesh.file=FILE"
    if not file.is_file():
        raise CaseError("the mesh of this run is gone", file=file, key="--again", cure=cure)
    if identity(case).mesh != said["mesh_sha256"]:
        raise CaseError(
            "the mesh is not the one of this run any more",
            file=file,
            key="--again",
            expected=f"sha256 {said['mesh_sha256']}",
            cure=cure,
        )
    return case


def recorded_case(folder: Path, summary: Mapping[str, Any] | None = None) -> Case:
    """The effective case of the run in a folder, or of a summary, whatever became of its mesh. Raises CaseError."""
    said = _recorded(folder) if summary is None else _of_summary(summary)
    return case_from_text(said["text"], Path(said["file"] or folder), Path(said["folder"]), said["name"])


def _of_summary(said: Mapping[str, Any]) -> dict[str, str]:
    case, mesh = said["case"], said["mesh"]
    found = {**case, "mesh_file": mesh["file"], "mesh_sha256": mesh["sha256"]}
    return {name: str(found[name]) for name in RECORDED}


def _recorded(folder: Path) -> dict[str, str]:
    """text, file, folder, name, mesh_file, mesh_sha256 of a run: from its summary, or from a checkpoint or its results if it
    was cut short.
    """
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        return _of_summary(json.loads(file_text(folder / "summary.json")))
    with suppress(OSError, KeyError, IndexError):
        return _of_summary(all_in(folder)[0][0].about["run"])
    from ancf_petsc.results.reader import open_results

    facts = open_results(folder).facts
    found = {name: facts.get(name if name.startswith("mesh") else f"case_{name}") for name in RECORDED}
    found["text"] = facts.get("case")
    if None in found.values():
        raise CaseError(
            "this run did not record its case",
            file=folder,
            key="--again",
            cure="it is of an earlier version: run the case file",
        )
    return {name: str(found[name]) for name in RECORDED}
