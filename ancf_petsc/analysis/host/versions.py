"""Versions of what a result depends on."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version


def program_version() -> str:
    """The version of this program."""
    try:
        return version("ancf_petsc")
    except PackageNotFoundError:
        return "unknown"


def versions() -> dict[str, str]:
    """Name -> version of the program and of what computes its numbers."""
    import h5py
    import numba
    import numpy
    from mpi4py import MPI
    from petsc4py import PETSc

    return {
        "ancf_petsc": program_version(),
        "python": platform.python_version(),
        "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
        "mpi": MPI.Get_library_version().split(",")[0].split("\n")[0].strip("\x00"),
        "numpy": numpy.__version__,
        "numba": numba.__version__,
        "h5py": h5py.__version__,
        "machine": f"{platform.system()} {platform.machine()}",
    }
