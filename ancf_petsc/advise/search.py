"""The search for the cheapest discretisation in space: cheap ladders of all, then finer levels where they pay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ancf_petsc.advise.choose import SURE, BestGuess, Choice, best_guess, ranked
from ancf_petsc.advise.lab import Lab
from ancf_petsc.advise.line import Discretisation

SHARE = 0.25
"""Of the budget that is left: what one run may be expected to take."""
FIRST = (0.0, 1.0)
"""Levels of every discretisation to begin with."""
LARGEST_FIRST = 25_000
"""Degrees of freedom that these may have; the coarsest level is run whatever it has."""
ROUNDS = 40


@dataclass
class Ranking:
    """What a search came to. choices: the cheapest first, one a discretisation. complete: False where the budget ended it."""

    guess: BestGuess | None
    choices: list[Choice]
    complete: bool


def begin(lines: Sequence[Discretisation], lab: Lab) -> None:
    """The first levels of all, coarse ones first."""
    for level in FIRST:
        for line in lines:
            if line.stopped or not _worth(line, level, lab):
                continue
            line.make(lab, level)


def _worth(line: Discretisation, level: float, lab: Lab) -> bool:
    """Whether a level is small enough to be run before anything is known of its error."""
    changes = line.changes(level)
    run = None if changes is None else lab.plan(changes)
    if run is None or run.facts is None:
        line.stopped = line.stopped or "no such mesh"
        return False
    if line.trials and line.seconds(level) > SHARE * lab.left:
        return False
    return run.facts.dof <= LARGEST_FIRST or level == 0.0


def search(lines: Sequence[Discretisation], lab: Lab, target: float) -> Ranking:
    """Go on from the first levels until the cheapest that is good enough has been run, and the guess is sure enough."""
    guess: BestGuess | None = None
    choices: list[Choice] = []
    for _ in range(ROUNDS):
        guess = best_guess(lines, lab)
        if guess is None:
            break
        choices = ranked(lines, guess, target)
        wanted = _next(lines, guess, choices, target, lab)
        if wanted is None:
            return Ranking(guess, choices, complete=bool(choices) and guess.uncertainty <= SURE * target)
        line, level = wanted
        line.make(lab, level)
        if lab.left <= 0:
            break
    guess = best_guess(lines, lab)
    return Ranking(guess, ranked(lines, guess, target) if guess else [], complete=False)


def _next(
    lines: Sequence[Discretisation], guess: BestGuess, choices: list[Choice], target: float, lab: Lab
) -> tuple[Discretisation, float] | None:
    """The run that tells most now: on the way to the cheapest choice, or finer, to know the limit."""
    affordable = SHARE * lab.left
    for choice in choices[:2]:
        if choice.measured:
            continue
        level = _towards(choice)
        if level is not None and choice.line.seconds(level) <= affordable:
            return choice.line, level
    if guess.uncertainty > SURE * target or not choices:
        return _finer(lines, guess, choices, target, affordable)
    return None


def _towards(choice: Choice) -> float | None:
    """The choice's own level, or one on the way to it where it is far beyond what is known."""
    line = choice.line
    last = line.levels[-1]
    if choice.level <= last + 1.5:
        return choice.level
    nearer = last + 1.0
    return nearer if line.family.mesh(nearer) else None


def _finer(
    lines: Sequence[Discretisation], guess: BestGuess, choices: list[Choice], target: float, affordable: float
) -> tuple[Discretisation, float] | None:
    """The next level of the line whose error falls farthest for what it costs."""
    found = []
    for line in lines:
        if line.stopped or len(line.rungs) < 2:
            continue
        level = line.levels[-1] + 1.0
        if line.family.mesh(level) is None or line.seconds(level) > affordable:
            continue
        if choices and _beyond(line, choices, target, guess):
            continue
        found.append((line.error(level, guess.value) * line.seconds(level), line, level))
    if not found:
        return None
    _, line, level = min(found, key=lambda item: item[0])
    return line, level


def _beyond(line: Discretisation, choices: list[Choice], target: float, guess: BestGuess) -> bool:
    """Whether a ladder already reaches well beyond the choice: the guess will not become surer by it."""
    finest = line.levels[-1]
    fine = line.error(finest, guess.value) < 0.25 * target
    return fine and line is not choices[0].line and len(line.rungs) >= 4
