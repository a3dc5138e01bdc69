"""`ancf plot`: the curves of runs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ancf_petsc.errors import CaseError, EnvironmentProblem, writing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ancf_petsc.results.reader import Results

HELP = "draw the curves of a run, or of several together"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "runs", metavar="RUN_DIR", type=Path, nargs="+", help="folders that ancf run has written"
    )
    parser.add_argument(
        "--probe",
        action="append",
        default=[],
        metavar="NAME.AXIS",
        help="draw only this component of a probe (tip.z, end.uz) of all runs; may be given again",
    )
    parser.add_argument(
        "--reference",
        type=Path,
        action="append",
        default=[],
        metavar="FILE.csv",
        help="lay its columns over those of the same name; may be given again",
    )
    parser.add_argument(
        "--level",
        action="append",
        default=[],
        metavar="LABEL=VALUE",
        help="draw a value across the axes of the last --probe; may be given again",
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

    from ancf_petsc.post.figures import save

    if arguments.show and mpl.get_backend().lower() == "agg":
        raise EnvironmentProblem("there is no display to open windows on; leave --show out")
    figures = _figures(arguments, runs)
    if not figures:
        raise CaseError("nothing to draw: the tables are empty", file=arguments.runs[0])
    out = arguments.out or (arguments.runs[0] if len(runs) == 1 else Path("plots"))
    with writing(out, "--out"):
        for path in save(figures, out, arguments.format):
            print(path)
    if arguments.show:
        plt.show()
    return 0


def _figures(arguments: argparse.Namespace, runs: list[Results]) -> dict[str, Figure]:
    """All that the runs have columns for, or the components that were named."""
    from ancf_petsc.post.figures import components, figures_of
    from ancf_petsc.post.reference import ReferenceCurve, read_level, read_reference

    if arguments.level and not arguments.probe:
        raise CaseError("needs a probe component", key="--level", cure="such as --probe tip.z")
    levels = [read_level(text) for text in arguments.level]
    drawn: list[Results | ReferenceCurve] = [
        *runs,
        *(read_reference(path, runs[0]) for path in arguments.reference),
    ]
    if not arguments.probe:
        return figures_of(drawn)
    return {"_".join(arguments.probe): components(drawn, arguments.probe, levels)}
