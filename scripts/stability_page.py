"""Tables of docs/stability.md: where methods fail, predicted beside measured, from the tables of the studies alone."""

from __future__ import annotations

from collections.abc import Sequence

from study_list import KEPT

from ancf_petsc.post.charts.study_table import StudyRow, StudyTable, read_study, written
from ancf_petsc.post.charts.words import outcome_words

GROWN = {
    "stiff_pendulum_stability": 19.0,
    "tumbling_block_stability": 10.0,
    "cantilever_explicit_limit": 1e-9,
}
"""Joules of energy gained from which a run counts as unstable: the factor of the study's map."""
INTEGRATORS = {
    "theta": "trapezoidal rule",
    "generalized_alpha": "generalised alpha",
    "energy_momentum": "energy-momentum",
    "bdf": "bdf",
    "rosenbrock": "Rosenbrock",
}
BODIES = {
    "pvc_block_load_steps": ("grooved block, 3413, neo-Hooke", "constraint.top.move.z", "mm", 1e3),
    "pvc_block_load_steps_pad": ("bonded cube, 3-10-1-3, nu = 0.499", "constraint.top.move.z", "mm", 1e3),
    "cantilever_load_steps": ("cantilever, 3-10-1-3", "load.end.total", "N", 1.0),
    "bar_tension_load_steps": ("bar in tension, 3413", "load.bottom_edges.total", "N", 1.0),
}
SEARCHES = {"": "whole steps, then bt (the program's)", "bt": "bt", "cp": "cp", "l2": "l2"}
LAYERS = ("1", "0.1", "0.01", "0.001", "0.0001")
SLENDER = ("1 : 10", "1 : 30", "1 : 100", "1 : 300", "1 : 1000")


def kept(name: str) -> StudyTable:
    return read_study(KEPT / name)


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]


def having(study: StudyTable, **cells: str) -> list[StudyRow]:
    """Rows with these cells; in the names of keys, __ stands for a dot."""
    wanted = {key.replace("__", "."): value for key, value in cells.items()}
    return [row for row in study.rows if all(row.text(key) == value for key, value in wanted.items())]


def limits(study: StudyTable, rows: Sequence[StudyRow], quantity: str) -> str:
    """The longest step up to which all are stable, and the shortest that is not: ended early, or gained energy."""
    grown = GROWN[study.folder.name]
    steps = sorted(rows, key=lambda row: row.number("dynamics.step"))
    bad = [not row.ended or row.number(quantity) > grown for row in steps]
    first = bad.index(True) if True in bad else len(steps)
    good = f"{steps[first - 1].number('dynamics.step'):.3g}" if first else "none"
    return f"{good}, not {steps[first].number('dynamics.step'):.3g}" if first < len(steps) else f"{good}"


def predicted(study: StudyTable, x: float) -> str:
    """The limit of the trapezoidal rule that the study's map has at x."""
    (chart,) = [chart for chart in study.charts if chart.kind == "map"]
    points = [point for line in chart.predicted for point in line.points or ()]
    return next((f"{y:.3g}" for at, y in points if abs(at - x) <= 1e-9 * abs(x)), "")


def stiff() -> list[str]:
    study, rows = kept("stiff_pendulum_stability"), []
    methods = [name for name in INTEGRATORS if having(study, dynamics__integrator=name)]
    for young in study.values("material.young"):
        cells = [
            limits(study, having(study, material__young=young, dynamics__integrator=m), "gained")
            for m in methods
        ]
        rows.append(
            [f"{float(young):.0e}".replace("+0", "").replace("+", ""), predicted(study, float(young)), *cells]
        )
    return table(
        ["E, Pa", "trapezoidal rule, predicted", *(f"{INTEGRATORS[m]}, measured" for m in methods)], rows
    )


def tumbling() -> list[str]:
    study, rows = kept("tumbling_block_stability"), []
    methods = [name for name in INTEGRATORS if having(study, dynamics__integrator=name)]
    for place, spin in enumerate(study.values("initial.spin")):
        cells = [
            limits(study, having(study, initial__spin=spin, dynamics__integrator=m), "energy")
            for m in methods
        ]
        rows.append([f"{5 * (place + 1)}", predicted(study, float(place)), *cells])
    heads = ["spin, rad/s", "trapezoidal rule, predicted", *(f"{INTEGRATORS[m]}, measured" for m in methods)]
    return table(heads, rows)


def explicit() -> list[str]:
    study, rows = kept("cantilever_explicit_limit"), []
    for body, layer in zip(study.values("mesh.body"), LAYERS, strict=True):
        cells = [layer]
        for method in ("central_difference", "runge_kutta_5dp"):
            some = having(study, mesh__body=body, dynamics__integrator=method)
            cells += [f"{some[0].number('limit'):.3g}", limits(study, some, "gained")]
        rows.append(cells)
    heads = [
        "thinnest layer over the others",
        "central differences, predicted",
        "measured",
        "5dp, predicted",
        "measured",
    ]
    return table(heads, rows)


def compression() -> list[str]:
    rows = []
    for row in kept("pvc_block_compression").rows:
        law, bonded = row.text("material.law"), written(row.text("constraint.top.fix")) == "[x,y]"
        line = {"svk": "0.640 (Biot), 0.577 (bar)", "neo_hooke": "0.517 (Biot)"}[law]
        sizes = [f"{1e3 * row.number('mesh.size'):g}", f"{-1e3 * row.number('stroke'):.1f}"]
        ends = [f"{row.number('stretch'):.3f}", outcome_words(row.outcome)]
        rows.append([law, "bonded" if bonded else "lubricated", *sizes, line, *ends])
    heads = [
        "law",
        "ends",
        "edges, mm",
        "stroke, mm of 100",
        "stretch predicted",
        "smallest measured",
        "the program says",
    ]
    return table(heads, rows)


def near_a_half() -> list[str]:
    study, rows = kept("pvc_block_incompressible"), []
    for chart in study.charts:
        right = {round(nu, 9): force for nu, force in chart.predicted[0].points or ()}
        codes = list(chart.only["mesh.element"])
        for code in codes:
            some = {
                round(row.number("material.poisson"), 9): row for row in having(study, mesh__element=code)
            }
            errors = [
                f"{100 * (abs(some[nu].number('compression')) / right[nu] - 1):+.3g} %" for nu in sorted(some)
            ]
            rows.append([code, *errors])
    return table(["element", *(f"nu = {nu:g}" for nu in sorted(right))], rows)


def slender() -> list[str]:
    rows, tables = [], [kept("cantilever_slenderness"), kept("cantilever_slivers")]
    for code in dict.fromkeys(row.text("mesh.element") for row in tables[0].rows):
        cells = [code]
        for study in tables:
            for body in study.values("mesh.body"):
                (row,) = having(study, mesh__element=code, mesh__body=body)
                cells.append(f"{row.number('end') / -0.01:.3g}" if row.ended else outcome_words(row.outcome))
        rows.append(cells)
    return table(["element", *SLENDER, *(f"layer {thin}" for thin in LAYERS)], rows)


def load_steps() -> list[str]:
    rows = []
    for name, (words, key, unit, factor) in BODIES.items():
        study = kept(name)
        for search, said in SEARCHES.items():
            some = [row for row in study.rows if row.text("petsc.snes_linesearch_type") == search]
            cells = []
            for steps in ("1", "4"):
                loads = [row for row in some if row.text("statics.steps") == steps]
                cells.append(longest(loads, key, unit, factor))
            rows.append([words, said, *cells])
    return table(
        ["body", "line search", "one output, steps up to 0.4", "four outputs, steps up to 0.25"], rows
    )


def longest(rows: Sequence[StudyRow], key: str, unit: str, factor: float) -> str:
    """The largest load up to which every run reached its end without a step being cut."""

    def load(row: StudyRow) -> float:
        return max(abs(float(part)) for part in written(row.text(key)).strip("[]").split(","))

    best = 0.0
    for row in sorted(rows, key=load):
        if row.outcome != "reached":
            break
        best = load(row)
    return f"{factor * best:g} {unit}" if best else "none of these"


BLOCKS = {
    "stiff": stiff,
    "tumbling": tumbling,
    "explicit": explicit,
    "compression": compression,
    "near_a_half": near_a_half,
    "slender": slender,
    "load_steps": load_steps,
}
