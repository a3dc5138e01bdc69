"""Large-deformation solids in absolute nodal coordinates, in parallel, on PETSc.

import ancf_petsc as ancf
case = ancf.load_case("cases/pvc_block").with_changes({"material.law": "neo_hooke"})
run = ancf.run(case, "results/neo_hooke")
print(run.curve["force"])
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from ancf_petsc.input.load import Case
    from ancf_petsc.results.reader import Results

# Where colorama is installed, numba lets it write an escape code to terminals at the end of every process.
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")

# Names are looked up when they are used: importing the package costs nothing.
_HOMES = {
    "Case": "ancf_petsc.input.load",
    "load_case": "ancf_petsc.input.load",
    "case_from_dict": "ancf_petsc.input.load",
    "case_of_run": "ancf_petsc.analysis.provenance",
    "Results": "ancf_petsc.results.reader",
    "open_results": "ancf_petsc.results.reader",
    "AncfError": "ancf_petsc.errors",
    "CaseError": "ancf_petsc.errors",
    "EnvironmentProblem": "ancf_petsc.errors",
    "Interrupted": "ancf_petsc.errors",
    "MeshError": "ancf_petsc.errors",
    "NoEquilibrium": "ancf_petsc.errors",
    "study": "ancf_petsc.studies.drawn",
}
__all__ = ["run", *_HOMES]


def run(
    case: Case,
    folder: str | Path | None = None,
    *,
    force: bool = False,
    restart: bool = False,
    extend: bool = False,
) -> Results:
    """Solve a case, on all ranks of the program, and open its results.

    folder: where the results go, default results/NAME. force: overwrite a folder that holds something else. restart: go on
    from the last checkpoint in the folder, or start where there is none. extend: though the case now asks for a longer duration,
    more outputs or other options of PETSc.
    Raises CaseError, NoEquilibrium, Interrupted.
    """
    from ancf_petsc.analysis.run import run_case
    from ancf_petsc.results.reader import open_results

    return open_results(run_case(case, folder, force=force, restart=restart, extend=extend))


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
