"""How many load steps a path needs: the fewest iterations that come to its end."""

from __future__ import annotations

from collections.abc import Sequence

from ancf_petsc.advise.lab import Lab, Trial
from ancf_petsc.advise.line import Discretisation

STEPS = "statics.steps"
TRIED = (1, 2, 4, 8)


def fewest_steps(line: Discretisation, level: float, lab: Lab, tried: Sequence[int] = TRIED) -> int | None:
    """The number of steps with the fewest iterations at a level; None where no number comes to the end.

    Among those that take as many, the fewest steps. It goes on to more steps while iterations get fewer.
    """
    changes = line.changes(level)
    best: tuple[int, int] | None = None
    if changes is None:
        return None
    for count in tried:
        trial = lab.make(
            {**changes, STEPS: count}, f"{line.described(level)}, {count} step{'s' * (count > 1)}"
        )
        if trial is None:
            return None
        if not _came_through(trial):
            continue
        if best is not None and trial.iterations >= best[0]:
            break
        best = (trial.iterations, count)
    return best[1] if best else None


def _came_through(trial: Trial) -> bool:
    return trial.value is not None and not trial.failure
