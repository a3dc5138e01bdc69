"""[[chart]] tables of study files: what is refused, and in which words."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.studies.chart_spec import chart_problems

KEYS, QUANTITIES = ("mesh.element", "mesh.size", "dynamics.step"), ("force", "tip")


def problems(*charts):
    made = [ChartSpec.model_validate(table, strict=False) for table in charts]
    return [found.context for found in chart_problems(made, KEYS, QUANTITIES)]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"kind": "convergence"}, "missing"),
        ({"kind": "map", "x": "mesh.size"}, "missing"),
        ({"kind": "convergence", "quantity": "force", "factor": 2.0}, "a chart of kind convergence does not take it"),
        ({"kind": "map", "x": "mesh.size", "y": "dynamics.step", "factor": 2.0}, "missing"),
        ({"kind": "values", "x": "mesh.size", "quantity": "force", "predicted": [{"label": "Biot"}]}, "nothing given"),
    ],
)  # fmt: skip
def test_a_chart_needs_its_keys_and_takes_no_others(table, words):
    with pytest.raises(ValidationError, match=words):
        ChartSpec.model_validate(table, strict=False)


@pytest.mark.parametrize(
    ("table", "place", "cure"),
    [
        ({"kind": "convergence", "quantity": "froce"}, ("quantity",), "did you mean 'force'"),
        ({"kind": "convergence", "quantity": "force", "x": "mesh.sise"}, ("x",), "did you mean 'mesh.size'"),
        ({"kind": "curves", "y": "tip.z", "lines": "mesh.elment"}, ("lines",), "did you mean 'mesh.element'"),
        ({"kind": "curves", "y": "tip.z", "only": {"mesh.sise": 1}}, ("only",), "did you mean 'mesh.size'"),
        ({"kind": "curves", "y": "tip.z", "panels": "step"}, ("panels",), "there are"),
        ({"kind": "map", "x": "mesh.size", "y": "step"}, ("y",), "steps"),
    ],
)  # fmt: skip
def test_misspelt_keys_and_quantities_are_found_before_anything_runs(table, place, cure):
    (found,) = problems(table)
    assert found["at"] == ("chart", 0, *place)
    assert cure in found["cure"]


def test_two_charts_need_two_names():
    table = {"kind": "convergence", "quantity": "force"}
    (found,) = problems(table, table)
    assert found["what"] == "a second chart of the name 'convergence_force'"
    assert not problems(table, {**table, "name": "other"})
