"""Words of charts: how runs ended, keys and columns with their units."""

from __future__ import annotations

import re

from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import StudyTable, written
from ancf_petsc.post.units import Units, as_typed, with_unit

OUTCOMES = {
    "reached": "reached",
    "done": "reached",
    "cut_steps": "reached, steps cut",
    "energy_grown": "energy grown",
    "material_limit": "material limit",
    "surface_fold": "surface fold",
    "lost_definiteness": "lost definiteness",
    "limit_point": "limit point",
    "inverted_element": "inverted element",
    "step_too_long": "step too long",
    "diverged": "diverged",
    "interrupted": "interrupted",
    "timeout": "out of time",
    "crashed": "crashed",
    "wrong_input": "wrong input",
    "failed": "failed",
    "skipped": "skipped",
}
"""How a run ended -> a short name."""

KEYS = {
    "mesh.size": "edge length",
    "mesh.rim": "edge length at rims",
    "mesh.refine": "refinements",
    "mesh.element": "element",
    "mesh.divisions": "divisions",
    "material.law": "law",
    "material.young": "Young's modulus",
    "material.poisson": "Poisson's ratio",
    "dynamics.step": "time step",
    "dynamics.tolerance": "tolerance",
    "dynamics.integrator": "integrator",
    "dynamics.spectral_radius": "spectral radius",
    "statics.steps": "load steps",
    "h": "mean size of elements",
    "dof": "degrees of freedom",
    "elements": "elements",
    "solve_seconds": "seconds of the solution",
    "total_seconds": "seconds",
    "newton": "Newton iterations",
    "linear": "linear iterations",
    "pseudo_time": "pseudo-time",
    "time": "time",
}
LENGTHS = ("mesh.size", "mesh.rim", "h", "stroke")
TIMES = ("dynamics.step", "dynamics.duration", "time")
STRESSES = ("material.young",)


def outcome_words(outcome: str) -> str:
    """A short name of how a run ended."""
    return OUTCOMES.get(outcome, outcome.replace("_", " "))


def unit_of(name: str, units: Units) -> str:
    """The unit of a key or column, empty where it has none or is not known."""
    for names, unit in ((LENGTHS, units.length), (TIMES, units.time), (STRESSES, units.stress)):
        if name in names:
            return unit
    if re.search(r"\.u?[xyz]$", name) and not name.startswith(("momentum", "angular_momentum")):
        return units.length
    if re.search(r"\.r[xyz]$", name) or name.startswith("force"):
        return units.force
    return units.energy if name.endswith(("_energy", "_work", "_drift")) else ""


def axis_words(study: StudyTable, chart: ChartSpec, name: str) -> str:
    """A key, column or quantity with its unit."""
    if name in chart.labels:
        return as_typed(chart.labels[name])
    if name in study.quantities:
        unit = study.quantities[name].get("unit") or ""
        return with_unit(as_typed(name.replace("_", " ")), str(unit))
    plain = KEYS.get(name, name.rpartition(".")[2] if name in study.keys else name).replace("_", " ")
    return with_unit(as_typed(plain), unit_of(name, study.units))


def value_words(chart: ChartSpec, key: str, value: str) -> str:
    """A value of a key; numbers in four digits."""
    short = written(value)
    for name in (value, short):
        if name in chart.labels:
            return as_typed(chart.labels[name])
    if not value:
        return "default"
    if re.fullmatch(r"\d{4}", value):  # a code of an element
        return value
    try:
        return re.sub(r"e([+-])0*", lambda sign: "e" + sign[1].strip("+"), f"{float(value):.4g}")
    except ValueError:
        if re.fullmatch(r"\[[\d,]+\]", short):
            return " x ".join(short[1:-1].split(","))
        return as_typed(short.replace("_", " "))


def title_of(study: StudyTable, chart: ChartSpec) -> str:
    return as_typed(chart.title or study.title)
