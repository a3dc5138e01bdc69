#!/usr/bin/env python3
"""Force and stroke of several runs in one picture, and a table of energies and stiffnesses.

    scripts/compare_runs.py results/svk results/neo_hooke --out comparison.png

A script to start from: what it reads is open to any other of yours.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib as mpl

import ancf_petsc as ancf
from ancf_petsc.post.curves import energy_absorbed, energy_loaded, initial_stiffness, secant_stiffness
from ancf_petsc.post.units import read_units, with_unit


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "runs", metavar="RUN_DIR", nargs="+", type=Path, help="folders that ancf run has written"
    )
    parser.add_argument("--out", metavar="FILE", type=Path, default=Path("comparison.png"))
    arguments = parser.parse_args()
    try:
        runs = [ancf.open_results(folder) for folder in arguments.runs]
    except ancf.CaseError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    for run in runs:
        if "force" not in run.curve:
            print(f"error: {run.folder}: no column force; give the case output.curve", file=sys.stderr)
            return ancf.CaseError.exit_code
    print_table(runs)
    draw(runs, arguments.out)
    print(arguments.out)
    return 0


def print_table(runs: list[ancf.Results]) -> None:
    """Work put in up to the largest stroke, work kept at the end, slopes of the curve."""
    heads = ("run", "largest force", "energy loaded", "energy kept", "stiffness at 0", "secant stiffness")
    print(f"{heads[0]:<32}" + "".join(f"{head:>18}" for head in heads[1:]))
    for run in runs:
        stroke, force = run.curve["stroke"], run.curve["force"]
        numbers = (
            force[abs(force).argmax()],
            energy_loaded(stroke, force),
            energy_absorbed(stroke, force),
            initial_stiffness(stroke, force),
            secant_stiffness(stroke, force),
        )
        print(f"{run.folder.resolve().name[:31]:<32}" + "".join(f"{number:>18.6g}" for number in numbers))


def draw(runs: list[ancf.Results], file: Path) -> None:
    """One line a run."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.5, 4.5), layout="constrained")
    for run in runs:
        axes.plot(run.curve["stroke"], run.curve["force"], marker=".", label=run.folder.resolve().name)
    units = read_units(runs[0].units)
    axes.set_xlabel(with_unit("stroke", units.length))
    axes.set_ylabel(with_unit("force", units.force))
    axes.grid(color="#e4e4e4")
    axes.legend()
    for note in dict.fromkeys(run.note for run in runs if run.note):
        figure.supxlabel(note, fontsize=8)
    figure.savefig(file, dpi=200)


if __name__ == "__main__":
    sys.exit(main())
