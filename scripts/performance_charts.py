"""The charts of docs/performance.md from the results of `ancf bench accuracy stroke`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
from matplotlib import pyplot as plt

LAWS = {"svk": "Saint Venant-Kirchhoff", "neo_hooke": "neo-Hooke"}
BODIES = {"pvc_block": "PVC block at 25 mm", "cube": "cube at 15 mm"}
MARKS = dict(zip(("3413", "3-10-1-3", "3813", "3843"), "osDv", strict=True))
Results = dict[str, dict[str, Any]]


def sweep(results: Results, name: str) -> dict[tuple[str, ...], dict[str, Any]]:
    """Results whose name begins with `name`, by the rest of it, without those that could not run."""
    found = {
        tuple(full.split("/")[1:]): result for full, result in results.items() if full.startswith(f"{name}/")
    }
    return {rest: result for rest, result in found.items() if "problem" not in result}


def best_forces(results: Results) -> dict[tuple[str, ...], tuple[float, str]]:
    """For each law and body the force of the finest run of quadratic tetrahedra, and which run it is."""
    best: dict[tuple[str, ...], tuple[float, str]] = {}
    finest: dict[tuple[str, ...], int] = {}
    for rest, found in sweep(results, "accuracy").items():
        law, body, element, mesh = rest
        if element == "3-10-1-3" and found["facts"]["dof"] > finest.get((law, body), 0):
            finest[law, body] = found["facts"]["dof"]
            best[law, body] = (found["facts"]["force"], mesh)
    return best


def draw_accuracy(results: Results, file: Path) -> None:
    """Error of the force at 25 mm against seconds: a line an element, a panel a law and body."""
    best = best_forces(results)
    figure, panels = plt.subplots(2, 2, figsize=(9.5, 7.5), sharey=True, layout="constrained")
    for axes, (law, body) in zip(panels.flat, [(law, body) for law in LAWS for body in BODIES], strict=True):
        axes.set(title=f"{BODIES[body]}, {LAWS[law]}", xlabel="seconds, one core")
        axes.grid(color="#e4e4e4", which="both")
        for element, mark in MARKS.items():
            points = _errors(results, (law, body, element), best)
            if points:
                axes.loglog(*zip(*points, strict=True), marker=mark, label=element)
                axes.legend(title="element")
    panels[0, 0].set_ylabel("error of the force")
    panels[1, 0].set_ylabel("error of the force")
    figure.savefig(file, dpi=160)
    plt.close(figure)


def _errors(results: Results, line: tuple[str, str, str], best: dict) -> list[tuple[float, float]]:
    """Seconds and error of the runs of one law, body and element, without the one errors are against."""
    if line[:2] not in best:
        return []
    force, _ = best[line[:2]]
    found = [run for rest, run in sweep(results, "accuracy").items() if rest[:3] == line]
    points = sorted((run["median"], abs(run["facts"]["force"] / force - 1)) for run in found)
    return [(seconds, error) for seconds, error in points if error > 0]


def draw_strokes(results: Results, file: Path) -> None:
    """The stroke that is reached against the size of edges; a triangle where it is the end asked for."""
    figure, axes = plt.subplots(figsize=(6.5, 4.2), layout="constrained")
    for law, title in LAWS.items():
        for body, mark in zip(BODIES, "so", strict=True):
            rows = [
                (1e3 * float(rest[1].split(":")[1]), 1e3 * found["median"], found["facts"]["ended"])
                for rest, found in sweep(results, "stroke").items()
                if rest[0] == law and rest[1].startswith(f"{body}:")
            ]
            if not rows:
                continue
            rows.sort()
            sizes, strokes, ended = zip(*rows, strict=True)
            (line,) = axes.plot(sizes, strokes, marker=mark, label=f"{body}, {title}")
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
