"""What trials are compared with, and which discretisation is the cheapest that is good enough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ancf_petsc.advise.lab import Lab
from ancf_petsc.advise.line import Discretisation
from ancf_petsc.studies.richardson import ASYMPTOTIC

SURE = 0.2
"""Of the target: a reference that is less uncertain is good enough to choose by; half its uncertainty is kept as margin."""
MARGIN = 0.7
"""Of the target, that errors may reach where the reference is more uncertain."""
BETWEEN, BEYOND = 1.0, 0.95
"""Of what is allowed, that predicted errors may reach, between levels that were run and beyond them; what is chosen is run."""


@dataclass(frozen=True)
class BestGuess:
    """value; uncertainty: relative to it. claimed: whether a ladder converges to it. words: where it is from."""

    value: float
    uncertainty: float
    claimed: bool
    words: str


@dataclass(frozen=True)
class Choice:
    """A level of a discretisation with what is expected of it. measured: whether a trial was made."""

    line: Discretisation
    level: float
    error: float
    seconds: float
    measured: bool

    @property
    def words(self) -> str:
        """Element and mesh."""
        return self.line.described(self.level)


def best_guess(lines: Sequence[Discretisation], lab: Lab) -> BestGuess | None:
    """The limit of the ladder that is least uncertain; where none converges, where the best of them leads."""
    found = [(line, line.limit(lab)) for line in lines if len(line.rungs) >= 3]
    good = [(line, limit) for line, limit in found if limit.verdict == ASYMPTOTIC and limit.limit]
    if good:
        line, limit = min(good, key=lambda pair: pair[1].uncertainty or 0.0)
        assert limit.limit is not None
        assert limit.uncertainty is not None
        relative = limit.uncertainty / abs(limit.limit)
        return BestGuess(limit.limit, relative, True, f"limit of {line.name}: {limit.words}")
    led = [(line, line.doubtful_limit()) for line in lines]
    guesses = [(abs(line.values[-1] / end - 1), line, end) for line, end in led if end]
    if guesses:
        gap, line, end = min(guesses, key=lambda guess: guess[0])
        limit = line.limit(lab)
        return BestGuess(
            end, max(gap, 1e-15), False, f"no limit can be claimed ({limit.words}); {line.name} leads here"
        )
    return _of_finest(lines)


def _of_finest(lines: Sequence[Discretisation]) -> BestGuess | None:
    """The finest trial of the highest order whose last step was the smallest, as uncertain as twice that step."""
    long = [line for line in lines if len(line.rungs) >= 2 and line.values[-1] != 0.0]
    if not long:
        return None
    highest = max(line.order for line in long)
    line = min((line for line in long if line.order == highest), key=_last_step)
    words = f"no limit can be claimed from so few levels; the finest of {line.name}"
    return BestGuess(line.values[-1], 2.0 * _last_step(line), False, words)


def _last_step(line: Discretisation) -> float:
    """Relative change of the value from the level before the finest."""
    return abs(line.values[-2] / line.values[-1] - 1.0)


def allowed(guess: BestGuess, target: float) -> float:
    """The error against the guess up to which a measured one is taken."""
    return target - guess.uncertainty / 2 if guess.uncertainty <= SURE * target else MARGIN * target


def ranked(lines: Sequence[Discretisation], guess: BestGuess, target: float) -> list[Choice]:
    """The cheapest level of each discretisation that is good enough, the cheapest first."""
    limit, found = allowed(guess, target), []
    for line in lines:
        best: Choice | None = None
        for level in line.candidates():
            measured = level in line.trials
            error = line.error(level, guess.value)
            margin = 1.0 if measured else BETWEEN if line.levels[0] < level < line.levels[-1] else BEYOND
            if not error <= margin * limit:
                continue
            seconds = line.seconds(level)
            if best is None or seconds < best.seconds:
                best = Choice(line, level, error, seconds, measured)
        if best is not None and math.isfinite(best.seconds):
            found.append(best)
    return sorted(found, key=lambda choice: choice.seconds)
