"""Figures of one run, or of several in the same axes. Each is None where the runs have no columns for it."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ancf_petsc.errors import CaseError, did_you_mean, writing
from ancf_petsc.post.curves import is_compression
from ancf_petsc.post.panels import (
    Columns,
    Curves,
    Quantities,
    Runs,
    common_units,
    draw,
    draw_cuts,
    draw_end,
    draw_levels,
    finish,
    panels,
    present,
    style,
    time_of,
)
from ancf_petsc.post.reference import Level
from ancf_petsc.post.units import as_typed, with_unit

FORCES = {"force": "sum of internal forces", "force_stress_area": "stress times area"}
ENERGIES = {
    "strain_energy": "strain",
    "kinetic_energy": "kinetic",
    "dissipated_energy": "dissipated",
    "potential_energy": "potential",
    "external_work": "external work",
}
BALANCE = {"kinetic_energy": 1.0, "strain_energy": 1.0, "dissipated_energy": 1.0, "external_work": -1.0}
STEPS = {"min_det_F": "smallest det F", "newton_iterations": "Newton iterations"}


def figures_of(runs: Runs) -> dict[str, Figure]:
    """All the figures that the runs have columns for, by a name for the file."""
    makers: dict[str, Callable[[Runs], Figure | None]] = {
        "force_stroke": force_stroke,
        "energy": energy,
        "probes": probes,
        "momentum": momentum,
        "steps": steps,
    }
    made = {name: make(runs) for name, make in makers.items()}
    return {name: figure for name, figure in made.items() if figure}


def save(figures: dict[str, Figure], folder: Path, suffix: str) -> list[Path]:
    """Write each as folder/NAME.suffix; the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{file_name(name)}.{suffix}" for name in figures]
    for path, figure in zip(paths, figures.values(), strict=True):
        with style(), warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing from")  # drawn as a box, said by the picture
            with writing(path, "--out"):
                figure.savefig(path)
    return paths


def file_name(name: str) -> str:
    """A name of columns as one of a file."""
    return re.sub(r"[^\w.+=-]+", "_", name)[:100]


def force_stroke(runs: Runs) -> Figure | None:
    """Force against stroke, by internal forces and by the paper's stress times area."""
    runs = [run for run in runs if {"stroke", "force"} <= run.curve.keys()]
    if not runs:
        return None
    curves = [run.curve for run in runs]
    compression = all(is_compression(curve["stroke"], curve["force"]) for curve in curves)
    quantities = {name: words for name, words in FORCES.items() if any(name in curve for curve in curves)}
    units = common_units(runs)
    with style():
        figure, (axes,) = panels(1)
        axes.axhline(0, color="#b0b0b0", linewidth=0.8)
        factor = -1.0 if compression else 1.0
        draw(axes, curves, quantities, over="stroke", factor=factor)
        for run in runs:
            draw_end(axes, run, "force", over="stroke", factor=factor)
        words = ("compression", "compressive force") if compression else ("stroke", "force")
        axes.set_xlabel(with_unit(words[0], units.length))
        axes.set_ylabel(with_unit(words[1], units.force))
        finish(figure, [axes], runs, quantities)
    return figure


def energy(runs: Runs) -> Figure | None:
    """The energies, and how far their balance drifts."""
    runs = [run for run in runs if ENERGIES.keys() & run.curve.keys()]
    curves = [run.curve for run in runs]
    quantities = present(ENERGIES, curves)
    if not quantities:
        return None
    with style():
        figure, (above, below) = panels(2, heights=(2.2, 1))
        draw(above, curves, quantities)
        drifts = [{"time": time_of(curve), "drift": energy_drift(curve)} for curve in curves]
        draw(below, drifts, {"drift": ""})
        above.set_ylabel(with_unit("energy", common_units(runs).energy))
        below.set_ylabel("drift of the balance\n/ largest energy")
        finish(figure, [above, below], runs, quantities)
    return figure


def energy_drift(curve: Curves) -> Columns:
    """(rows,) kinetic + strain + dissipated - external work, less its first value, over the largest part."""
    parts = [sign * curve[name] for name, sign in BALANCE.items() if name in curve]
    total = np.sum(parts, axis=0)
    largest = max((np.abs(part).max(initial=0.0) for part in parts), default=0.0)
    return (total - total[:1]) / (largest or 1.0)


def probes(runs: Runs) -> Figure | None:
    """Probes against time, along the axes they move along: positions in motion, displacements in statics."""
    names = list(dict.fromkeys(name[:-3] for run in runs for name in run.probes if name.endswith(".ux")))
    runs = [run for run in runs if any(f"{name}.{axis}" in run.probes for name in names for axis in "xyz")]
    if not runs:
        return None
    tables = [run.probes for run in runs]
    motion = any("time" in table for table in tables)
    moving = [axis for axis in "xyz" if _travel(tables, names, axis) > 1e-9 * _travel(tables, names, "xyz")]
    word, letter = ("position", "") if motion else ("displacement", "u")
    with style():
        figure, places = panels(max(1, len(moving)))
        for axes, axis in zip(places, moving or "z", strict=True):
            draw(axes, tables, {f"{name}.{letter}{axis}": name for name in names})
            axes.set_ylabel(with_unit(f"{axis} {word}", common_units(runs).length))
        finish(figure, places, runs, {name: name for name in names})
    return figure


def _travel(tables: Sequence[Curves], names: Sequence[str], axes: str) -> float:
    """The largest displacement of all probes along some axes."""
    columns = [f"{name}.u{axis}" for name in names for axis in axes]
    return max(np.abs(table[name]).max(initial=0.0) for table in tables for name in columns if name in table)


def components(runs: Runs, columns: Sequence[str], levels: Sequence[Level] = ()) -> Figure:
    """Components of probes (tip.z, end.uz) against time, one above the other, a line for each run that has
    them; levels across the last.
    """
    known = sorted({name for run in runs for name in run.probes} - {"time", "pseudo_time"})
    for column in columns:
        if column not in known:
            raise CaseError(
                "no such component of a probe", key="--probe", got=column, cure=did_you_mean(column, known)
            )
    runs = [run for run in runs if set(columns) & run.probes.keys()]
    with style():
        figure, places = panels(len(columns))
        for axes, column in zip(places, columns, strict=True):
            draw(axes, [run.probes for run in runs], {column: ""})
            probe, _, axis = column.rpartition(".")
            words = f"{axis[-1]} {'displacement' if axis.startswith('u') else 'position'}"
            axes.set_ylabel(f"{as_typed(probe)}: {with_unit(words, common_units(runs).length)}")
        draw_levels(places[-1], levels)
        finish(figure, places, runs, {})
    return figure


def momentum(runs: Runs) -> Figure | None:
    """Linear and angular momentum against time."""
    runs = [run for run in runs if "momentum.x" in run.curve]
    if not runs:
        return None
    units = common_units(runs)
    kinds = {"momentum": units.momentum, "angular_momentum": units.angular_momentum}
    curves = [run.curve for run in runs]
    with style():
        figure, places = panels(len(kinds))
        for axes, (kind, unit) in zip(places, kinds.items(), strict=True):
            draw(axes, curves, {f"{kind}.{axis}": axis for axis in "xyz"})
            axes.set_ylabel(with_unit(kind.replace("_", " "), unit))
        finish(figure, places, runs, {axis: axis for axis in "xyz"})
    return figure


def steps(runs: Runs) -> Figure | None:
    """How the solution went: smallest det F, and Newton iterations since the row before."""
    curves = [run.curve for run in runs]
    quantities: Quantities = {
        name: words
        for name, words in STEPS.items()
        if any(name in curve and np.any(curve[name]) for curve in curves)  # explicit motion iterates never
    }
    if not quantities:
        return None
    with style():
        figure, places = panels(len(quantities))
        for axes, (name, words) in zip(places, quantities.items(), strict=True):
            counts = name == "newton_iterations"
            draw(axes, curves, {name: ""}, drawstyle="steps-pre" if counts else "default")
            axes.set_ylabel(words)
            for run in runs:
                draw_cuts(axes, run)
                draw_end(axes, run, name)
            if counts:
                axes.set_ylim(bottom=0)
                axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        finish(figure, places, runs, {})
    return figure
