"""A quantity of a study over one of its keys, predicted values beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ancf_petsc.post.charts.marks import (
    LineLook,
    draw_margin,
    draw_points,
    draw_predicted,
    end_labels,
    failure_words,
    finish_chart,
    grid_of_panels,
    looks,
    plain_heights,
    plain_ticks,
    write_labels,
)
from ancf_petsc.post.charts.points import ChartLine, ChartPanel, ChartPoint, grouped, panel_rows
from ancf_petsc.post.charts.predicted import predicted_lines
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import StudyTable
from ancf_petsc.post.charts.words import axis_words, outcome_words, title_of, value_words
from ancf_petsc.post.panels import style

NAMED_ENDS = 14
"""Charts with more runs that ended early leave their names to the CSV."""


def value_panels(study: StudyTable, chart: ChartSpec) -> list[ChartPanel]:
    """A quantity over x; keys of words stand at the numbers of their values."""
    x, quantity, panels = str(chart.x), str(chart.quantity), []
    places = {value: k for k, value in enumerate(study.values(x))} if is_even(study, chart) else {}
    for value, rows in panel_rows(study, chart).items():
        title = value_words(chart, str(chart.panels), value) if chart.panels else ""
        panel = ChartPanel(title, axis_words(study, chart, x), axis_words(study, chart, quantity))
        panel.x, panel.y = chart.x_label or panel.x, chart.y_label or panel.y
        for label, some in grouped(study, rows, chart).items():
            points = [
                ChartPoint(
                    float(places[row.text(x)]) if places else row.number(x), row.number(quantity),
                    ended=row.ended, outcome=row.outcome, run=row.text("run"),
                )
                for row in some
            ]  # fmt: skip
            panel.lines.append(
                _relative(ChartLine(label, points)) if chart.relative else ChartLine(label, points)
            )
        panel.predicted = predicted_lines(study, chart, rows, value)
        if places and study.is_numeric(x):
            panel.predicted = [_between(line, [float(known) for known in places]) for line in panel.predicted]
        panels.append(panel)
    return [panel for panel in panels if panel.count > 1]


def is_even(study: StudyTable, chart: ChartSpec) -> bool:
    """Whether values of x stand at equal distances: words always."""
    return chart.x_scale == "even" or not study.is_numeric(str(chart.x))


def _between(line: ChartLine, values: list[float]) -> ChartLine:
    """A predicted line over values that stand at equal distances."""
    places = np.arange(len(values))
    points = [
        p if np.isinf(p.x) else replace(p, x=float(np.interp(p.x, values, places))) for p in line.points
    ]
    return ChartLine(line.label, points)


def _relative(line: ChartLine) -> ChartLine:
    """Over the value at the smallest x."""
    first = line.shown[0].y if line.shown else float("nan")
    return (
        ChartLine(line.label, [replace(point, y=point.y / first) for point in line.points]) if first else line
    )


def draw_values(study: StudyTable, chart: ChartSpec, panels: list[ChartPanel]) -> Figure:
    """Lines through the runs; a cross on a point whose run ended before its end, with the reason's short name."""
    look = looks(line.label for panel in panels for line in panel.lines)
    ends = [p for panel in panels for line in panel.lines for p in line.shown if not p.ended]
    failed: list[ChartPoint] = []
    with style():
        figure, places = grid_of_panels(len(panels), wide=6.2 if len(panels) == 1 else 4.9, high=4.2)
        labels = []
        for axes, panel in zip(places, panels, strict=True):
            _scale(axes, study, chart, panel)
            axes.set_title(panel.title)
            for line in panel.lines:
                draw_points(axes, line, look[line.label])
                _draw_ends(axes, line, look[line.label], named=len(ends) <= NAMED_ENDS)
            predicted = draw_predicted(axes, panel)
            failed += draw_margin(axes, panel.lines, look)
            labels.append((axes, [*end_labels(panel.lines, look), *predicted]))
        notes = (chart.note or study.note, failure_words(failed), _ends_words(ends))
        finish_chart(figure, title_of(study, chart), notes)
        write_labels(figure, labels)
    return figure


def _scale(axes: Axes, study: StudyTable, chart: ChartSpec, panel: ChartPanel) -> None:
    axes.set(xlabel=panel.x, ylabel=panel.y)
    if not is_even(study, chart):
        along = [p.x for line in panel.lines for p in line.points]
        axes.set_xscale(chart.x_scale or _scale_of([x for x in along if x == x]))
        plain_ticks(axes, along)
    else:
        names = [value_words(chart, str(chart.x), value) for value in study.values(str(chart.x))]
        axes.set_xticks(range(len(names)), names)
    axes.set_yscale(chart.y_scale or "linear")
    if chart.y_scale == "log":
        plain_heights(axes)


def _scale_of(values: list[float]) -> str:
    """Logarithmic where positive values span more than a decade."""
    return "log" if values and min(values) > 0 and max(values) > 10 * min(values) else "linear"


def _draw_ends(axes: Axes, line: ChartLine, look: LineLook, *, named: bool) -> None:
    for point in line.shown:
        if not point.ended:
            axes.plot(point.x, point.y, "x", color="#000000", markersize=8, markeredgewidth=1.3, zorder=5)
            if named:
                axes.annotate(
                    outcome_words(point.outcome), (point.x, point.y), xytext=(-6, 5), textcoords="offset points", ha="right",
                    fontsize=7, color=look.colour, zorder=6,
                )  # fmt: skip


def _ends_words(ends: list[ChartPoint]) -> str:
    return (
        failure_words(ends, "Black crosses").replace("without an answer", "that ended before") if ends else ""
    )
