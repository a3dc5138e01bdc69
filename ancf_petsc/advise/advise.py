"""From a case, a quantity and a target to the cheapest discretisation."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ancf_petsc.advise.choose import BestGuess, Choice, ranked
from ancf_petsc.advise.lab import Lab
from ancf_petsc.advise.line import Discretisation
from ancf_petsc.advise.meshes import elements_for, families
from ancf_petsc.advise.motion import SPACE, Timing, timings
from ancf_petsc.advise.question import read_quantity, read_target
from ancf_petsc.advise.report import Advice, Recommendation, percent
from ancf_petsc.advise.scene import working_case
from ancf_petsc.advise.search import FIRST, Ranking, begin, search
from ancf_petsc.advise.steps import STEPS, fewest_steps
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case
from ancf_petsc.reduce.findings import findings
from ancf_petsc.studies.facts import estimate
from ancf_petsc.studies.spec import END, OutputAt, QuantitySpec

log = logging.getLogger("ancf")
BUDGET = 600.0
"""Seconds, where the user names none."""
ENOUGH = 4


@dataclass
class _Search:
    """What belongs to one piece of advice. lines: all that is tried; free: whether load steps may be chosen."""

    case: Case
    lab: Lab
    target: float
    free: bool
    lines: list[Discretisation]
    notes: list[str] = field(default_factory=list)


def advise(
    case: Case,
    quantity: str,
    within: str,
    folder: Path,
    budget: float | None = None,
    announce: Callable[[str], None] = lambda line: None,
) -> Advice:
    """The cheapest element, mesh and step whose error is within the target. Runs go to `folder`. Raises CaseError.

    announce: gets lines on what will be done and what was found.
    """
    asked, target = read_quantity(quantity), read_target(within)
    base, asked, free = working_case(case, asked, folder)
    dynamics = base.spec.dynamics
    lab = Lab(base, asked, folder, budget or BUDGET, "energy_drift" if dynamics else "", announce)
    lines = _lines(base)
    work = _Search(base, lab, target, free, lines)
    announce(_announcement(work))
    found, timing = _motion(work) if dynamics else _statics(work)
    advice = _advice(work, found, timing, case, quantity)
    advice.findings = scene_findings(case, read_quantity(quantity))
    advice.write(folder)
    return advice


def run_best(advice: Advice, lab_folder: Path, announce: Callable[[str], None]) -> None:
    """Run what was advised, in a folder of its own, and note the error it has and the seconds it took."""
    from ancf_petsc.input.load import load_case

    assert advice.best is not None
    assert advice.guess is not None
    base = load_case(lab_folder / "case.toml")
    asked = read_quantity(advice.quantity)
    _, asked, _ = _asked_of(base, asked)
    lab = Lab(base, asked, lab_folder / "run", BUDGET, "", announce)
    trial = lab.make(advice.best.changes, advice.best.words)
    if trial is None or trial.value is None:
        raise CaseError("the advised run did not come to its end", file=lab.folder)
    advice.achieved = {
        "value": trial.value,
        "error": abs(trial.value / advice.guess.value - 1.0),
        "seconds": trial.seconds,
        "run": str(trial.row.folder),  # type: ignore[dict-item]
    }
    advice.write(lab_folder)


def _asked_of(base: Case, asked: Any) -> tuple[Case, Any, bool]:
    """What is asked of a working case: its path ends where the quantity is taken."""
    if base.spec.statics is not None and asked.at is not None and base.spec.statics.control == "load":
        return base, QuantitySpec(column=asked.column, at=OutputAt(END)), True
    return base, asked, False


def scene_findings(case: Case, asked: QuantitySpec) -> list[str]:
    """What of the model its scene does not need, in sentences with the commands for it."""
    at = {} if asked.at is None or asked.at.column == END else {asked.at.column: asked.at.value}
    return [str(finding) for finding in findings(case, at=at)]


def _lines(case: Case) -> list[Discretisation]:
    """Every element on every family of meshes; the case's own element first."""
    known, _ = families(case)
    found = [Discretisation(code, family) for family in known for code in elements_for(case, family)]
    return sorted(found, key=lambda line: line.code != case.spec.mesh.element)


def _announcement(work: _Search) -> str:
    """How many runs to begin with, and about how long: an estimate from sizes alone."""
    count, seconds = 0, 0.0
    for line in work.lines:
        for level in FIRST:
            changes = line.changes(level)
            run = None if changes is None else work.lab.plan(changes)
            if run is not None and run.facts is not None and run.facts.dof <= 25_000:
                count += 1
                seconds += estimate(run.case.spec, run.facts)
    names = ", ".join(dict.fromkeys(line.code for line in work.lines))
    kinds = ", ".join(dict.fromkeys(line.family.name for line in work.lines))
    return (
        f"elements {names}; meshes {kinds}; about {count} runs to begin with, some {seconds:.0f} s, "
        f"then finer ones where they pay; at most {work.lab.budget:.0f} s"
    )


def _statics(work: _Search) -> tuple[Ranking, None]:
    if work.free:
        count = _first_steps(work)
        for line in work.lines:
            line.more = {STEPS: count}
    begin(work.lines, work.lab)
    found = search(work.lines, work.lab, work.target)
    if work.free and found.choices and found.guess:
        found = _steps_of_best(work, found, found.guess)
    return found, None


def _first_steps(work: _Search) -> int:
    """The fewest steps that the first discretisation that works needs."""
    for line in work.lines:
        count = fewest_steps(line, 0.0, work.lab)
        if count is not None:
            return count
    own = work.case.spec.statics
    return own.steps or 1 if own else 1


def _steps_of_best(work: _Search, found: Ranking, guess: BestGuess) -> Ranking:
    """Whether fewer or more steps are cheaper for the best: tried where it stands, if that is affordable."""
    best = found.choices[0]
    count = int(best.line.more[STEPS])
    others = sorted({max(1, count // 2), count, 2 * count})
    if best.seconds * len(others) > work.lab.left:
        return found
    better = fewest_steps(best.line, best.level, work.lab, others)
    if better is not None and better != count:
        best.line.more = {**best.line.more, STEPS: better}
        changed = best.line.make(work.lab, best.level)
        if changed is None or changed.value is None:
            best.line.more = {**best.line.more, STEPS: count}
    return Ranking(guess, ranked(work.lines, guess, work.target), found.complete)


def _motion(work: _Search) -> tuple[Ranking, Timing | None]:
    """Time on one coarse mesh first, then space with the cheapest integrator that was good enough."""
    ways: list[Timing] = []
    for line in work.lines:
        ways = timings(work.case, line, work.lab, work.target)
        if ways:
            break
    if not ways:
        work.notes.append("no integrator was within its share of the target on a coarse mesh")
        return Ranking(None, [], complete=False), None
    for way in ways:
        drift = f"energy drifts by {100 * way.drift:.2g} % of the largest"
        work.notes.append(
            f"in time alone, {way.words}: error {100 * way.error:.2g} %, {drift}, {way.trial.solution:.3g} s of solution "
            f"with {way.trial.facts.dof} degrees of freedom"
        )
    best = ways[0]
    for line in work.lines:
        line.more = dict(best.changes)
    begin(work.lines, work.lab)
    found = search(work.lines, work.lab, SPACE * work.target)
    if found.choices and found.guess:
        best = _cheaper_in_time(work, found, found.guess, ways)
        found = Ranking(found.guess, ranked(work.lines, found.guess, SPACE * work.target), found.complete)
    return found, best


def _cheaper_in_time(work: _Search, found: Ranking, guess: BestGuess, ways: list[Timing]) -> Timing:
    """The integrator that is cheapest on the mesh that was chosen: costs change with the mesh."""
    choice, best = found.choices[0], ways[0]
    cheapest = choice.seconds
    for way in ways[1:]:
        changes = choice.line.changes(choice.level)
        if changes is None or work.lab.left < ENOUGH * choice.seconds:
            break
        trial = work.lab.make({**changes, **way.changes}, f"{choice.words}, {way.words}")
        if trial is None or not trial.value:
            continue
        good = abs(trial.value / guess.value - 1.0) <= SPACE * work.target + way.error
        if good and trial.seconds < cheapest:
            cheapest, best = trial.seconds, way
            choice.line.more = dict(way.changes)
            choice.line.trials[choice.level] = trial
    return best


def _advice(work: _Search, found: Ranking, timing: Timing | None, case: Case, quantity: str) -> Advice:
    guess = found.guess
    known = guess is not None and guess.uncertainty <= work.target
    made = [_recommended(choice, guess, timing, work) for choice in found.choices[:2]] if known else []
    failures = {
        line.name: line.stopped
        for line in work.lines
        if line.stopped and line.stopped not in ("no such mesh",)
    }
    notes = list(work.notes)
    if not found.complete:
        notes.append("the budget or the meshes ended the search before it was complete")
    if guess is not None and not known:
        notes.append(
            f"the reference is uncertain by {percent(guess.uncertainty)}, more than the target: "
            "a larger --budget makes it surer where finer meshes converge"
        )
    elif guess is not None and not guess.claimed:
        notes.append(
            "without a limit the error is against where the best ladder leads: more than that cannot be promised"
        )
    nearest = None
    if not made and guess is not None:
        nearest = _nearest(work, guess, timing)
    return Advice(
        quantity=quantity,
        target=work.target,
        case_file=work.lab.case_file,
        guess=guess,
        best=made[0] if made else None,
        runner_up=made[1] if len(made) > 1 else None,
        runs=len(work.lab.trials),
        spent=work.lab.spent,
        failures=failures,
        nearest=nearest,
        notes=notes,
    )


def _nearest(work: _Search, guess: BestGuess, timing: Timing | None) -> Recommendation | None:
    """The trial with the smallest error."""
    known = [(line, level) for line in work.lines for level in line.levels]
    if not known:
        return None
    line, level = min(known, key=lambda pair: pair[0].error(pair[1], guess.value))
    choice = Choice(line, level, line.error(level, guess.value), line.seconds(level), measured=True)
    return _recommended(choice, guess, timing, work)


def _recommended(
    choice: Choice, guess: BestGuess | None, timing: Timing | None, work: _Search
) -> Recommendation:
    line = choice.line
    changes = line.changes(choice.level) or {}
    words, parts, error = choice.words, {}, choice.error
    if STEPS in line.more:
        count = line.more[STEPS]
        words += f", {count} step{'s' * (count > 1)}"
    if timing is not None:
        words += f", {timing.words}"
        parts = {"mesh": choice.error, "time": timing.error, "drift of energy": timing.drift}
        error += timing.error
    return Recommendation(
        words,
        changes,
        error,
        guess.uncertainty if guess else 0.0,
        choice.seconds,
        line.dof_at(choice.level),
        choice.measured,
        parts,
    )
