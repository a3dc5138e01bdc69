"""`ancf run`: solves a case."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from ancf_petsc.launcher import quick_if_alone

HELP = "solve a case; under mpiexec -n N on N ranks"
PETSC_OPTIONS = True


def add_case_arguments(parser: argparse.ArgumentParser) -> None:
    """The case and its changes, as several verbs take them."""
    parser.add_argument("case", metavar="CASE", type=Path, help="a case file, or a folder with case.toml")
    parser.add_argument(
        "--set",
        dest="changes",
        metavar="KEY=VALUE",
        action="append",
        nargs="+",
        default=[],
        help="change keys of the case: material.law=neo_hooke constraint.top.fix=[]",
    )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case_arguments(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the results go (default results/NAME)")
    parser.add_argument("--force", action="store_true", help="overwrite a folder that holds something else")
    volume = parser.add_mutually_exclusive_group()
    volume.add_argument(
        "--quiet", action="store_const", dest="verbosity", const=-1, default=0, help="warnings only"
    )
    volume.add_argument("--verbose", action="store_const", dest="verbosity", const=1, help="details too")


def changes(arguments: argparse.Namespace) -> list[str]:
    """All KEY=VALUE of a command line."""
    return [change for group in arguments.changes for change in group]


def execute(arguments: argparse.Namespace) -> int:
    begun = time.perf_counter()
    with quick_if_alone():
        from mpi4py import MPI

    from ancf_petsc import log
    from ancf_petsc.analysis.run import run_case
    from ancf_petsc.input.load import load_case
    from ancf_petsc.parallel.exchange import on_root

    comm = MPI.COMM_WORLD
    log.configure(rank=comm.rank, verbosity=arguments.verbosity)
    imports = time.perf_counter() - begun
    read = on_root(comm, lambda: load_case(arguments.case, changes(arguments), arguments.petsc_options))
    case = comm.bcast(read)
    with log.progress(1.0, "of the path" if case.spec.statics else "of the motion") as bar:
        folder = run_case(
            case, arguments.out, comm=comm, force=arguments.force, imports=imports, watch=bar.advance_to
        )
    if comm.rank == 0 and arguments.verbosity >= 0:
        print(f"results in {folder}; ancf plot {folder} draws the curves, ancf view {folder} shows the body")
    return 0
