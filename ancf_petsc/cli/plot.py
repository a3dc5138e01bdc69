"""`ancf plot`: the curves of runs."""

from __future__ import annotations

import argparse
from pathlib import Path

from ancf_petsc.errors import CaseError, EnvironmentProblem

HELP = "draw the curves of a run, or of several together"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "runs", metavar="RUN_DIR", type=Path, nargs="+", help="folders that ancf run has written"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="where the pictures go (default: the run's folder; of several: plots)",
    )
    parser.add_argument("--format", choices=("png", "pdf", "svg"), default="png", help="kind of picture")
    parser.add_argument("--show", action="store_true", help="open windows too")


def execute(arguments: argparse.Namespace) -> int:
    import matplotlib as mpl

    from ancf_petsc.results.reader import open_results

    runs = [open_results(folder) for folder in arguments.runs]
    if not arguments.show:
        mpl.use("Agg")
    from matplotlib import pyplot as plt

    from ancf_petsc.post.figures import figures_of, save

    if arguments.show and mpl.get_backend().lower() == "agg":
        raise EnvironmentProblem("there is no display to open windows on; leave --show out")
    figures = figures_of(runs)
    if not figures:
        raise CaseError("nothing to draw: the tables are empty", file=arguments.runs[0])
    out = arguments.out or (arguments.runs[0] if len(runs) == 1 else Path("plots"))
    try:
        for path in save(figures, out, arguments.format):
            print(path)
    except OSError as error:
        raise CaseError(
            f"cannot be written: {error.strerror}", file=error.filename or out, key="--out"
        ) from error
    if arguments.show:
        plt.show()
    return 0
