#!/usr/bin/env python3
"""Parts of scripts/paper_figures: paper_curves.py bars|block|tumbling FOLDER, or spread COLUMN RUN_DIR ..."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ancf_petsc import load_case
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import MotionStopped
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.post.panels import COLOURS, GREY, draw_levels, panels, style
from ancf_petsc.post.reference import Level
from ancf_petsc.results.reader import Results, open_results

ROOT = Path(__file__).resolve().parent.parent
CASES, PICTURES = ROOT / "cases", ROOT / "docs" / "pictures"
LENGTHWISE = (4, 6, 10, 20)
ACROSS = (1, 2, 4)
ABAQUS = {"middle": -0.038, "end": -0.069}
WEIGHTS = {"with its own weight": "statics.toml", "without": "statics_without_gravity.toml"}
LOADING_TIMES = (0.05, 0.1, 0.2, 0.4)


def solve(case: str, folder: Path, **changes: object) -> tuple[Results, str]:
    """The run of a shipped case, and in words why it stopped, where it did."""
    try:
        run_case(load_case(CASES / case).with_changes(changes), folder, force=True)
    except MotionStopped as error:
        return open_results(folder), str(error)
    return open_results(folder), ""


def write(figure: Figure, name: str) -> None:
    with style():
        figure.savefig(PICTURES / f"{name}.png")
    print(f"wrote docs/pictures/{name}.png", flush=True)


def bars(out: Path) -> None:
    """Displacement of two sections over the number of bricks: statics, with and without the bar's weight."""
    moved: dict[tuple[str, int], list[dict[str, float]]] = {}
    for n in ACROSS:
        for m in LENGTHWISE:
            mesh = make_mesh("bar", out / "meshes" / f"bar_{n}_{m}.msh", divisions=(n, n, m))
            for words, case in WEIGHTS.items():
                run, _ = solve(
                    f"bar_tension/{case}", out / f"bar_{n}_{m}", **{"mesh.file": str(mesh.resolve())}
                )
                found = {section: float(run.probes[f"{section}.uz"][-1]) for section in ABAQUS}
                moved.setdefault((words, n), []).append(found)
                shown = ", ".join(f"{section} {value:.5f} m" for section, value in found.items())
                print(f"bar {n} x {n} x {m}, {6 * n * n * m} tetrahedra, {words}: {shown}", flush=True)
    with style():
        figure, places = panels(2)
        for axes, (section, value) in zip(places, ABAQUS.items(), strict=True):
            for (words, n), rows in moved.items():
                line = "-" if words in list(WEIGHTS)[:1] else "--"
                values = [row[section] for row in rows]
                axes.plot(LENGTHWISE, values, color=COLOURS[ACROSS.index(n)], linestyle=line, marker="o")
            draw_levels(axes, [Level("Abaqus, 5000 C3D8, quoted", value)])
            axes.set_ylabel(f"{section}: z displacement [m]")
        places[1].set_xlabel("bricks (six tetrahedra each) along the bar")
        places[1].set_xticks(LENGTHWISE)
        colours = [
            Line2D([], [], color=c, label=f"{n} x {n} across") for n, c in zip(ACROSS, COLOURS, strict=False)
        ]
        lines = [
            Line2D([], [], color=GREY, linestyle=s, label=w)
            for w, s in zip(WEIGHTS, ("-", "--"), strict=False)
        ]
        figure.legend(handles=colours + lines, loc="outside right upper")
        figure.set_size_inches(7.6, 8.2)
        note = "The paper does not mention the bar's weight; only with it the values it quotes come near."
        figure.supxlabel(note, fontsize=7.5, color=GREY, x=0.015, ha="left")
    write(figure, "bar_tension")


def block(out: Path) -> None:
    """Largest difference of the force between damped motion and statics over the time of loading."""
    pressed = {"material.density": 1350.0, "constraint.top.move": {"z": -0.01}}
    still, _ = solve("pvc_block/case.toml", out / "block_still", **pressed, statics={"steps": 10})
    force = still.curve["force"]
    apart = []
    for duration in LOADING_TIMES:
        motion = {"duration": duration, "step": duration / 100, "outputs": 10, "damping": 500.0}
        run, _ = solve("pvc_block/case.toml", out / "block", **pressed, statics=None, dynamics=motion)
        apart.append(np.abs(run.curve["force"] - force).max() / np.abs(force).max())
        print(f"block pressed by 10 mm in {duration:g} s: {100 * apart[-1]:.3f} % from statics", flush=True)
    with style():
        figure, (axes,) = panels(1)
        halved = apart[0] * LOADING_TIMES[0] / np.array(LOADING_TIMES)
        axes.loglog(LOADING_TIMES, 100 * halved, color=GREY, linewidth=1, label="1 / loading time")
        axes.loglog(LOADING_TIMES, 100 * np.array(apart), "o", markersize=6, label="damped motion")
        axes.set(
            xlabel="loading time [s]", ylabel="largest difference from statics\n[% of the largest force]"
        )
        for axis, ticks in ((axes.xaxis, LOADING_TIMES), (axes.yaxis, (0.2, 0.5, 1.0))):
            axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
            axis.set_minor_formatter("")
        axes.legend()
        figure.supxlabel(still.note, fontsize=7.5, color=GREY, x=0.015, ha="left")
    write(figure, "block_loading_time")


def tumbling(out: Path) -> None:
    """Energy of the free block over time by two integrators, and where one of them fails."""
    spins = {"10 rad/s": ("case", "trapezoidal"), "15 rad/s": ("fast", "fast_trapezoidal")}
    with style():
        figure, places = panels(2)
        for axes, (spin, cases) in zip(places, spins.items(), strict=True):
            for name, colour, words in zip(
                cases, COLOURS, ("energy-momentum", "trapezoidal rule"), strict=False
            ):
                run, stopped = solve(f"tumbling_block/{name}.toml", out / f"tumbling_{name}")
                energy = run.curve["kinetic_energy"] + run.curve["strain_energy"]
                time, ratio = run.curve["time"], energy / energy[0]
                axes.plot(time, ratio, color=colour, label=words)
                print(
                    f"tumbling block, {spin}, {words}: E / E0 at most {ratio.max():.6g}. {stopped}",
                    flush=True,
                )
                if stopped:
                    axes.plot(time[-1], ratio[-1], "X", color=colour, markersize=9)
                    axes.annotate(
                        f"fails at {time[-1]:.2f} s, step {run.curve['steps'].sum():.0f}",
                        (time[-1], ratio[-1]),
                        xytext=(8, -4),
                        textcoords="offset points",
                        fontsize=9,
                        color=colour,
                    )
            axes.set_ylabel(f"energy / its start\n{spin}")
        places[1].set_xlabel("time [s]")
        figure.legend(*places[0].get_legend_handles_labels(), loc="outside right upper")
    write(figure, "tumbling_energy")


def spread(column: str, folders: Sequence[str]) -> None:
    """How far runs are apart from the last of them, over their common times."""
    runs = [open_results(folder) for folder in folders]
    time, last = runs[-1].probes["time"], runs[-1].probes[column]
    print(f"{column}, distance from {runs[-1].title}:")
    for run in runs[:-1]:
        apart = np.abs(np.interp(time, run.probes["time"], run.probes[column]) - last)
        print(f"  {run.title:<28} largest {apart.max():.4f} m, at {time[-1]:g} s {apart[-1]:.4f} m")


if __name__ == "__main__":
    part, *rest = sys.argv[1:]
    if part == "spread":
        spread(rest[0], rest[1:])
    else:
        {"bars": bars, "block": block, "tumbling": tumbling}[part](Path(rest[0]))
