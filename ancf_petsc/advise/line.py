"""One way to discretise a scene, an element on a family of meshes, with what its ladder of trials says of error and cost."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ancf_petsc.advise.lab import Lab, Trial
from ancf_petsc.advise.meshes import MeshFamily
from ancf_petsc.studies.richardson import Ladder, LadderLimit, extrapolate, fitted_order

ORDERS = (0.3, 7.0)
USUAL_GROWTH = 1.25
"""Of the seconds of a solution with the degrees of freedom, until three trials show it."""
GROWTHS = (1.0, 2.0)
AHEAD = {1: 1.0, 2: 4.0, 3: 6.0}
"""Levels beyond the finest that errors are predicted for, by the number of trials."""
FRACTION = 0.25
"""Of a level, where a family has meshes between whole ones."""
SAME = 1e-6
"""Sizes that differ by less, relatively, are of one mesh."""
WORTH = 1500
"""Degrees of freedom below which seconds of solutions say nothing of their growth."""


@dataclass
class Discretisation:
    """An element on a family of meshes. more: further changes of all its runs. trials: by level."""

    code: str
    family: MeshFamily
    more: dict[str, Any] = field(default_factory=dict)
    trials: dict[float, Trial] = field(default_factory=dict)
    stopped: str = ""

    @property
    def name(self) -> str:
        """In words."""
        return f"{self.code}, {self.family.name}"

    def changes(self, level: float) -> dict[str, Any] | None:
        """The keys of a run at a level, None where the family has no such mesh."""
        mesh = self.family.mesh(level)
        return None if mesh is None else {**mesh, "mesh.element": self.code, **self.more}

    def described(self, level: float) -> str:
        """A level in words."""
        mesh = self.family.mesh(level) or {}
        kept = ("refine", "size", "rim", "divisions")
        words = [f"{key} {mesh[f'mesh.{key}']}" for key in kept if f"mesh.{key}" in mesh]
        return f"{self.code}, {', '.join(words)}"

    def make(self, lab: Lab, level: float) -> Trial | None:
        """The trial at a level; one that cannot be run, or ends early, ends the ladder."""
        changes = self.changes(level)
        trial = None if changes is None else lab.make(changes, self.described(level))
        if trial is None:
            self.stopped = self.stopped or "no such mesh"
        elif trial.value is None:
            self.stopped = trial.failure or "no value"
        else:
            self.trials[level] = trial
        return trial

    @property
    def levels(self) -> list[float]:
        """Of the trials, coarse to fine."""
        return sorted(self.trials)

    @property
    def rungs(self) -> list[float]:
        """Levels with smaller elements than all before: of some sizes a mesh generator makes the same mesh, or a coarser one."""
        found: list[float] = []
        for level in self.levels:
            if not found or self.trials[level].facts.h < self.trials[found[-1]].facts.h * (1 - SAME):
                found.append(level)
        return found

    @property
    def values(self) -> list[float]:
        """By rung."""
        return [self.trials[level].value or 0.0 for level in self.rungs]

    @property
    def order(self) -> int:
        """The degree up to which the element's polynomials are complete."""
        return self.trials[self.levels[-1]].facts.order

    @property
    def sizes(self) -> list[float]:
        """Mean sizes of elements, by rung."""
        return [self.trials[level].facts.h for level in self.rungs]

    def limit(self, lab: Lab) -> LadderLimit:
        """What Richardson says of the ladder."""
        trials = [self.trials[level] for level in self.rungs]
        if len(trials) < 3:
            return extrapolate(Ladder(self.sizes, self.values))
        seen = [trial.row.stretch_at(lab.asked) for trial in trials]
        stretches = None if None in seen else [stretch for stretch in seen if stretch is not None]
        return extrapolate(Ladder(self.sizes, self.values, 2.0 * trials[-1].facts.order, stretches))

    def doubtful_limit(self) -> float | None:
        """Where the three finest levels lead by themselves, whatever else speaks against a limit."""
        if len(self.rungs) < 3:
            return None
        h, q = np.array(self.sizes[-3:]), np.array(self.values[-3:])
        if (q[0] - q[1]) * (q[1] - q[2]) <= 0:
            return None
        found = fitted_order(h, q)
        return found[1] if found and ORDERS[0] < found[0] < ORDERS[1] else None

    def error(self, level: float, reference: float) -> float:
        """Relative, at any level: measured where it is, else by the power of h that the finest two levels show."""
        if level in self.trials:
            return abs((self.trials[level].value or 0.0) / reference - 1.0)
        h, errors = np.array(self.sizes), np.array([self.error(known, reference) for known in self.rungs])
        wanted = self.size_at(level)
        if len(h) < 2:
            return math.inf
        near = np.argsort(np.abs(np.log(h / wanted)))[:2]
        a, b = sorted(near, key=lambda k: -h[k])
        if errors[a] <= 0 or errors[b] <= 0 or errors[b] >= errors[a]:
            return math.inf if wanted < h[b] else float(errors[near].max())
        order = math.log(errors[a] / errors[b]) / math.log(h[a] / h[b])
        order = min(max(order, ORDERS[0]), 2.0 * self.trials[self.levels[-1]].facts.order)
        return float(errors[b] * (wanted / h[b]) ** order)

    def size_at(self, level: float) -> float:
        """The mean size of elements at a level: between and beyond those known it goes geometrically."""
        known = np.array(self.rungs)
        if len(known) == 1:
            return self.sizes[0] * (0.5 if self.family.name == "refined" else 0.8) ** (level - known[0])
        k = int(np.clip(np.searchsorted(known, level) - 1, 0, len(known) - 2))
        part = (level - known[k]) / (known[k + 1] - known[k])
        return float(self.sizes[k] * (self.sizes[k + 1] / self.sizes[k]) ** part)

    def dof_at(self, level: float) -> float:
        """Degrees of freedom at a level, about."""
        if level in self.trials:
            return float(self.trials[level].facts.dof)
        rungs = self.rungs
        finest, dimension = self.trials[rungs[-1]], 3.0
        if len(rungs) > 1:
            before = self.trials[rungs[-2]].facts
            dimension = math.log(finest.facts.dof / before.dof) / math.log(before.h / finest.facts.h)
        return finest.facts.dof * (finest.facts.h / self.size_at(level)) ** dimension

    def seconds(self, level: float) -> float:
        """Of a whole run at a level: a constant and a power of the degrees of freedom."""
        if level in self.trials:
            return self.trials[level].seconds
        trials = [self.trials[known] for known in self.rungs]
        constant = min(trial.seconds - trial.solution for trial in trials)
        large = [trial for trial in trials if trial.facts.dof >= WORTH and trial.solution > 0]
        growth = USUAL_GROWTH
        if len(large) >= 2:
            dof = np.log([trial.facts.dof for trial in large])
            growth = float(np.polyfit(dof, np.log([trial.solution for trial in large]), 1)[0])
        growth = min(max(growth, GROWTHS[0]), GROWTHS[1])
        finest = trials[-1]
        return constant + finest.solution * (self.dof_at(level) / finest.facts.dof) ** growth

    def candidates(self) -> list[float]:
        """Levels that may be taken: those known, those between them, and a few beyond, more where more is known."""
        if not self.trials:
            return []
        first, last = self.levels[0], self.levels[-1]
        step = FRACTION if self.family.fractions else 1.0
        low = first - (1.0 if self.family.fractions else 0.0)
        high = last + AHEAD[min(len(self.rungs), 3)]
        found = [low + step * k for k in range(int((high - low) / step) + 1)]
        return [level for level in found if not self.stopped or level <= last if self.family.mesh(level)]
