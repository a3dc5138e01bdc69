"""What must hold between the [[chart]] tables of a study file and its keys and quantities."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from pydantic_core import PydanticCustomError

from ancf_petsc.errors import did_you_mean
from ancf_petsc.input.types import problem
from ancf_petsc.post.charts.spec import ChartSpec

SIZES = ("h", "elements", "dof", "ranks", "steps", "newton", "linear", "solve_seconds", "total_seconds")
"""Columns of study.csv beside keys and quantities that a chart may have along x."""


def chart_problems(
    charts: Sequence[ChartSpec], keys: Collection[str], quantities: Collection[str]
) -> Iterator[PydanticCustomError]:
    """All that is wrong with the charts of a study that varies `keys`; each at its place below the study's tables."""
    names = [chart.file_name for chart in charts]
    for index, chart in enumerate(charts):
        if chart.file_name in names[:index]:
            yield problem(
                f"a second chart of the name {chart.file_name!r}",
                at=["chart", index, "name"],
                got=chart.name,
                expected="each name once",
                cure="give one of them a name of its own",
            )
        for name, word, known in _named(chart, tuple(keys), tuple(quantities)):
            if word not in known:
                yield problem(
                    at=["chart", index, *name],
                    got=word,
                    expected="a quantity of this study" if "quantity" in name else "a key of this study",
                    cure=did_you_mean(word, known),
                )


def _named(
    chart: ChartSpec, keys: tuple[str, ...], quantities: tuple[str, ...]
) -> Iterator[tuple[tuple[str | int, ...], str, tuple[str, ...]]]:
    """(path to the entry, word, what it may be) of all keys and quantities that a chart names."""
    if chart.quantity:
        yield ("quantity",), chart.quantity, quantities
    for index, line in enumerate(chart.predicted):
        if line.quantity:
            yield ("predicted", index, "quantity"), line.quantity, quantities
    for word in chart.lines:
        yield ("lines",), word, keys
    for word in chart.only:
        yield ("only",), word, keys
    if chart.panels:
        yield ("panels",), chart.panels, keys
    if chart.kind == "map":
        yield ("x",), chart.x or "", (*keys, *SIZES)
        yield ("y",), chart.y[0], (*keys, *SIZES)
    elif chart.kind != "curves" and chart.x:
        yield ("x",), chart.x, (*keys, *SIZES, *quantities)
