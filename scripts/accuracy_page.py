"""Tables of docs/accuracy.md: which element, mesh and step give 5 %, 1 % and 0.1 %, from the tables of three studies alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import NamedTuple

from study_list import KEPT

from ancf_petsc.post.charts.study_table import StudyRow, StudyTable, read_study
from ancf_petsc.post.charts.words import outcome_words

TARGETS = (0.05, 0.01, 0.001)
SHARED = "not timed"
"""In place of seconds of runs that shared the machine."""


class Problem(NamedTuple):
    """study: its name among the kept ones. quantity: what errors are of. by: keys whose values name a run."""

    study: str
    quantity: str
    by: tuple[str, ...]


PROBLEMS = {
    "block": Problem("pvc_block_accuracy", "force", ("mesh.element", "mesh.size", "mesh.rim")),
    "revolution": Problem("pvc_block_revolution", "force", ("mesh.element", "mesh.size", "mesh.rim")),
    "cantilever": Problem("cantilever_accuracy", "end", ("mesh.element", "mesh.refine")),
    "pendulum": Problem(
        "pendulum_accuracy", "tip", ("dynamics.integrator", "dynamics.step", "dynamics.tolerance")
    ),
}
WORDS = {"mesh.size": "edges of {:g} mm", "mesh.rim": "{:g} mm at the rims"}
INTEGRATORS = {"theta": "trapezoidal rule"}


def section(problem: Problem) -> Iterator[str]:
    """One problem: the cheapest run for each target in words, the table of all elements or integrators, the machine."""
    study = read_study(KEPT / problem.study)
    for target in TARGETS:
        yield sentence(problem, study, target)
    yield ""
    yield "| " + " | ".join(("", *(f"{100 * target:g} %" for target in TARGETS))) + " |"
    yield "|---" * (len(TARGETS) + 1) + "|"
    for name, rows in lines_of(study, problem.by[0]).items():
        cells = [cell(problem, cheapest(rows, problem.quantity, target)) for target in TARGETS]
        yield "| " + " | ".join((name, *cells)) + " |"
    yield ""
    yield from failures(study)
    yield machine(study)


def lines_of(study: StudyTable, key: str) -> dict[str, list[StudyRow]]:
    """Rows by element or integrator."""
    found: dict[str, list[StudyRow]] = {}
    for row in study.rows:
        found.setdefault(INTEGRATORS.get(row.text(key), row.text(key).replace("_", " ")), []).append(row)
    return found


def cost(row: StudyRow) -> float:
    """Seconds, where they count; degrees of freedom stand in for them where no run was alone."""
    return row.number("solve_seconds") if row.alone else float("inf")


def cheapest(rows: Sequence[StudyRow], quantity: str, target: float) -> StudyRow | None:
    """The run with the fewest seconds (without seconds: degrees of freedom, then steps) within an error."""
    good = [row for row in rows if row.ended and row.number(f"{quantity}_error") <= target]
    return min(good, key=lambda row: (cost(row), row.number("dof"), row.number("steps")), default=None)


def sentence(problem: Problem, study: StudyTable, target: float) -> str:
    """What to take for a target."""
    row = cheapest(study.rows, problem.quantity, target)
    if row is None:
        best = min(
            (row for row in study.rows if row.number(f"{problem.quantity}_error") >= 0),
            key=lambda row: row.number(f"{problem.quantity}_error"),
        )
        nearest = f"the nearest, {named(problem, best)}, is off by {percent(problem, best)}"
        return f"- **{100 * target:g} %**: none of these; {nearest}."
    size = f"{row.number('dof'):,.0f} degrees of freedom"
    words = f"{named(problem, row)}: {size}, {seconds(row)}, error {percent(problem, row)}"
    return f"- **{100 * target:g} %: {words}.**"


def named(problem: Problem, row: StudyRow) -> str:
    """A run in words."""
    if problem.by[0] == "dynamics.integrator":
        name = INTEGRATORS.get(
            row.text("dynamics.integrator"), row.text("dynamics.integrator").replace("_", " ")
        )
        step, tolerance = row.number("dynamics.step"), row.number("dynamics.tolerance")
        return f"{name} in steps of {step:g} s" if step == step else f"{name}, tolerance {tolerance:g}"
    words = [row.text("mesh.element")]
    if "mesh.refine" in problem.by:
        bricks = 10 * 2 ** int(row.number("mesh.refine"))
        across = bricks // 10
        return f"{words[0]} on {bricks} x {across} x {across} bricks"
    for key, text in WORDS.items():
        value = row.number(key)
        if value == value:
            words.append(text.format(1e3 * value))
    return f"{words[0]} with {', '.join(words[1:])}"


def cell(problem: Problem, row: StudyRow | None) -> str:
    """The same in the table, without its name."""
    if row is None:
        return ""
    words = named(problem, row)
    for part in (" with ", " on ", " in steps of ", ", tolerance "):
        if part in words:
            words = (
                part.strip(" ,").removeprefix("in ").replace("steps of", "step")
                + " "
                + words.partition(part)[2]
            )
            break
    words = words.removeprefix("with ").removeprefix("on ")
    return f"{words}: {seconds(row)}"


def percent(problem: Problem, row: StudyRow) -> str:
    error = 100 * row.number(f"{problem.quantity}_error")
    doubt = 100 * row.number(f"{problem.quantity}_uncertainty")
    return f"{error:.2g} %" + (f" (known to {doubt:.1g} %)" if doubt > 0 else "")


def seconds(row: StudyRow) -> str:
    return f"{row.number('solve_seconds'):.2g} s" if row.alone else SHARED


def failures(study: StudyTable) -> Iterator[str]:
    """How many runs have no answer, and why."""
    failed = [row for row in study.rows if not row.ended]
    if failed:
        names = sorted({outcome_words(row.outcome) for row in failed})
        yield f"{len(failed)} of {len(study.rows)} runs have no answer: {', '.join(names)}."
        yield ""


def times_cheaper() -> Iterator[str]:
    """How much less the section costs than the quarter within 1 %."""
    study = read_study(KEPT / "pvc_block_revolution")
    solid = [row for row in study.rows if row.text("mesh.element").startswith("3")]
    plane = [row for row in study.rows if row.text("mesh.element").startswith("2")]
    found = [cheapest(rows, "force", 0.01) for rows in (plane, solid)]
    if found[0] is None or found[1] is None:
        yield "One of them is not within 1 %."
        return
    small, large = found
    times = {key: large.number(key) / small.number(key) for key in ("dof", "solve_seconds", "total_seconds")}
    yield f"Within 1 % the section has {times['dof']:.0f} times fewer degrees of freedom than the quarter."
    if small.alone and large.alone:
        yield (
            f"It is solved {times['solve_seconds']:.0f} times faster, in {1e3 * small.number('solve_seconds'):.0f} ms; "
            f"the whole run is {times['total_seconds']:.1f} times faster, for the program's start is most of it."
        )


def machine(study: StudyTable) -> str:
    """Where it was measured; whether seconds count."""
    facts = study.facts["machine"]
    alone = any(row.alone for row in study.rows if row.ended)
    counted = (
        "Seconds are those of the solution on one rank; the program's start and the mesh take 0.9 s and more beside it."
        if alone
        else "It was not quiet: no seconds."
    )
    return f"{facts['processor']}, {facts['cores']} cores; {study.facts['date']}. {counted}"


def lumped() -> Iterator[str]:
    """What lumped mass adds to moments of inertia."""
    study = read_study(KEPT / "tumbling_block_lumped_mass")
    yield "| element | one cell an edge | 2 | 4 |"
    yield "|---|---|---|---|"
    for code, rows in lines_of(study, "mesh.element").items():
        errors = {row.number("mesh.refine"): row.number("spin_error") for row in rows}
        yield (
            f"| {code} | " + " | ".join(f"{100 * errors.get(k, float('nan')):.3g} %" for k in range(3)) + " |"
        )


BLOCKS = {name: partial(section, problem) for name, problem in PROBLEMS.items()} | {
    "lumped": lumped,
    "times_cheaper": times_cheaper,
}
