"""Performance profiles over several studies: the share of problems that each method solves within x of the cheapest.

E. D. Dolan, J. J. More: Benchmarking optimization software with performance profiles, Mathematical Programming 91 (2002). A
problem is a study's quantity with an error that is asked for; what a method costs there is its cheapest run within it.
"""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from ancf_petsc.errors import CaseError
from ancf_petsc.post.charts.errors import COSTS
from ancf_petsc.post.charts.marks import (
    draw_points,
    end_labels,
    finish_chart,
    grid_of_panels,
    looks,
    write_labels,
)
from ancf_petsc.post.charts.points import ChartLine, ChartPanel, ChartPoint, grouped
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import StudyTable, select
from ancf_petsc.post.panels import style

Costs = dict[str, dict[str, float]]


def common_key(studies: Sequence[StudyTable]) -> str:
    """The key that all studies vary, of words before numbers. Raises CaseError where there is none."""
    shared = [key for key in studies[0].keys if all(len(s.keys.get(key, ())) > 1 for s in studies)]
    shared.sort(key=studies[0].is_numeric)
    if not shared:
        raise CaseError(
            "the studies share no key that all of them vary",
            key="STUDY_DIR",
            got=[list(study.keys) for study in studies],
            expected='one such as "mesh.element" in each',
            cure="plot them one by one",
        )
    return shared[0]


def cheapest(studies: Sequence[StudyTable], chart: ChartSpec, cost: str) -> Costs:
    """Problem -> method -> cost of its cheapest run within the error asked for. Shared seconds do not count."""
    found: Costs = {}
    column = COSTS[cost][0]
    for study in studies:
        names = (
            [chart.quantity]
            if chart.quantity
            else [name for name in study.quantities if study.reference(name)]
        )
        for name in names:
            for within in chart.within:
                costs = found.setdefault(f"{study.title}: {name} within {100 * within:g} %", {})
                for method, rows in grouped(study, select(study, chart.only), chart).items():
                    good = [
                        row.number(column)
                        for row in rows
                        if row.ended
                        and row.number(f"{name}_error") <= within
                        and (cost == "dof" or row.alone)
                    ]
                    good = [value for value in good if value > 0]
                    if good:
                        costs[method] = min(good)
                    else:
                        costs.setdefault(method, float("inf"))
    return found


def profile_panels(studies: Sequence[StudyTable], chart: ChartSpec) -> list[ChartPanel]:
    """Share of problems over how many times the cheapest each method may cost; one panel a cost."""
    chart = chart if chart.lines else chart.model_copy(update={"lines": (common_key(studies),)})
    panels = []
    for cost in chart.cost:
        problems = {
            name: costs
            for name, costs in cheapest(studies, chart, cost).items()
            if min(costs.values(), default=0) > 0
        }
        solvable = {name: costs for name, costs in problems.items() if min(costs.values()) < float("inf")}
        methods = list(dict.fromkeys(method for costs in solvable.values() for method in costs))
        panel = ChartPanel("", f"{COSTS[cost][1]}, times the cheapest", f"share of {len(solvable)} problems")
        for method in methods:
            ratios = sorted(
                costs.get(method, float("inf")) / min(costs.values()) for costs in solvable.values()
            )
            ratios = [ratio for ratio in ratios if ratio < float("inf")]
            points = [ChartPoint(ratio, (k + 1) / len(solvable)) for k, ratio in enumerate(ratios)]
            panel.lines.append(ChartLine(method, points or [ChartPoint(float("nan"), 0.0)]))
        panels.append(panel)
    return [panel for panel in panels if panel.count > 1]


def draw_profile(studies: Sequence[StudyTable], chart: ChartSpec, panels: list[ChartPanel]) -> Figure:
    """Steps that rise to the share of problems a method solves at all."""
    look = looks(line.label for panel in panels for line in panel.lines)
    with style():
        figure, places = grid_of_panels(len(panels))
        labels = []
        for axes, panel in zip(places, panels, strict=True):
            furthest = max(p.x for line in panel.lines for p in line.shown)
            axes.set(
                xscale="log", xlabel=panel.x, ylabel=panel.y, xlim=(0.9, 1.15 * furthest), ylim=(-0.03, 1.05)
            )
            for line in panel.lines:
                steps = line.shown
                if steps:
                    x, y = [p.x for p in steps] + [1.15 * furthest], [p.y for p in steps] + [steps[-1].y]
                    axes.plot(x, y, drawstyle="steps-post", color=look[line.label].colour)
                draw_points(axes, line, look[line.label], joined=False)
            ends = end_labels(panel.lines, look)
            labels.append((axes, [label._replace(x=1.15 * furthest) for label in ends]))
        within = ", ".join(f"{100 * error:g} %" for error in chart.within)
        note = (
            f"A problem: a quantity of a study and an error ({within}) that at least one method comes below."
        )
        never = sorted({line.label for panel in panels for line in panel.lines if not line.shown})
        unsolved = f"None of the problems: {', '.join(never)}." if never else ""
        finish_chart(figure, chart.title or "; ".join(s.title for s in studies), (chart.note, note, unsolved))
        write_labels(figure, labels)
    return figure
