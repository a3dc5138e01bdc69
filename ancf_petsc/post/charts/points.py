"""Points of charts: rows of a study, arranged in panels and lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import StudyRow, StudyTable, select
from ancf_petsc.post.charts.words import axis_words, value_words

NAN = float("nan")


@dataclass(frozen=True)
class ChartPoint:
    """A run in a chart. x, y: nan where unknown, then it has no place but the margin. low, high: of the error bar."""

    x: float
    y: float
    low: float = NAN
    high: float = NAN
    ended: bool = True
    alone: bool = True
    outcome: str = ""
    best: bool = False
    run: str = ""

    @property
    def known(self) -> bool:
        return self.x == self.x and abs(self.y) < float("inf")


@dataclass
class ChartLine:
    """Points of one value of the key that makes lines. more: words after its label. down: joined from the largest y to the
    smallest, as errors fall, not along x.
    """

    label: str
    points: list[ChartPoint]
    more: str = ""
    down: bool = False

    @property
    def shown(self) -> list[ChartPoint]:
        """What has a place, in the order in which it is joined."""
        known = [point for point in self.points if point.known]
        return sorted(known, key=lambda point: -point.y if self.down else point.x)


@dataclass
class ChartPanel:
    """One pair of axes. x, y: words along them."""

    title: str
    x: str
    y: str
    lines: list[ChartLine] = field(default_factory=list)
    predicted: list[ChartLine] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(len(line.shown) for line in self.lines)

    def records(self) -> list[dict[str, Any]]:
        """Rows of the chart's CSV."""
        found = []
        for kind, lines in (("measured", self.lines), ("predicted", self.predicted)):
            for line in lines:
                for p in sorted(line.points, key=lambda point: (point.x != point.x, point.x)):
                    found.append(
                        {
                            "panel": self.title, "kind": kind, "line": line.label, self.x: p.x, self.y: p.y,
                            "low": p.low, "high": p.high, "outcome": p.outcome, "seconds_alone": p.alone,
                            "best": p.best, "run": p.run,
                        }
                    )  # fmt: skip
        return found


def line_keys(study: StudyTable, chart: ChartSpec) -> tuple[str, ...]:
    """Keys that make lines: those asked for, else the first one whose values are words and that nothing else uses."""
    if chart.lines:
        return chart.lines
    used = {chart.x, chart.panels, *(chart.y if chart.kind == "map" else ())}
    free = [key for key in study.keys if key not in used and len(study.values(key)) > 1]
    words = [key for key in free if not study.is_numeric(key)]
    if chart.kind in ("work_precision", "convergence", "profile"):
        return tuple(words)
    return tuple((words or free)[:1])


def grouped(study: StudyTable, rows: Iterable[StudyRow], chart: ChartSpec) -> dict[str, list[StudyRow]]:
    """Rows by the words of the line they belong to, in the order of the study."""
    keys = line_keys(study, chart)
    found: dict[str, list[StudyRow]] = {}
    for row in rows:
        values = [_line_words(study, chart, key, row.text(key)) for key in keys if row.text(key)]
        found.setdefault(", ".join(values), []).append(row)
    return found


def _line_words(study: StudyTable, chart: ChartSpec, key: str, value: str) -> str:
    """A value as the label of a line; a number with the key's name and its unit."""
    words = value_words(chart, key, value)
    if not study.is_numeric(key) or value in chart.labels:
        return words
    name, _, unit = axis_words(study, chart, key).partition(" [")
    return " ".join(filter(None, (name, words, unit.rstrip("]"))))


def panel_rows(study: StudyTable, chart: ChartSpec) -> dict[str, list[StudyRow]]:
    """Rows by the value of the key `panels`; all under "" without."""
    rows = select(study, chart.only)
    if not chart.panels:
        return {"": rows}
    key = chart.panels
    return {value: [row for row in rows if row.text(key) == value] for value in study.values(key)}


def pareto(lines: Sequence[ChartLine]) -> list[ChartPoint]:
    """Marks and returns the points that none beats in x and y, in ascending x; seconds of shared machines do not count."""
    order = sorted(
        (p.x, p.y, k, i)
        for k, line in enumerate(lines)
        for i, p in enumerate(line.points)
        if p.known and p.alone
    )
    best, found = float("inf"), []
    for _, y, k, i in order:
        if y < best:
            best = y
            lines[k].points[i] = replace(lines[k].points[i], best=True)
            found.append(lines[k].points[i])
    return found
