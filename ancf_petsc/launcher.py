"""Starting programs on several ranks: mpiexec, and the environment it needs on any machine."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from ancf_petsc.errors import EnvironmentProblem

OF_A_LAUNCHER = ("OMPI_COMM_", "OMPI_UNIVERSE", "OMPI_FIRST", "PMIX_", "PMI_")


FOR_ONE = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_pml": "ob1",
    "OMPI_MCA_btl": "self",
    "OMPI_MCA_osc": "^ucx",
}
"""What keeps Open MPI from a daemon and from looking for networks; other MPIs do not read it."""


@contextmanager
def quick_if_alone() -> Iterator[None]:
    """Around the import of mpi4py, which starts MPI: a process that no launcher started needs no way to others.

    The environment is afterwards what it was, for processes started from this one. What is set already stays.
    """
    launched = any(name.startswith(OF_A_LAUNCHER) for name in os.environ)
    added = [] if launched else [name for name in FOR_ONE if name not in os.environ]
    os.environ.update((name, FOR_ONE[name]) for name in added)
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]


def environment() -> dict[str, str]:
    """This process's environment for ranks of their own: containers run as root and may have one core."""
    own = {name: value for name, value in os.environ.items() if not name.startswith(OF_A_LAUNCHER)}
    allowed = {
        "OMP_NUM_THREADS": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    }
    if os.geteuid() == 0:
        allowed |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return own | allowed


def on_ranks(count: int, command: Sequence[str]) -> list[str]:
    """The command on `count` ranks; one rank needs no launcher. Raises EnvironmentProblem without mpiexec."""
    if count == 1:
        return list(command)
    launcher = shutil.which("mpiexec")
    if launcher is None:
        raise EnvironmentProblem("mpiexec was not found: install Open MPI or MPICH")
    return [launcher, "-n", str(count), *command]
