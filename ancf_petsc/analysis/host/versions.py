"""Versions of what a result depends on."""

from __future__ import annotations

import platform
import re
from importlib.metadata import PackageNotFoundError, version


def program_version() -> str:
    """The version of this program."""
    try:
        return version("ancf_petsc")
    except PackageNotFoundError:
        return "unknown"


def mpi_version(said: str) -> str:
    """Name and version in what an MPI library says of itself: Open MPI a sentence, MPICH a table."""
    first = re.split(r"[,\n\x00]", said.strip())[0]
    return " ".join(first.replace("Version:", "").split())


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
        "mpi": mpi_version(MPI.Get_library_version()),
        "numpy": numpy.__version__,
        "numba": numba.__version__,
        "h5py": h5py.__version__,
        "machine": f"{platform.system()} {platform.machine()}",
    }
