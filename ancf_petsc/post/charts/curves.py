"""Columns of the runs' own tables, curve.csv and probes.csv, of one run against those of others."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.post.charts.marks import (
    LineLook,
    draw_predicted,
    end_labels,
    finish_chart,
    grid_of_panels,
    looks,
    write_labels,
)
from ancf_petsc.post.charts.points import ChartLine, ChartPanel, ChartPoint, grouped, panel_rows
from ancf_petsc.post.charts.predicted import predicted_lines
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import StudyRow, StudyTable
from ancf_petsc.post.charts.words import axis_words, outcome_words, title_of, value_words
from ancf_petsc.post.panels import LINES, style
from ancf_petsc.results.tables import read_table

ABSCISSAS = ("time", "pseudo_time")
Columns = dict[str, np.ndarray]


def curve_panels(study: StudyTable, chart: ChartSpec) -> list[ChartPanel]:
    """A panel for each column and value of `panels`; a line for each run."""
    panels = []
    for value, rows in panel_rows(study, chart).items():
        groups = grouped(study, rows, chart)
        for column in chart.y:
            lines, along = [], chart.x or ""
            for label, some in groups.items():
                for row in some:
                    table = _table(study, row)
                    if table:
                        along = along or next(name for name in ABSCISSAS if name in table)
                        lines.append(
                            _line(study, row, label, table, (along, column), relative=chart.relative)
                        )
            x, y = (axis_words(study, chart, name) for name in (along, column))
            if chart.relative:
                y = f"{y.partition(' [')[0]} / its start"
            title = value_words(chart, str(chart.panels), value) if chart.panels else ""
            panel = ChartPanel(
                title, chart.x_label or x, chart.y_label if chart.y_label and len(chart.y) == 1 else y, lines
            )
            panel.predicted = predicted_lines(study, chart, rows, value)
            panels.append(panel)
    return [panel for panel in panels if panel.count > 1]


def _table(study: StudyTable, row: StudyRow) -> Columns:
    """Columns of a run's curve.csv and probes.csv; nothing of a run that left none."""
    folder = study.folder / row.text("run")
    found: Columns = {}
    for name in ("curve.csv", "probes.csv"):
        if row.text("run") and (folder / name).is_file():
            found |= read_table(folder / name)
    return found if any(name in found for name in ABSCISSAS) else {}


def _line(
    study: StudyTable, row: StudyRow, label: str, table: Columns, columns: tuple[str, str], *, relative: bool
) -> ChartLine:
    x, y = (_column(study, row, table, name) for name in columns)
    if relative and len(y) and y[0]:
        y = y / y[0]
    count = min(len(x), len(y))
    points = [
        ChartPoint(float(a), float(b), run=row.text("run")) for a, b in zip(x[:count], y[:count], strict=True)
    ]
    if points and not row.ended:
        points[-1] = ChartPoint(
            points[-1].x, points[-1].y, ended=False, outcome=row.outcome, run=row.text("run")
        )
    return ChartLine(label, points)


def _column(study: StudyTable, row: StudyRow, table: Columns, name: str) -> np.ndarray:
    """A column, or a sum of several written with plus signs between blanks; a minus sign before one turns it over."""
    total = np.zeros(1)
    for part in name.split(" + "):
        column = part.removeprefix("-")
        if column not in table:
            raise CaseError(
                "no such column",
                file=study.folder / row.text("run"),
                got=column,
                cure=did_you_mean(column, tuple(table)),
            )
        total = total + (-table[column] if part != column else table[column])
    return total


def draw_curves(study: StudyTable, chart: ChartSpec, panels: list[ChartPanel]) -> Figure:
    """Runs over time, pseudo-time or stroke; a cross where one ended before its end."""
    look = looks(line.label for panel in panels for line in panel.lines)
    kinds = {label: LINES[k % len(LINES)] for k, label in enumerate(look)}
    with style():
        figure, places = grid_of_panels(len(panels), wide=6.4 if len(panels) < 2 else 5.2, high=3.8)
        labels = []
        for axes, panel in zip(places, panels, strict=True):
            axes.set(
                xlabel=panel.x,
                ylabel=panel.y,
                xscale=chart.x_scale or "linear",
                yscale=chart.y_scale or "linear",
            )
            axes.set_title(panel.title)
            for line in panel.lines:
                _draw_curve(axes, line, look[line.label], kinds[line.label])
            predicted = draw_predicted(axes, panel)
            once = {line.label: line for line in panel.lines}
            labels.append((axes, [*end_labels(list(once.values()), look), *predicted]))
        finish_chart(figure, title_of(study, chart), (chart.note or study.note, _ends(panels)))
        write_labels(figure, labels)
    return figure


def _draw_curve(axes: Axes, line: ChartLine, look: LineLook, kind: object) -> None:
    """In the order of the run: a path may go back. A few marks tell lines apart without colour."""
    points = [p for p in line.points if p.known]
    every = max(1, len(points) // 8)
    axes.plot(
        [p.x for p in points], [p.y for p in points], linestyle=kind, color=look.colour, linewidth=1.3,
        marker=look.mark, markevery=every, markersize=4,
    )  # fmt: skip
    if points and not points[-1].ended:
        axes.plot(
            points[-1].x, points[-1].y, "x", color="#000000", markersize=9, markeredgewidth=1.6, zorder=5
        )


def _ends(panels: list[ChartPanel]) -> str:
    ended = dict.fromkeys(
        f"{line.label}: {outcome_words(p.outcome)}"
        for panel in panels
        for line in panel.lines
        for p in line.points[-1:]
        if not p.ended
    )
    return f"Black crosses: runs that ended before: {'; '.join(ended)}." if ended else ""
