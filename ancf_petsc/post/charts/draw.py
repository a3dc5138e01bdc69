"""All charts of studies: what each kind draws, and the files it leaves."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from ancf_petsc.errors import CaseError, writing
from ancf_petsc.post.charts.curves import curve_panels, draw_curves
from ancf_petsc.post.charts.errors import (
    convergence_panels,
    draw_convergence,
    draw_precision,
    precision_panels,
)
from ancf_petsc.post.charts.maps import draw_map, map_panels, map_records
from ancf_petsc.post.charts.points import ChartPanel
from ancf_petsc.post.charts.profile import draw_profile, profile_panels
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import StudyTable
from ancf_petsc.post.charts.values import draw_values, value_panels
from ancf_petsc.post.figures import file_name, save

Record = dict[str, Any]


class ChartMaker(NamedTuple):
    """panels: what is drawn, none where there is too little; draw: the picture."""

    panels: Callable[[StudyTable, ChartSpec], list[ChartPanel]]
    draw: Callable[[StudyTable, ChartSpec, list[ChartPanel]], Figure]


class DrawnChart(NamedTuple):
    """A picture and its numbers, one record a point."""

    name: str
    figure: Figure
    records: list[Record]


MAKERS = {
    "work_precision": ChartMaker(precision_panels, draw_precision),
    "convergence": ChartMaker(convergence_panels, draw_convergence),
    "map": ChartMaker(map_panels, draw_map),
    "values": ChartMaker(value_panels, draw_values),
    "curves": ChartMaker(curve_panels, draw_curves),
    "profile": ChartMaker(
        lambda study, chart: profile_panels([study], chart),
        lambda study, chart, panels: draw_profile([study], chart, panels),
    ),
}


def charts_wanted(study: StudyTable) -> list[ChartSpec]:
    """The study's [[chart]] tables; without any, those that each quantity allows."""
    return study.charts or [chart for name in study.quantities for chart in _charts_without_spec(study, name)]


def _charts_without_spec(study: StudyTable, quantity: str) -> list[ChartSpec]:
    """Work against precision, and convergence; without errors the values over the last key of numbers, if there is one."""
    if any(row.number(f"{quantity}_error") >= 0 for row in study.rows):
        return [ChartSpec(kind=kind, quantity=quantity) for kind in ("work_precision", "convergence")]
    varied = [key for key in study.keys if len(study.values(key)) > 1]
    along = [key for key in varied if study.is_numeric(key)]
    if not along:
        return []
    lines = tuple(key for key in varied if key != along[-1])
    return [ChartSpec(kind="values", quantity=quantity, x=along[-1], lines=lines)]


def charts_of(study: StudyTable) -> tuple[list[DrawnChart], list[str]]:
    """The charts of a study, and the names of those with too few points to draw."""
    drawn, empty = [], []
    for chart in charts_wanted(study):
        maker = MAKERS[chart.kind]
        panels = maker.panels(study, chart)
        if not panels:
            empty.append(chart.file_name)
            continue
        records = map_records(study, chart, panels) if chart.kind == "map" else records_of(panels)
        drawn.append(DrawnChart(chart.file_name, maker.draw(study, chart, panels), records))
    return drawn, empty


def profile_of(studies: Sequence[StudyTable]) -> DrawnChart | None:
    """The profile over several studies; None where they have no errors to compare."""
    chart = ChartSpec(kind="profile")
    panels = profile_panels(studies, chart)
    return DrawnChart("profile", draw_profile(studies, chart, panels), records_of(panels)) if panels else None


def records_of(panels: Iterable[ChartPanel]) -> list[Record]:
    return [record for panel in panels for record in panel.records()]


def save_charts(charts: Sequence[DrawnChart], folder: Path, suffixes: Sequence[str]) -> list[Path]:
    """Write the pictures of each and NAME.csv; the files written. Raises CaseError where two have one name."""
    names = [file_name(chart.name) for chart in charts]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise CaseError("two charts of this name", file=folder, got=twice, cure="give one a name of its own")
    paths = []
    for chart in charts:
        for suffix in suffixes:
            paths += save({chart.name: chart.figure}, folder, suffix)
        path = folder / f"{file_name(chart.name)}.csv"
        with writing(path, "--out"):
            _write_records(path, chart.records)
        paths.append(path)
    return paths


def _write_records(path: Path, records: Sequence[Record]) -> None:
    """Numbers in all their digits; nothing where there is none."""
    columns = list(dict.fromkeys(name for record in records for name in record))
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, columns, lineterminator="\n")
        table.writeheader()
        for record in records:
            table.writerow({name: "" if value != value else value for name, value in record.items()})
