"""What all charts share: colours with marks, labels at the ends of lines, failed runs at the margin, predicted lines.

Colours are those of Okabe and Ito; each comes with a mark of its own, so that no line is known by its colour alone.
"""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import cycle, islice
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation
from matplotlib.ticker import FuncFormatter, NullFormatter

from ancf_petsc.post.charts.points import ChartLine, ChartPanel, ChartPoint
from ancf_petsc.post.charts.words import outcome_words
from ancf_petsc.post.panels import COLOURS, GREY
from ancf_petsc.post.units import as_typed

MARKS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p")
FONT = 8.5
LINE_GAP = 1.3
"""Distance of labels over the size of their letters."""
MARGIN = 1.035
"""Height of failed runs, in parts of the axes'."""
MARGIN_ROW = 0.05
"""Distance of those that stand at one place."""
TICK_GAP = 0.17
"""Least distance of ticks of a short logarithmic axis, in parts of it."""
COLUMN, ROW = 4.6, 3.9
"""Inches of a panel."""
NOTE_LETTERS, TITLE_LETTERS = 16.5, 10.0
"""In an inch."""


class LineLook(NamedTuple):
    """How a line is drawn."""

    colour: str
    mark: str


class EndLabel(NamedTuple):
    """Words beside the end of a line at (x, y)."""

    text: str
    x: float
    y: float
    colour: str


def looks(labels: Iterable[str]) -> dict[str, LineLook]:
    """A colour and a mark for each line, the same in all panels."""
    pairs = zip(dict.fromkeys(labels), cycle(COLOURS), cycle(MARKS), strict=False)
    return {label: LineLook(colour, mark) for label, colour, mark in pairs}


def grid_of_panels(count: int, *, wide: float = COLUMN, high: float = ROW) -> tuple[Figure, list[Axes]]:
    """A figure of `count` axes, up to three beside each other."""
    columns = count if count < 4 else 2 if count == 4 else 3
    rows = -(-count // columns)
    figure, axes = plt.subplots(
        rows, columns, squeeze=False, figsize=(wide * columns + 0.8, high * rows + 0.5), layout="constrained"
    )
    for spare in axes.flat[count:]:
        spare.set_axis_off()
    return figure, list(axes.flat[:count])


def draw_points(axes: Axes, line: ChartLine, look: LineLook, *, joined: bool = True) -> None:
    """A line through its points; hollow where seconds do not count, error bars where they are known."""
    points = line.shown
    if not points:
        return
    x, y = np.array([(p.x, p.y) for p in points]).T
    axes.plot(x, y, linestyle="-" if joined else "none", color=look.colour, zorder=3)
    for alone in (True, False):
        some = [p for p in points if p.alone == alone]
        face = look.colour if alone else "white"
        axes.plot(
            [p.x for p in some], [p.y for p in some], look.mark, color=look.colour, markerfacecolor=face,
            markersize=5.5, zorder=4,
        )  # fmt: skip


def draw_bars(axes: Axes, line: ChartLine, look: LineLook) -> None:
    """Error bars, within the axes as the points alone have set them."""
    limits = axes.get_ylim()
    for point in line.shown:
        if point.low == point.low:
            low = max(point.low, limits[0])
            axes.plot(
                [point.x] * 2, [low, point.high], color=look.colour, linewidth=0.9, marker="_", zorder=2
            )
    axes.set_ylim(limits)


def draw_margin(axes: Axes, lines: Sequence[ChartLine], look: dict[str, LineLook]) -> list[ChartPoint]:
    """Runs without an answer above the axes, where they stand in x: the mark of their line, crossed out; those drawn."""
    found, taken = [], Counter[float]()
    for line in lines:
        for point in line.points:
            if point.x == point.x and point.y != point.y and not point.ended:
                colour, mark = look[line.label]
                height = MARGIN + MARGIN_ROW * taken[point.x]
                for one, size in ((mark, 5.5), ("x", 7.5)):
                    axes.plot(
                        point.x, height, one, color=colour, markerfacecolor="white", markersize=size,
                        markeredgewidth=1.2, transform=axes.get_xaxis_transform(), clip_on=False,
                    )  # fmt: skip
                taken[point.x] += 1
                found.append(point)
    return found


def failure_words(points: Sequence[ChartPoint], what: str = "Crossed out above") -> str:
    """What crosses stand for: how many runs ended in which way."""
    if not points:
        return ""
    counts = Counter(outcome_words(point.outcome) for point in points)
    names = ", ".join(
        f"{name} ({count})" if len(counts) > 1 else name for name, count in counts.most_common()
    )
    return f"{what}: {len(points)} {'run' if len(points) == 1 else 'runs'} without an answer: {names}."


def draw_predicted(axes: Axes, panel: ChartPanel) -> list[EndLabel]:
    """Predicted lines in grey, dashed; their labels for the right margin."""
    labels = []
    kinds = ((0, (5, 3)), (0, (1, 1.5)), (0, (7, 2, 1, 2)), (0, (3, 2, 1, 2, 1, 2)))
    for line, kind in zip(panel.predicted, cycle(kinds), strict=False):
        points = line.shown
        if not points:
            continue
        if len({p.y for p in points}) == 1 and points[0].x == -np.inf:
            axes.axhline(points[0].y, color=GREY, linestyle=kind, linewidth=1.2, zorder=2)
            labels.append(EndLabel(line.label, np.nan, points[0].y, GREY))
        else:
            axes.plot(
                [p.x for p in points],
                [p.y for p in points],
                color=GREY,
                linestyle=kind,
                linewidth=1.4,
                zorder=2,
            )
            labels.append(EndLabel(line.label, points[-1].x, points[-1].y, GREY))
    return labels


def end_labels(lines: Sequence[ChartLine], look: dict[str, LineLook]) -> list[EndLabel]:
    """The words of lines at their last points."""
    return [
        EndLabel(" ".join(filter(None, (line.label, line.more))), end.x, end.y, look[line.label].colour)
        for line in lines
        if line.shown
        for end in line.shown[-1:]
    ]


def write_labels(figure: Figure, labels: Sequence[tuple[Axes, Sequence[EndLabel]]]) -> None:
    """Words of lines to the right of the axes, each at the height of its line's end as far as there is room."""
    made: list[tuple[Axes, list[tuple[EndLabel, Annotation]]]] = []
    for axes, some in labels:
        pairs = []
        for label in some:
            x, transform = (label.x, "data") if label.x == label.x else (1.0, axes.get_yaxis_transform())
            text = axes.annotate(
                as_typed(label.text) if label.colour != GREY else label.text, (x, label.y), xycoords=transform,
                xytext=(1.03, 0.5), textcoords="axes fraction", color=label.colour, fontsize=FONT, va="center",
                arrowprops={"arrowstyle": "-", "color": label.colour, "linewidth": 0.6, "alpha": 0.55,
                            "shrinkA": 1, "relpos": (0.0, 0.5), "shrinkB": 3},
                annotation_clip=False,
            )  # fmt: skip
            pairs.append((label, text))
        made.append((axes, pairs))
    figure.draw_without_rendering()
    for axes, pairs in made:
        _spread(axes, pairs, figure.dpi)


def _spread(axes: Axes, pairs: list[tuple[EndLabel, Annotation]], dpi: float) -> None:
    """Move the words of one panel apart."""
    box = axes.get_window_extent()
    heights = []
    for label, _ in pairs:
        _, y = axes.transData.transform((1.0 if axes.get_xscale() == "log" else 0.0, label.y))
        heights.append(float(np.clip((y - box.y0) / box.height, 0.0, 1.0)))
    gaps = [LINE_GAP * FONT * dpi / 72 * (1 + label.text.count("\n")) / box.height for label, _ in pairs]
    for (_, text), height in zip(pairs, apart(heights, gaps), strict=True):
        text.set_position((1.03, height))


def apart(heights: Sequence[float], gaps: Sequence[float]) -> list[float]:
    """Heights as near to those given as room of `gaps` around each allows, in the same order."""
    order = sorted(range(len(heights)), key=lambda k: heights[k])
    found = list(heights)
    for _ in range(200):
        moved = 0.0
        for low, high in zip(order, islice(order, 1, None), strict=False):
            missing = (gaps[low] + gaps[high]) / 2 - (found[high] - found[low])
            if missing > 1e-9:
                found[low] -= missing / 2
                found[high] += missing / 2
                moved = max(moved, missing)
        if moved < 1e-4:
            break
    return found


def plain_ticks(axes: Axes, values: Sequence[float]) -> None:
    """On a logarithmic abscissa of less than two decades: ticks at the values themselves, as far as there is room."""
    known = sorted({value for value in values if value > 0})
    if axes.get_xscale() != "log" or not known or known[-1] >= 100 * known[0]:
        return
    least = (known[-1] / known[0]) ** TICK_GAP
    shown = known[:1]
    for value in known[1:]:
        if value >= least * shown[-1]:
            shown.append(value)
    axes.set_xticks(shown, [f"{value:,.0f}" if value >= 1000 else f"{value:.3g}" for value in shown])
    axes.xaxis.set_minor_formatter(NullFormatter())


def percent_ticks(axes: Axes) -> None:
    """Errors as parts of a hundred."""
    plain_heights(axes, 100.0, " %")


def plain_heights(axes: Axes, factor: float = 1.0, unit: str = "") -> None:
    """A logarithmic ordinate in plain numbers, times factor; within two decades also at 2 and 5 times powers of ten."""

    def words(value: float, _: int) -> str:
        return f"{factor * value:.3g}{unit}".replace("e-0", "e-").replace("e+0", "e")

    def minor(value: float, place: int) -> str:
        low, high = axes.get_ylim()
        leading = value / 10 ** np.floor(np.log10(value) + 1e-9)
        return words(value, place) if high < 100 * low and round(leading, 3) in (2, 5) else ""

    axes.yaxis.set_major_formatter(FuncFormatter(words))
    axes.yaxis.set_minor_formatter(FuncFormatter(minor))


def finish_chart(figure: Figure, title: str, notes: Iterable[str]) -> None:
    """Title above, notes below, both broken into lines as wide as the figure."""
    wide = figure.get_size_inches()[0]
    heading = textwrap.wrap(title, int(TITLE_LETTERS * wide))
    figure.suptitle("\n".join(heading), x=0.015, ha="left", fontsize=11)
    lines = [line for note in notes if note for line in textwrap.wrap(note, int(NOTE_LETTERS * wide))]
    if lines:
        figure.supxlabel("\n".join(lines), fontsize=7.5, color=GREY, x=0.015, ha="left")


def swatch(colour: str, mark: str, label: str) -> Line2D:
    """An entry of a legend beside the axes."""
    return Line2D([], [], linestyle="", marker=mark, color=colour, label=label, markersize=8)
