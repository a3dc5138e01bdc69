"""Stability maps: what happened over two axes of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ancf_petsc.post.charts.marks import (
    EndLabel,
    draw_predicted,
    finish_chart,
    grid_of_panels,
    swatch,
    write_labels,
)
from ancf_petsc.post.charts.points import ChartLine, ChartPanel, ChartPoint, panel_rows
from ancf_petsc.post.charts.predicted import predicted_lines
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import StudyRow, StudyTable
from ancf_petsc.post.charts.words import axis_words, outcome_words, title_of, value_words
from ancf_petsc.post.panels import style

COLOURS = {
    "reached": ("#009E73", "o"),
    "cut_steps": ("#56B4E9", "s"),
    "energy_grown": ("#F0E442", "^"),
    "lost_definiteness": ("#E69F00", "D"),
    "limit_point": ("#E69F00", "v"),
    "surface_fold": ("#CC79A7", "P"),
    "material_limit": ("#0072B2", "p"),
    "inverted_element": ("#8c6d46", "<"),
    "step_too_long": ("#D55E00", ">"),
    "diverged": ("#444444", "X"),
}
"""Outcome -> colour of its cells and the mark in them. Others are grey crosses."""
OTHER = ("#999999", "x")
SHOWN_NUMBERS = 80
"""Maps of more cells show marks without numbers."""


def map_panels(study: StudyTable, chart: ChartSpec) -> list[ChartPanel]:
    """One panel a value of `panels`; its lines are outcomes, its points cells at the numbers of their values."""
    panels = []
    x, y = str(chart.x), chart.y[0]
    for value, rows in panel_rows(study, chart).items():
        title = value_words(chart, str(chart.panels), value) if chart.panels else ""
        words = (chart.x_label or axis_words(study, chart, x), chart.y_label or axis_words(study, chart, y))
        panel = ChartPanel(title, *words)
        found: dict[str, list[ChartPoint]] = {}
        across, up = study.values(x), study.values(y)
        for row in rows:
            if row.text(x) not in across or row.text(y) not in up:
                continue
            outcome, place = outcome_of(row, chart), (across.index(row.text(x)), up.index(row.text(y)))
            number = row.number(chart.quantity) if chart.quantity else float("nan")
            found.setdefault(outcome, []).append(
                ChartPoint(*place, low=number, ended=row.ended, outcome=outcome, run=row.text("run"))
            )
        panel.lines = [ChartLine(outcome_words(outcome), points) for outcome, points in found.items()]
        panel.predicted = predicted_lines(study, chart, rows, value)
        panels.append(panel)
    return [panel for panel in panels if panel.count > 1]


def outcome_of(row: StudyRow, chart: ChartSpec) -> str:
    """How a run ended; energy_grown where it came to its end with more than `factor` of the quantity."""
    grown = chart.factor is not None and row.number(str(chart.quantity)) > chart.factor
    return "energy_grown" if grown and row.ended else "reached" if row.outcome == "done" else row.outcome


def map_records(study: StudyTable, chart: ChartSpec, panels: list[ChartPanel]) -> list[dict[str, object]]:
    """Rows of the chart's CSV: values of both axes, not their places."""
    x, y = study.values(str(chart.x)), study.values(chart.y[0])
    rows: list[dict[str, object]] = []
    for panel in panels:
        for line in panel.lines:
            for p in line.points:
                record: dict[str, object] = {
                    "panel": panel.title, "kind": "measured", "line": "", str(chart.x): x[int(p.x)],
                    chart.y[0]: y[int(p.y)], "outcome": p.outcome, "run": p.run,
                }  # fmt: skip
                rows.append(record | ({chart.quantity: p.low} if chart.quantity else {}))
        for line in panel.predicted:
            for p in line.shown:
                rows.append(
                    {
                        "panel": panel.title, "kind": "predicted", "line": line.label,
                        str(chart.x): p.x, chart.y[0]: p.y,
                    }
                )  # fmt: skip
    return rows


def draw_map(study: StudyTable, chart: ChartSpec, panels: list[ChartPanel]) -> Figure:
    """Coloured cells with a mark each; the legend stands beside the panels."""
    x, y = study.values(str(chart.x)), study.values(chart.y[0])
    wide, high = (max(2.4, 0.62 * len(values) + 1.2) for values in (x, y))
    outcomes = list(dict.fromkeys(p.outcome for panel in panels for line in panel.lines for p in line.points))
    outcomes = [
        *(name for name in COLOURS if name in outcomes),
        *(name for name in outcomes if name not in COLOURS),
    ]
    numbers = bool(chart.quantity) and len(x) * len(y) <= SHOWN_NUMBERS
    with style():
        figure, places = grid_of_panels(len(panels), wide=min(wide, 5.5), high=min(high, 5.0))
        labels: list[tuple[Axes, Sequence[EndLabel]]] = []
        for axes, panel in zip(places, panels, strict=True):
            _draw_cells(axes, panel, numbers=numbers)
            _name_axes(axes, panel, [[value_words(chart, key, v) for v in values] for key, values in
                                     ((str(chart.x), x), (chart.y[0], y))])  # fmt: skip
            scaled = ChartPanel(
                panel.title, panel.x, panel.y, predicted=_on_cells(study, chart, panel.predicted)
            )
            labels.append((axes, draw_predicted(axes, scaled)))
        handles = [swatch(*COLOURS.get(name, OTHER), outcome_words(name)) for name in outcomes]
        figure.legend(handles=handles, loc="outside right upper")
        finish_chart(
            figure,
            title_of(study, chart),
            (chart.note or study.note, _quantity_words(study, chart, numbers=numbers)),
        )
        write_labels(figure, labels)
    return figure


def _quantity_words(study: StudyTable, chart: ChartSpec, *, numbers: bool) -> str:
    if not chart.quantity:
        return ""
    name = axis_words(study, chart, chart.quantity)
    shown = f"Numbers in cells: {name}." if numbers else ""
    grown = f"Energy has grown where {name} is above {chart.factor:g}." if chart.factor else ""
    return " ".join(filter(None, (shown, grown)))


def _draw_cells(axes: Axes, panel: ChartPanel, *, numbers: bool) -> None:
    for line in panel.lines:
        for p in line.points:
            colour, mark = COLOURS.get(p.outcome, OTHER)
            axes.add_patch(
                Rectangle((p.x - 0.48, p.y - 0.46), 0.96, 0.92, facecolor=colour, alpha=0.55, linewidth=0)
            )
            shown = numbers and p.low == p.low
            axes.plot(
                p.x, p.y + (0.17 if shown else 0), mark, color="#222222", markersize=5, markerfacecolor="none"
            )
            if shown:
                axes.text(p.x, p.y - 0.22, short_number(p.low), ha="center", va="center", fontsize=6.5)


def short_number(value: float) -> str:
    """In at most six characters: two digits, or the power of ten of what is very large or small."""
    if value == 0 or 1e-3 <= abs(value) < 1e4:
        return f"{value:.2g}" if abs(value) < 100 else f"{value:.0f}"
    return f"{value:.0e}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def _name_axes(axes: Axes, panel: ChartPanel, names: list[list[str]]) -> None:
    across, up = names
    axes.set_xticks(range(len(across)), across, rotation=90 if max(map(len, across)) > 5 else 0)
    axes.set_yticks(range(len(up)), up)
    axes.set(xlim=(-0.6, len(across) - 0.4), ylim=(-0.6, len(up) - 0.4), xlabel=panel.x, ylabel=panel.y)
    axes.set_title(panel.title)
    axes.grid(visible=False)
    axes.tick_params(length=0)


def _on_cells(study: StudyTable, chart: ChartSpec, lines: list[ChartLine]) -> list[ChartLine]:
    """Predicted lines at places of cells: between two values by their logarithms where all are positive."""
    x, y = (_places(study.values(name)) for name in (str(chart.x), chart.y[0]))
    found = []
    for line in lines:
        points = [ChartPoint(p.x if np.isinf(p.x) else _place(p.x, x), _place(p.y, y)) for p in line.shown]
        found.append(ChartLine(line.label, points))
    return found


def _places(values: Sequence[str]) -> Mapping[float, int]:
    """Place of each value; of words none."""
    try:
        return {float(value): place for place, value in enumerate(values)}
    except ValueError:
        return {}


def _place(value: float, places: Mapping[float, int]) -> float:
    """The place of a value, beyond the ends at most half a cell; the value itself where places have words."""
    if not places:
        return value
    known = np.array(list(places))
    if known.min() > 0 and value > 0:
        known, value = np.log(known), float(np.log(value))
    step = np.diff(known).mean() if len(known) > 1 else 1.0
    wide = np.concatenate(([known[0] - step / 2], known, [known[-1] + step / 2]))
    return float(np.interp(value, wide, [-0.5, *places.values(), len(known) - 0.5]))
