"""Errors of studies: work against precision, and convergence with fitted orders."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ancf_petsc.post.charts.marks import (
    EndLabel,
    LineLook,
    draw_bars,
    draw_margin,
    draw_points,
    end_labels,
    failure_words,
    finish_chart,
    grid_of_panels,
    looks,
    percent_ticks,
    plain_ticks,
    write_labels,
)
from ancf_petsc.post.charts.points import NAN, ChartLine, ChartPanel, ChartPoint, grouped, pareto
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import StudyRow, StudyTable, same, select
from ancf_petsc.post.charts.words import axis_words, title_of
from ancf_petsc.post.panels import style
from ancf_petsc.post.units import with_unit

COSTS = {
    "solve_seconds": ("solve_seconds", "seconds of the solution"),
    "seconds": ("total_seconds", "seconds of the whole run"),
    "dof": ("dof", "degrees of freedom"),
}
HOLLOW = "Hollow: seconds of a run that shared the machine's cores with others."


def error_point(row: StudyRow, quantity: str, x: float, *, alone: bool = True) -> ChartPoint:
    """Of one run; a run that ended before its end has no error."""
    error, uncertainty = row.number(f"{quantity}_error"), row.number(f"{quantity}_uncertainty")
    y = error if row.ended and error > 0 else NAN
    low, high = (y - uncertainty, y + uncertainty) if uncertainty > 0 else (NAN, NAN)
    return ChartPoint(x, y, low, high, row.ended, alone, row.outcome, run=row.text("run"))


def precision_panels(study: StudyTable, chart: ChartSpec) -> list[ChartPanel]:
    """Error over each cost, one line a group; the front of what none beats is marked `best`."""
    quantity, panels = str(chart.quantity), []
    for cost in chart.cost:
        column, words = COSTS[cost]
        panel = ChartPanel("", words, _error_words(study, chart))
        for label, rows in grouped(study, select(study, chart.only), chart).items():
            points = [
                error_point(row, quantity, row.number(column), alone=cost == "dof" or row.alone)
                for row in rows
            ]
            panel.lines.append(ChartLine(label, points, down=True))
        pareto(panel.lines)
        panels.append(panel)
    return [panel for panel in panels if panel.count > 1]


def draw_precision(study: StudyTable, chart: ChartSpec, panels: list[ChartPanel]) -> Figure:
    """Error against seconds and against degrees of freedom."""
    look = looks(line.label for line in panels[0].lines)
    failed: list[ChartPoint] = []
    with style():
        figure, places = grid_of_panels(len(panels))
        labels = []
        for axes, panel in zip(places, panels, strict=True):
            front = sorted((p for line in panel.lines for p in line.points if p.best), key=lambda p: p.x)
            _draw_front(axes, front)
            failed = _draw_errors(axes, panel, look, relative=is_relative(study, chart)) or failed
            labels.append((axes, end_labels(panel.lines, look)))
        hollow = any(not p.alone for panel in panels for line in panel.lines for p in line.shown)
        finish_chart(
            figure,
            title_of(study, chart),
            (
                chart.note or study.note,
                reference_words(study, chart),
                _front_words(panels),
                HOLLOW if hollow else "",
                failure_words(failed),
            ),
        )
        write_labels(figure, labels)
    return figure


def _draw_errors(
    axes: Axes, panel: ChartPanel, look: dict[str, LineLook], *, relative: bool
) -> list[ChartPoint]:
    """Lines, bars and failed runs of a panel on logarithmic axes; the failed runs."""
    axes.set(xscale="log", yscale="log", xlabel=panel.x, ylabel=panel.y)
    for line in panel.lines:
        draw_points(axes, line, look[line.label])
    for line in panel.lines:
        draw_bars(axes, line, look[line.label])
    axes.grid(which="minor", alpha=0.35)
    plain_ticks(axes, [p.x for line in panel.lines for p in line.points])
    if relative:
        percent_ticks(axes)
    return draw_margin(axes, panel.lines, look)


def _draw_front(axes: Axes, front: list[ChartPoint]) -> None:
    """A broad band under the points that none beats, cheaper and more accurate at once."""
    axes.plot(
        [p.x for p in front], [p.y for p in front], color="#d9d9d9", linewidth=9, solid_capstyle="round",
        drawstyle="steps-post", zorder=1,
    )  # fmt: skip


def _front_words(panels: list[ChartPanel]) -> str:
    marked = any(p.best for panel in panels for line in panel.lines for p in line.points)
    return "Grey band: no run is cheaper and more accurate at once (Pareto front)." if marked else ""


def reference_words(study: StudyTable, chart: ChartSpec) -> str:
    """What errors are against."""
    facts, reference = study.quantities.get(str(chart.quantity), {}), study.reference(str(chart.quantity))
    if facts.get("against"):
        return f"Errors: {facts.get('reduce')} of the distance from the reference's series, over the same of that series."
    words = str(reference.get("words") or "")
    value, unit = reference.get("value"), study.quantities.get(str(chart.quantity), {}).get("unit") or ""
    if isinstance(value, int | float) and value:
        said = f"{value:.6g} {unit}".strip()
        words = f"{said} ({words})" if words else said
    return f"Errors are against {words}." if words else ""


def is_relative(study: StudyTable, chart: ChartSpec) -> bool:
    """Whether errors are parts of the reference; against the number 0 they are absolute."""
    facts = study.quantities.get(str(chart.quantity), {})
    return bool(facts.get("against")) or study.reference(str(chart.quantity)).get("value") != 0


def _error_words(study: StudyTable, chart: ChartSpec) -> str:
    unit = "" if is_relative(study, chart) else study.quantities[str(chart.quantity)].get("unit") or ""
    return with_unit(f"error of {_name(chart)}", str(unit))


def _name(chart: ChartSpec) -> str:
    """The quantity's name in words."""
    return chart.labels.get(str(chart.quantity), str(chart.quantity).replace("_", " "))


def convergence_panels(study: StudyTable, chart: ChartSpec) -> list[ChartPanel]:
    """Error over the size of elements, steps or tolerances."""
    x = chart.x or _abscissa(study)
    panel = ChartPanel(
        "", chart.x_label or axis_words(study, chart, x), chart.y_label or _error_words(study, chart)
    )
    for label, rows in grouped(study, select(study, chart.only), chart).items():
        line = ChartLine(label, [error_point(row, str(chart.quantity), row.number(x)) for row in rows])
        line.more = order_words(study, chart, rows, line)
        panel.lines.append(line)
    return [panel] if panel.count > 1 else []


def _abscissa(study: StudyTable) -> str:
    """The first varied key of numbers that a discretisation is refined by, else the mean size of elements."""
    refining = ("dynamics.step", "dynamics.tolerance", "mesh.size", "statics.tolerance")
    return next((key for key in refining if len(study.keys.get(key, ())) > 1 and study.is_numeric(key)), "h")


def order_words(study: StudyTable, chart: ChartSpec, rows: list[StudyRow], line: ChartLine) -> str:
    """The order that the study has fitted to the line, else the slope of its finest three errors."""
    for order in study.orders:
        known = {key: value for key, value in order.get("line", {}).items() if value is not None}
        fits = order.get("quantity") == chart.quantity and rows
        if not (fits and all(same(row.text(key), value) for row in rows for key, value in known.items())):
            continue
        if order.get("verdict") == "asymptotic" and isinstance(order.get("order"), int | float):
            return f"order {order['order']:.1f}"
        return f"({order.get('verdict') or 'no order'})"
    slope = slope_of(line.shown)
    return f"slope {slope:.1f}" if slope == slope else ""


def slope_of(points: list[ChartPoint]) -> float:
    """Of the logarithms of the three points of smallest x, by least squares; nan of fewer."""
    finest = points[:3]
    if len(finest) < 3 or any(p.x <= 0 or p.y <= 0 for p in finest) or len({p.x for p in finest}) < 3:
        return NAN
    return float(np.polyfit(np.log([p.x for p in finest]), np.log([p.y for p in finest]), 1)[0])


def draw_convergence(study: StudyTable, chart: ChartSpec, panels: list[ChartPanel]) -> Figure:
    """Error against size, step or tolerance; orders stand beside the lines."""
    look = looks(line.label for line in panels[0].lines)
    with style():
        figure, (axes,) = grid_of_panels(1, wide=6.4, high=4.2)
        failed = _draw_errors(axes, panels[0], look, relative=is_relative(study, chart))
        finish_chart(
            figure,
            title_of(study, chart),
            (chart.note or study.note, reference_words(study, chart), failure_words(failed)),
        )
        labels: list[EndLabel] = end_labels(panels[0].lines, look)
        write_labels(figure, [(axes, labels)])
    return figure
