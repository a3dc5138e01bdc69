"""What is missing where a Python package cannot be imported, and where to get it."""

from __future__ import annotations

import sys

from ancf_petsc.errors import EnvironmentProblem

SOLVERS = ("mpi4py", "petsc4py", "slepc4py")
FROM_WHERE = (
    f"computing needs {', '.join(SOLVERS)} with one MPI library: run scripts/setup in a clone of the project (Debian, Ubuntu), "
    "or use its environment.yml (conda-forge); ancf plot and ancf view read results without them"
)


def import_problem(error: ImportError, verb: str) -> EnvironmentProblem | None:
    """One line on a package that is missing or cannot be loaded; None where the fault is this program's own.

    verb: the verb that was to run.
    """
    name = (error.name or "").partition(".")[0]
    if name == "ancf_petsc":
        return None
    missing = isinstance(error, ModuleNotFoundError)
    what = (
        f"the Python package {name} is missing"
        if missing
        else f"{name or 'a Python package'} cannot be loaded: {error}"
    )
    if name in SOLVERS:
        cure = FROM_WHERE
    elif missing:
        cure = f"install it: python -m pip install {name}"
    else:
        cure = (
            "install the versions that pyproject.toml asks for: scripts/setup in a clone of the project does"
        )
    return EnvironmentProblem(f"ancf {verb}: {what} in {sys.prefix}; {cure}")
