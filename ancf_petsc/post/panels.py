"""Axes, lines and legends that all figures share.

Colours are those of Okabe and Ito, which stay apart for colour-blind eyes. With one run a colour is a
quantity; with several a colour is a run and the kind of line a quantity.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from itertools import cycle

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ancf_petsc.post.reference import Level, ReferenceCurve
from ancf_petsc.post.units import Units, as_typed, read_units, with_unit
from ancf_petsc.results.reader import Results

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
LINES = ("-", "--", ":", "-.", (0, (6, 2, 1, 2, 1, 2)))
GREY = "#666666"
MARKED_ROWS = 60  # tables of more rows are drawn without marks
STYLE = {
    "figure.dpi": 110,
    "figure.constrained_layout.h_pad": 0.1,
    "figure.constrained_layout.w_pad": 0.1,
    "savefig.dpi": 200,
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.6,
    "lines.markersize": 3.5,
    "legend.frameon": False,
    "legend.handlelength": 3,
    "legend.fontsize": 9,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
}

Columns = NDArray[np.float64]
Curves = Mapping[str, Columns]
Quantities = Mapping[str, str]  # column of a table -> words in the legend
Runs = Sequence[Results | ReferenceCurve]


def style() -> AbstractContextManager[None]:
    return mpl.rc_context(STYLE)


def panels(count: int, heights: Sequence[float] | None = None) -> tuple[Figure, list[Axes]]:
    """A figure of `count` axes, one above the other, over one abscissa."""
    size = (7.6, 1.8 + 2.2 * count)
    figure, axes = plt.subplots(
        count, 1, sharex=True, squeeze=False, figsize=size, layout="constrained", height_ratios=heights
    )
    return figure, list(axes[:, 0])


def draw(
    axes: Axes,
    tables: Sequence[Curves],
    quantities: Quantities,
    *,
    over: str = "",
    factor: float = 1.0,
    drawstyle: str = "default",
) -> None:
    """Columns of one table a run against the column `over`, or against time."""
    for table, run_colour in zip(tables, cycle(COLOURS), strict=False):
        for name, colour, line in zip(quantities, cycle(COLOURS), cycle(LINES), strict=False):
            if name not in table:
                continue
            abscissa = factor * table[over] if over else time_of(table)
            axes.plot(
                abscissa,
                factor * table[name],
                color=colour if len(tables) == 1 else run_colour,
                linestyle=line,
                marker="o" if len(abscissa) <= MARKED_ROWS else "",
                drawstyle=drawstyle,
            )


def draw_levels(axes: Axes, levels: Sequence[Level]) -> None:
    """Lines across the axes, their words at the right end above them."""
    for level in levels:
        axes.axhline(level.value, color=GREY, linestyle=(0, (4, 3)), linewidth=1.0)
        axes.annotate(
            f"{as_typed(level.label)}: {level.value:g}",
            (0.99, level.value),
            xycoords=("axes fraction", "data"),
            xytext=(0, 2),
            textcoords="offset points",
            fontsize=8,
            color=GREY,
            horizontalalignment="right",
        )


def draw_end(
    axes: Axes, run: Results | ReferenceCurve, name: str, *, over: str = "", factor: float = 1.0
) -> None:
    """Mark where a run ended early, and where it jumped, on the curve of a column."""
    table, summary = run.curve, getattr(run, "summary", {})
    if name not in table:
        return
    abscissa = factor * table[over] if over else time_of(table)
    places = [(row, "jump") for row in np.flatnonzero(table.get("jumps", np.zeros(0)))]
    kind = summary.get("end", {}).get("kind", "reached")
    if kind != "reached":
        places.append((len(abscissa) - 1, kind.replace("_", " ")))
    for row, words in places:
        at = (abscissa[row], factor * table[name][row] if over else table[name][row])
        axes.plot(*at, marker="X", markersize=7, color="black", linestyle="", zorder=5)
        axes.annotate(
            words, at, xytext=(-6, 6), textcoords="offset points", fontsize=8, horizontalalignment="right"
        )


def draw_cuts(axes: Axes, run: Results | ReferenceCurve) -> None:
    """Ticks at the foot of the axes where steps were cut or another way was taken."""
    entries = getattr(run, "summary", {}).get("step_control", [])
    times = [entry.get("pseudo_time", entry.get("time")) for entry in entries]
    at = [time for time in dict.fromkeys(times) if time is not None]
    if at:
        axes.plot(
            at, np.zeros(len(at)), marker="|", markersize=9, color=GREY, linestyle="",
            transform=axes.get_xaxis_transform(), clip_on=False,
        )  # fmt: skip
        axes.annotate(
            "| step control",
            (0.01, 0.03),
            xycoords="axes fraction",
            fontsize=7.5,
            color=GREY,
            verticalalignment="bottom",
        )


def time_of(table: Curves) -> Columns:
    return table["time"] if "time" in table else table["pseudo_time"]


def finish(figure: Figure, axes: Sequence[Axes], runs: Runs, quantities: Quantities) -> None:
    """Title, words of the time axis, one legend beside the axes, the runs' notes below."""
    if len(runs) == 1:
        axes[0].set_title(as_typed(runs[0].title))
    if not axes[-1].get_xlabel():
        motion = any("time" in run.curve for run in runs)
        axes[-1].set_xlabel(with_unit("time", common_units(runs).time) if motion else "pseudo-time")
    handles = _legend(runs, quantities)
    if handles:
        figure.legend(handles=handles, loc="outside right upper")
    notes = list(dict.fromkeys(run.note for run in runs if run.note))
    if notes:
        figure.supxlabel(as_typed("\n".join(notes)), fontsize=7.5, color=GREY, x=0.015, ha="left")


def _legend(runs: Runs, quantities: Quantities) -> list[Line2D]:
    """Quantities, in grey beside the runs' colours where there are several runs."""
    several = len(runs) > 1
    lines = []
    if several:
        lines = [
            Line2D([], [], color=colour, label=as_typed(name))
            for name, colour in zip(run_names(runs), cycle(COLOURS), strict=False)
        ]
    words = [word for word in quantities.values() if word]
    if several and len(words) < 2:
        return lines
    return lines + [
        Line2D([], [], color=GREY if several else colour, linestyle=line, label=as_typed(word))
        for word, colour, line in zip(words, cycle(COLOURS), cycle(LINES), strict=False)
    ]


def run_names(runs: Runs) -> list[str]:
    """Titles; the folders' names where titles are the same."""
    titles = [run.title for run in runs]
    return titles if len(set(titles)) == len(titles) else [run.folder.resolve().name for run in runs]


def present(quantities: Quantities, tables: Sequence[Curves]) -> Quantities:
    """The quantities a table has and that in one of them are more than rounding."""
    sizes = {
        name: max(np.abs(table[name]).max(initial=0.0) for table in tables if name in table)
        for name in quantities
        if any(name in table for table in tables)
    }
    least = 1e-12 * max(sizes.values(), default=0.0)
    return {name: quantities[name] for name, size in sizes.items() if size > least}


def common_units(runs: Runs) -> Units:
    labels = {run.units for run in runs}
    return read_units(labels.pop()) if len(labels) == 1 else Units()
