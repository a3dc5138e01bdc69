"""`ancf run`: solves a case."""

from __future__ import annotations

import argparse
import shlex
import time
from pathlib import Path

from ancf_petsc.errors import CaseError
from ancf_petsc.launcher import quick_if_alone

HELP = "solve a case; under mpiexec -n N on N ranks"
PETSC_OPTIONS = True


def add_case_arguments(
    parser: argparse.ArgumentParser, what: str = "a case file, or a folder with case.toml"
) -> None:
    """The case and its changes, as several verbs take them. what: can be given as the case."""
    parser.add_argument("case", metavar="CASE", type=Path, help=what)
    parser.add_argument(
        "--set",
        dest="changes",
        metavar="KEY=VALUE",
        action="append",
        nargs="+",
        default=[],
        help="change keys of the case: material.law=neo_hooke constraint.top.fix=[]; KEY= removes one",
    )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case_arguments(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the results go (default results/NAME)")
    parser.add_argument(
        "--force",
        action="store_true",
        help="overwrite a folder that holds anything else than this case's run",
    )
    parser.add_argument(
        "--again",
        action="store_true",
        help="CASE is the folder of a run: repeat it, with all its changes, in its folder or in --out",
    )
    parser.add_argument(
        "--restart",
        action="store_true",
        help="go on from the last checkpoint in the folder of the results, or start where there is none; "
        "CASE may be the folder of a run",
    )
    parser.add_argument(
        "--extend",
        action="store_true",
        help="with --restart: though the case now asks for a longer duration, more outputs or other options of PETSc",
    )
    volume = parser.add_mutually_exclusive_group()
    volume.add_argument(
        "--quiet", action="store_const", dest="verbosity", const=-1, default=0, help="warnings only"
    )
    volume.add_argument(
        "--verbose",
        action="store_const",
        dest="verbosity",
        const=1,
        help="details too: what the run records of itself, every iteration's residual, seconds by part",
    )


def changes(arguments: argparse.Namespace) -> list[str]:
    """All KEY=VALUE of a command line."""
    return [change for group in arguments.changes for change in group]


def results_line(folder: Path) -> str:
    """The last line of a run: what to do with its folder, quoted for a shell."""
    name = shlex.quote(str(folder))
    return f"results in {folder}; ancf plot {name} draws the curves, ancf view {name} shows the body"


def is_run(path: Path) -> bool:
    """Whether a path is the folder of a run, and no case."""
    from ancf_petsc.input.load import CASE_FILE
    from ancf_petsc.results.checkpoint_file import NAMES

    left = ("summary.json", "results.h5", *NAMES)
    return not (path / CASE_FILE).is_file() and any((path / name).is_file() for name in left)


def refuse_together(arguments: argparse.Namespace) -> None:
    """Raise CaseError for options that contradict each other."""
    problem = ""
    if arguments.extend and not arguments.restart:
        problem = "--extend without --restart"
    elif arguments.restart and (arguments.again or arguments.force):
        problem = f"--restart with {'--again' if arguments.again else '--force'}"
    if problem:
        raise CaseError(
            problem, file="ancf run", expected="--restart alone, or with --extend", cure="see ancf run --help"
        )


def execute(arguments: argparse.Namespace) -> int:
    begun = time.perf_counter()
    with quick_if_alone():
        from mpi4py import MPI

    from ancf_petsc import log
    from ancf_petsc.analysis.provenance import case_of_run
    from ancf_petsc.input.load import load_case
    from ancf_petsc.launcher import start_petsc
    from ancf_petsc.parallel.exchange import on_root

    comm = MPI.COMM_WORLD
    refuse_together(arguments)
    log.configure(rank=comm.rank, verbosity=arguments.verbosity)
    of_run = arguments.again or (arguments.restart and is_run(arguments.case))
    load = case_of_run if of_run else load_case
    read = on_root(comm, lambda: load(arguments.case, changes(arguments), arguments.petsc_options))
    case = comm.bcast(read)
    start_petsc(case.spec.petsc)
    from ancf_petsc.analysis.run import run_case

    out = arguments.out or (arguments.case if of_run else None)
    imports = time.perf_counter() - begun
    with log.progress(1.0, "of the path" if case.spec.statics else "of the motion") as bar:
        folder = run_case(
            case,
            out,
            comm=comm,
            force=arguments.force,
            restart=arguments.restart,
            extend=arguments.extend,
            imports=imports,
            watch=bar.advance_to,
        )
    if comm.rank == 0 and arguments.verbosity >= 0:
        print(results_line(folder))
    return 0
