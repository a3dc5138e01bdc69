"""Predicted lines of charts: values, curves given by points, and quantities that every run reports of itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ancf_petsc.post.charts.points import ChartLine, ChartPoint
from ancf_petsc.post.charts.spec import ChartSpec, PredictedSpec
from ancf_petsc.post.charts.study_table import StudyRow, StudyTable, same


def predicted_lines(
    study: StudyTable, chart: ChartSpec, rows: Sequence[StudyRow], panel: str = ""
) -> list[ChartLine]:
    """What was predicted for the panel of a value. A line across the whole chart has one point, at x = -inf."""
    wanted = [line for line in chart.predicted if line.panel is None or same(panel, line.panel)]
    return [ChartLine(line.label, _points(study, chart, rows, line)) for line in wanted]


def _points(
    study: StudyTable, chart: ChartSpec, rows: Sequence[StudyRow], line: PredictedSpec
) -> list[ChartPoint]:
    if line.value is not None:
        return [ChartPoint(-np.inf, line.factor * line.value)]
    if line.points is not None:
        return [ChartPoint(x, line.factor * y) for x, y in line.points]
    values = study.values(str(chart.x)) if not study.is_numeric(str(chart.x)) else []
    found: dict[float, float] = {}
    for row in rows:
        x = float(values.index(row.text(str(chart.x)))) if values else row.number(str(chart.x))
        y = row.number(str(line.quantity))
        if x == x and y == y:
            found[x] = line.factor * y**line.power
    return [ChartPoint(x, found[x]) for x in sorted(found)]
