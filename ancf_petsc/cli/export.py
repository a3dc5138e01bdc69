"""`ancf export`: a case as the input of another program."""

from __future__ import annotations

import argparse
from pathlib import Path

from ancf_petsc.cli.run import add_case_arguments, changes
from ancf_petsc.launcher import quick_if_alone

HELP = "write a case as the input of another program, CalculiX"
FORMATS = ("calculix",)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case_arguments(parser)
    parser.add_argument(
        "--format", choices=FORMATS, default=FORMATS[0], help="of the file (default calculix: ccx -i NAME)"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="the file to write (default NAME.inp)")


def execute(arguments: argparse.Namespace) -> int:
    with quick_if_alone():
        from mpi4py import MPI

    from ancf_petsc.errors import writing
    from ancf_petsc.export import FORMATS as WRITERS
    from ancf_petsc.input.load import load_case
    from ancf_petsc.parallel.exchange import on_root
    from ancf_petsc.plan.plan import make_plan

    def export() -> None:
        case = load_case(arguments.case, changes(arguments))
        plan = make_plan(case)
        write, suffix = WRITERS[arguments.format]
        path = arguments.out or Path(f"{case.name}{suffix}")
        text, notes = write(case, plan)
        with writing(path, "--out"):
            path.write_text(text)
        for note in notes:
            print(f"note: {note}")
        print(
            f"{path}: {len(plan.mesh.cells)} elements, {len(plan.space.nodes)} nodes; ccx -i {path.with_suffix('')} solves it"
        )

    on_root(MPI.COMM_WORLD, export)
    return 0
