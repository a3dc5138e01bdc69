"""`ancf advise`: the cheapest element, mesh and step that are good enough."""

from __future__ import annotations

import argparse
from pathlib import Path

from ancf_petsc.cli.run import add_case_arguments, changes

HELP = "find the cheapest element, mesh and step within an error, from a ladder of cheap runs"
EPILOG = """\
ancf advise cases/pvc_block --set material.law=neo_hooke --quantity force@stroke=0.010 --within 1%
a path of statics is followed no farther than the quantity needs. Times are worth what the machine's quiet is worth."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case_arguments(parser)
    parser.add_argument(
        "--quantity",
        metavar="COLUMN[@PLACE]",
        required=True,
        help="force@stroke=0.010, tip.z@time=0.5, end.uz (at the end), strain_energy@max",
    )
    parser.add_argument(
        "--within", metavar="ERROR", required=True, help="relative error allowed: 1%% or 0.01"
    )
    parser.add_argument(
        "--budget", type=float, metavar="SECONDS", help="to be spent on trials at most (default 600)"
    )
    parser.add_argument("--run", action="store_true", help="run what is advised, and say what it achieved")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where runs go (default results/NAME_advice)")
    parser.add_argument("--quiet", action="store_true", help="the advice alone, no line for each trial")


def execute(arguments: argparse.Namespace) -> int:
    from ancf_petsc import log
    from ancf_petsc.advise.advise import advise, run_best
    from ancf_petsc.cli import rank_count
    from ancf_petsc.errors import CaseError
    from ancf_petsc.input.load import load_case

    if arguments.budget is not None and not arguments.budget > 0:
        raise CaseError(key="--budget", got=arguments.budget, expected="a number of seconds above 0")
    if rank_count() > 1:
        raise CaseError("ancf advise starts its runs itself", cure="run it without mpiexec")
    log.configure(verbosity=-1)
    case = load_case(arguments.case, changes(arguments))
    folder = arguments.out or Path("results") / f"{case.name}_advice"
    say = (lambda line: None) if arguments.quiet else (lambda line: print(line, flush=True))
    advice = advise(case, arguments.quantity, arguments.within, folder, arguments.budget, say)
    if arguments.run and advice.best is not None:
        run_best(advice, folder, say)
    print(f"{advice.runs} runs, {advice.spent:.0f} s")
    for line in advice.sentences():
        print(line)
    return 0 if advice.best is not None else 3
