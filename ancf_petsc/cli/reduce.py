"""`ancf reduce`: a smaller case that gives the same answer."""

from __future__ import annotations

import argparse
from pathlib import Path

from ancf_petsc.cli.run import add_case_arguments, changes
from ancf_petsc.launcher import quick_if_alone

HELP = "write a smaller case that gives the same answer: half, quarter, section, wedge"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    from ancf_petsc.reduce.write import KINDS_OF_PARTS

    add_case_arguments(parser)
    parser.add_argument("--to", required=True, choices=KINDS_OF_PARTS, help="what of the body is kept")
    parser.add_argument(
        "--size",
        type=float,
        metavar="H",
        help="length of edges of a section or wedge (default that of the body's)",
    )
    parser.add_argument("--angle", type=float, metavar="DEGREES", help="of a wedge, up to 90 (default 5)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder to write (default NAME-TO)")


def execute(arguments: argparse.Namespace) -> int:
    with quick_if_alone():
        from mpi4py import MPI

    from ancf_petsc.input.load import load_case
    from ancf_petsc.parallel.exchange import on_root
    from ancf_petsc.reduce.write import reduce, write_case

    def write() -> None:
        case = load_case(arguments.case, changes(arguments))
        smaller = reduce(case, arguments.to, arguments.size, arguments.angle)
        folder = arguments.out or Path(f"{case.name}-{arguments.to}")
        _, plan = write_case(smaller, folder)
        for note in smaller.notes:
            print(f"note: {note}")
        print(f"{folder}: {len(plan.mesh.cells)} elements, {len(plan.space.nodes)} nodes; ancf run {folder}")

    on_root(MPI.COMM_WORLD, write)
    return 0
