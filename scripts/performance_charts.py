"""The charts of docs/performance.md from the results of `ancf bench accuracy stroke`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
from matplotlib import pyplot as plt

LAWS = {"svk": "Saint Venant-Kirchhoff", "neo_hooke": "neo-Hooke"}
MARKS = dict(zip(("3413", "3-10-1-3", "3813", "3-20-1-3", "3843"), "osD^v", strict=True))
Results = dict[str, dict[str, Any]]


def sweep(results: Results, name: str) -> dict[tuple[str, ...], dict[str, Any]]:
    """Results whose name begins with `name`, by the rest of it, without those that could not run."""
    found = {
        tuple(full.split("/")[1:]): result for full, result in results.items() if full.startswith(f"{name}/")
    }
    return {rest: result for rest, result in found.items() if "problem" not in result}


def best_forces(results: Results) -> dict[str, tuple[float, str]]:
    """For each law the force with most degrees of freedom of elements that do not lock, and which run it is of."""
    best: dict[str, tuple[float, str]] = {}
    for law in LAWS:
        quadratic = {
            rest: found
            for rest, found in sweep(results, "accuracy").items()
            if rest[0] == law and rest[1] in ("3-10-1-3", "3-20-1-3")
        }
        if quadratic:
            rest, found = max(quadratic.items(), key=lambda item: item[1]["facts"]["dof"])
            best[law] = (found["facts"]["force"], f"{rest[1]} on {rest[2]}")
    return best


def draw_accuracy(results: Results, file: Path) -> None:
    """Error of the force at 25 mm against seconds, a line an element, a panel a law."""
    best = best_forces(results)
    figure, panels = plt.subplots(1, 2, figsize=(9.5, 4.2), sharey=True, layout="constrained")
    for axes, (law, title) in zip(panels, LAWS.items(), strict=True):
        for element, mark in MARKS.items():
            points = [
                (found["median"], abs(found["facts"]["force"] / best[law][0] - 1))
                for rest, found in sweep(results, "accuracy").items()
                if law in best and rest[:2] == (law, element)
            ]
            points = sorted((seconds, error) for seconds, error in points if error > 0)
            if points:
                axes.loglog(*zip(*points, strict=True), marker=mark, label=element)
        axes.set(title=title, xlabel="seconds, one core")
        axes.grid(color="#e4e4e4", which="both")
    panels[0].set_ylabel("error of the force at 25 mm")
    panels[0].legend(title="element")
    figure.savefig(file, dpi=160)
    plt.close(figure)


def draw_strokes(results: Results, file: Path) -> None:
    """The stroke that is reached against the size of edges, a line a law and body; an arrow where the case's end was."""
    figure, axes = plt.subplots(figsize=(6.5, 4.2), layout="constrained")
    for law, title in LAWS.items():
        for body, mark in (("cube", "o"), ("pvc_block", "s")):
            rows = [
                (1e3 * float(rest[1].split(":")[1]), 1e3 * found["median"], found["facts"]["ended"])
                for rest, found in sweep(results, "stroke").items()
                if rest[0] == law and rest[1].startswith(f"{body}:")
            ]
            if not rows:
                continue
            rows.sort()
            sizes, strokes, ended = zip(*rows, strict=True)
            (line,) = axes.semilogx(sizes, strokes, marker=mark, label=f"{body}, {title}")
            on = [(size, reached) for size, reached, end in rows if not end]
            if on:
                axes.plot(
                    *zip(*on, strict=True), linestyle="", marker="^", markersize=11, color=line.get_color()
                )
    axes.set(xlabel="edge length of the mesh, mm", ylabel="stroke reached, mm (of 100 mm height)")
    axes.grid(color="#e4e4e4", which="both")
    axes.legend()
    figure.savefig(file, dpi=160)
    plt.close(figure)
