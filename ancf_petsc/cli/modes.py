"""`ancf modes`: the first natural frequencies of a case's body and their shapes."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path

from ancf_petsc.cli.run import add_case_arguments, changes
from ancf_petsc.errors import CaseError
from ancf_petsc.launcher import quick_if_alone

HELP = "natural frequencies and shapes of a case's body"
PETSC_OPTIONS = True


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case_arguments(parser)
    parser.add_argument("--count", type=int, default=10, metavar="N", help="how many modes (default 10)")
    parser.add_argument("--loaded", action="store_true", help="of the body at rest under its loads")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where the shapes go (default results/NAME_modes)"
    )
    parser.add_argument("--force", action="store_true", help="overwrite a folder that holds something else")


def execute(arguments: argparse.Namespace) -> int:
    with quick_if_alone():
        from mpi4py import MPI

    from ancf_petsc import log
    from ancf_petsc.cli.console import show_table
    from ancf_petsc.input.load import load_case
    from ancf_petsc.launcher import start_petsc
    from ancf_petsc.parallel.exchange import on_root

    if arguments.count < 1:
        raise CaseError(file="ancf modes", key="--count", got=arguments.count, expected="a whole number >= 1")
    comm = MPI.COMM_WORLD
    log.configure(rank=comm.rank)
    read = on_root(comm, lambda: load_case(arguments.case, changes(arguments), arguments.petsc_options))
    case = comm.bcast(read)
    start_petsc(case.spec.petsc)
    from ancf_petsc.analysis.modes import find_modes

    folder = arguments.out or Path("results") / f"{case.name}_modes"
    rows = find_modes(
        case, folder, arguments.count, loaded=arguments.loaded, force=arguments.force, comm=comm
    )
    if comm.rank == 0:
        title = "modes of the body under its loads" if arguments.loaded else "modes of the unloaded body"
        columns = ("mode", "frequency", "period", "omega", "alpha = 4 pi / T")
        show_table(columns, [_shown(row) for row in rows], title=title)
        print(f"shapes in {folder}; ancf view {shlex.quote(str(folder))} shows them one by one")
    return 0


def _shown(row: Sequence[float]) -> tuple[object, ...]:
    """A row of the table; of a mode that grows, how fast."""
    number, *vibration, growth = map(float, row)
    return (
        (int(number), f"unstable: exp({growth:.6g} t)", "", "", "") if growth else (int(number), *vibration)
    )
