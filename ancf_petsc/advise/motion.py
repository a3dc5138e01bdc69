"""Integrators and steps of a motion: their errors and costs on one coarse mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ancf_petsc.advise.lab import Lab, Trial
from ancf_petsc.advise.line import Discretisation
from ancf_petsc.input.load import Case
from ancf_petsc.input.methods import METHODS

TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
TIGHT = {"dynamics.integrator": "runge_kutta_5dp", "dynamics.step": "", "dynamics.tolerance": 1e-10}
"""What errors of time are measured against."""
HALVINGS = 5
TRIED = ("runge_kutta_5dp", "generalized_alpha", "energy_momentum")
SPACE = 0.8
"""Of the target, for the mesh; the rest is for time."""
LEAST = 800
"""Degrees of freedom of the mesh that integrators are compared on, at least, where a family has such a mesh."""


@dataclass(frozen=True)
class Timing:
    """An integrator with its step or tolerance. error: of the quantity by time alone; drift: of energy, relative to the largest."""

    changes: dict[str, Any]
    error: float
    drift: float
    trial: Trial

    @property
    def words(self) -> str:
        """In words."""
        step, tolerance = self.changes["dynamics.step"], self.changes["dynamics.tolerance"]
        how = f"step {step:.4g}" if step != "" else f"tolerance {tolerance:g}"
        return f"{self.changes['dynamics.integrator']}, {how}"


def integrators(case: Case) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """(name, changes from coarse to fine) of the case's own integrator and of others that suit most motions."""
    dynamics = case.spec.dynamics
    assert dynamics is not None
    own = {row.option.name for row in METHODS.values() if row.option}
    given = {f"dynamics.{name}": "" for name in own & dynamics.model_fields_set}
    interval = dynamics.duration / dynamics.outputs
    for name in dict.fromkeys((*TRIED, dynamics.integrator)):
        base = {**(given if name != dynamics.integrator else {}), "dynamics.integrator": name}
        if METHODS[name].adaptive:
            yield name, [{**base, "dynamics.step": "", "dynamics.tolerance": tol} for tol in TOLERANCES]
        else:
            steps = [interval / 2**k for k in range(HALVINGS)]
            yield name, [{**base, "dynamics.step": step, "dynamics.tolerance": ""} for step in steps]


def level_to_compare_on(line: Discretisation, lab: Lab) -> float:
    """The first level with enough degrees of freedom for times to tell something."""
    for level in (0.0, 1.0, 2.0):
        changes = line.changes(level)
        run = None if changes is None else lab.plan(changes)
        if run is not None and run.facts is not None and run.facts.dof >= LEAST:
            return level
    return 0.0


def timings(case: Case, line: Discretisation, lab: Lab, target: float) -> list[Timing]:
    """The first step or tolerance of each integrator whose error is within its share, the cheapest first.

    Errors are against the same mesh with a tolerance of 1e-10.
    """
    level = level_to_compare_on(line, lab)
    changes = line.changes(level)
    if changes is None:
        return []
    sharp = lab.make({**changes, **TIGHT}, f"{line.described(level)}, tolerance 1e-10")
    if sharp is None or not sharp.value:
        return []
    found = []
    for name, ladder in integrators(case):
        for more in ladder:
            step, tolerance = more["dynamics.step"], more["dynamics.tolerance"]
            how = f"{name}, {f'step {step:.4g}' if step != '' else f'tolerance {tolerance:g}'}"
            trial = lab.make({**changes, **more}, f"{line.described(level)}, {how}")
            if trial is None:
                break
            if trial.value is None:
                continue
            error, drift = abs(trial.value / sharp.value - 1.0), relative_drift(trial)
            if error <= 0.5 * (1.0 - SPACE) * target and drift <= target:
                found.append(Timing(more, error, drift, trial))
                break
            if lab.left < trial.seconds * 4:
                break
    return sorted(found, key=lambda timing: timing.trial.solution)


def relative_drift(trial: Trial) -> float:
    """The drift of energy relative to the largest energy of the motion."""
    columns = trial.row.tables.columns
    names = ("kinetic_energy", "strain_energy", "external_work", "potential_energy")
    largest = max((float(abs(columns[name]).max()) for name in names[:3] if name in columns), default=0.0)
    return abs(trial.drift or 0.0) / largest if largest > 0 else 0.0
