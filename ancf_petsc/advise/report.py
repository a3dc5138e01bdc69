"""Advice as it is given: sentences and numbers."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ancf_petsc.advise.choose import BestGuess
from ancf_petsc.input import toml

FILE = "advice.json"


@dataclass(frozen=True)
class Recommendation:
    """A discretisation with what is predicted. error: relative; uncertainty: of the reference, relative; changes: to the case.

    measured: whether a run of it has been made. parts: errors of mesh and of time, where they were found apart.
    """

    words: str
    changes: dict[str, Any]
    error: float
    uncertainty: float
    seconds: float
    dof: float
    measured: bool
    parts: dict[str, float] = field(default_factory=dict)

    def command(self, case_file: Path) -> str:
        """What runs it."""
        words = [
            f"{path}={'' if value == '' else toml.value_text(value)}" for path, value in self.changes.items()
        ]
        return shlex.join(["ancf", "run", str(case_file), "--set", *words])


@dataclass
class Advice:
    """best, runner_up: None where nothing reaches the target. findings: of smaller models of the same scene.

    failures: discretisation -> what stopped it. achieved: error and seconds of the best one's own run, once it has been made.
    """

    quantity: str
    target: float
    case_file: Path
    guess: BestGuess | None
    best: Recommendation | None
    runner_up: Recommendation | None
    runs: int
    spent: float
    failures: dict[str, str] = field(default_factory=dict)
    nearest: Recommendation | None = None
    findings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    achieved: dict[str, float] = field(default_factory=dict)

    def write(self, folder: Path) -> None:
        """advice.json."""
        said = {
            "quantity": self.quantity,
            "target": self.target,
            "case": str(self.case_file),
            "reference": vars(self.guess) if self.guess else None,
            "best": vars(self.best) if self.best else None,
            "runner_up": vars(self.runner_up) if self.runner_up else None,
            "nearest": vars(self.nearest) if self.nearest else None,
            "failures": self.failures,
            "findings": self.findings,
            "notes": self.notes,
            "runs": self.runs,
            "seconds": self.spent,
            "achieved": self.achieved,
        }
        (folder / FILE).write_text(json.dumps(said, indent=1, default=str) + "\n", encoding="utf-8")

    def sentences(self) -> list[str]:
        """What a person reads."""
        found = [f"found: {finding}" for finding in self.findings]
        if self.guess is not None:
            about = f"{self.guess.value:.7g} +- {percent(self.guess.uncertainty)}"
            found.append(f"{self.quantity}: {about}, {self.guess.words}")
        if self.best is not None:
            found.append(f"take {described(self.best)}")
            found.append(f"  {self.best.command(self.case_file)}")
        elif self.guess is None:
            found.append(
                "nothing can be advised: too few runs came to the end to estimate what errors are against"
            )
        else:
            found.append(f"nothing that could be tried is within {percent(self.target)} of it")
            if self.nearest is not None:
                found.append(f"nearest: {described(self.nearest)}")
        if self.runner_up is not None:
            found.append(f"runner-up: {described(self.runner_up)}")
        found += [f"{name} ends early: {why}" for name, why in self.failures.items()]
        found += self.notes
        if self.achieved and self.best is not None:
            error, seconds = percent(self.achieved["error"]), self.achieved["seconds"]
            found.append(
                f"run: error {error}, {seconds:.3g} s; predicted {percent(self.best.error)}, {self.best.seconds:.3g} s"
            )
        return found


def described(choice: Recommendation) -> str:
    """A recommendation in a line."""
    how = "measured" if choice.measured else "predicted"
    parts = "".join(f", of which {name} {percent(value)}" for name, value in choice.parts.items())
    error = f"error {percent(choice.error)} +- {percent(choice.uncertainty)}{parts}"
    return f"{choice.words}: {error}, {choice.seconds:.3g} s, {choice.dof:.0f} degrees of freedom ({how})"


def percent(part: float) -> str:
    """A part as a percentage in two digits."""
    return f"{100 * part:.2g} %"
