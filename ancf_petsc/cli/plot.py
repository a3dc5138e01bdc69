"""`ancf plot`: the curves of runs, the charts of studies."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ancf_petsc.errors import CaseError, EnvironmentProblem, writing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ancf_petsc.results.reader import Results

HELP = "draw the curves of a run or of several together, or the charts of studies"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "runs",
        metavar="DIR",
        type=Path,
        nargs="+",
        help="folders that ancf run has written, or ancf study: of several studies a profile is drawn too",
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
        help="where the pictures go (default: the run's folder, of several plots; a study's folder charts)",
    )
    parser.add_argument(
        "--format",
        choices=("png", "pdf", "svg"),
        help="kind of picture (default: png, of studies png and svg)",
    )
    parser.add_argument("--show", action="store_true", help="open windows too")


def execute(arguments: argparse.Namespace) -> int:
    import matplotlib as mpl

    from ancf_petsc.post.charts.study_table import is_study
    from ancf_petsc.results.reader import open_results

    studies = [folder for folder in arguments.runs if is_study(folder)]
    if studies:
        return _draw_studies(arguments, studies)
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
        for path in save(figures, out, arguments.format or "png"):
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


def _draw_studies(arguments: argparse.Namespace, folders: list[Path]) -> int:
    """Charts of each study, and the profile over several."""
    import matplotlib as mpl

    from ancf_petsc.post.charts.study_table import read_study

    others = [folder for folder in arguments.runs if folder not in folders]
    if others:
        raise CaseError(
            "not a study, beside studies", file=others[0], expected="studies alone, or runs alone"
        )
    for name in ("probe", "reference", "level", "show"):
        if getattr(arguments, name):
            raise CaseError(
                "is for runs",
                key=f"--{name}",
                cure="charts of studies are [[chart]] tables of the study file",
            )
    mpl.use("Agg")
    from ancf_petsc.post.charts.draw import charts_of, profile_of, save_charts

    suffixes = (arguments.format,) if arguments.format else ("png", "svg")
    studies, drawn = [read_study(folder) for folder in folders], 0
    for folder, study in zip(folders, studies, strict=True):
        charts, empty = charts_of(study)
        for name in empty:
            print(f"{name}: not drawn, it would have fewer than two points")
        out = folder / "charts" if arguments.out is None else arguments.out
        if arguments.out and len(folders) > 1:
            out = arguments.out / folder.resolve().name
        drawn += len(charts)
        with writing(out, "--out"):
            print(*save_charts(charts, out, suffixes), sep="\n")
    if len(studies) > 1:
        profile = profile_of(studies)
        if profile:
            drawn += 1
            with writing(arguments.out or Path("plots"), "--out"):
                print(*save_charts([profile], arguments.out or Path("plots"), suffixes), sep="\n")
    if not drawn:
        raise CaseError(
            "nothing to draw: no chart has two points", file=folders[0], cure="study.csv has the reasons"
        )
    return 0
