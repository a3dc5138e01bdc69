"""Quasi-static load paths: equilibrium after equilibrium in pseudo-time s from 0 to exactly 1.

Predictor: the tangent for the first step and after corners of a ramp, then extrapolation of the last states. A step
that fails is halved, one that converges quickly lets the next grow; outputs and corners are hit exactly.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, isclose

from petsc4py import PETSc

from ancf_petsc.errors import Interrupted, NoEquilibrium
from ancf_petsc.solve.extrapolation import Extrapolation
from ancf_petsc.solve.newton import Newton, Outcome
from ancf_petsc.solve.stability import why_it_ends

LONGEST_FIRST_STEP = 0.1
QUICK, SLOW = 5, 9
log = logging.getLogger("ancf")


@dataclass(frozen=True)
class PathStep:
    """An accepted step of the path, told to whoever watches."""

    s: float
    size: float
    newton: int
    linear: int
    residuals: tuple[float, ...]


class LoadPath:
    """Moves a state along the path. `on_step(step, x)` is called after each accepted step.

    outputs: pseudo-times to hit exactly, ascending, the last is 1. corners: those where the path is not smooth.
    """

    def __init__(
        self,
        newton: Newton,
        outputs: Sequence[float],
        corners: Sequence[float],
        smallest_step: float,
        on_step: Callable[[PathStep, PETSc.Vec], None],
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self.newton = newton
        self.assembly = newton.assembly
        self.marks = sorted({*outputs, *corners, 1.0})
        self.corners = set(corners)
        self.smallest_step = smallest_step
        self.on_step = on_step
        self.interrupted = interrupted
        self.s = 0.0
        self.x = self.assembly.reference_vector()
        self._past = Extrapolation()
        self._past.add(0.0, self.x)
        self._step = min(self.marks[0], LONGEST_FIRST_STEP)

    def run(self) -> None:
        """Follow the path to s = 1. Raises NoEquilibrium where it ends, Interrupted when asked to stop."""
        while self.s < 1.0:
            if self.interrupted():
                raise Interrupted(f"stopped at pseudo-time {self.s:.6g}; everything up to here is saved")
            self._advance()

    def _advance(self) -> None:
        """One accepted step, after as many halvings as it takes."""
        linear = self.newton.linear
        while True:
            target = self._target()
            trial, outcome = self._attempt(target)
            if outcome.converged:
                break
            trial.destroy()
            size = (target - self.s) / 2
            if linear.gave_up() and (linear.is_cheap_to_factor or size < self.smallest_step):
                log.info("  the tangent is not positive definite: factoring from now on")
                linear.fall_back_to_direct()
                continue
            if size < self.smallest_step:
                raise NoEquilibrium(
                    why_it_ends(self.newton, self.x, self.s, outcome.reason, self.smallest_step)
                )
            log.info("  step to s = %.6g failed (%s): halved to %.3g", target, outcome.reason, size)
            self._step = size
        step = PathStep(target, target - self.s, outcome.newton, outcome.linear, outcome.residuals)
        self._accept(target, trial)
        self._adapt(step)
        self.on_step(step, self.x)

    def _target(self) -> float:
        """Where the next step ends: on the next mark, or on an equal part of the way to it."""
        mark = next(m for m in self.marks if m > self.s)
        parts = ceil((mark - self.s) / self._step * (1 - 1e-9))
        return mark if parts <= 1 else self.s + (mark - self.s) / parts

    def _attempt(self, target: float) -> tuple[PETSc.Vec, Outcome]:
        """Newton from a predicted state; where extrapolation predicts badly, or cells inside out, from the tangent's."""
        trial = self._past.at(target)
        if trial is not None:
            self.assembly.set_driven(trial, target)
            outcome = self.newton.solve(target, trial)
            if outcome.converged:
                return trial, outcome
            trial.destroy()
        trial = self.x.copy()
        self.newton.predict(trial, self.s, target)
        self._note_slope(trial, target)
        return trial, self.newton.solve(target, trial)

    def _note_slope(self, predicted: PETSc.Vec, target: float) -> None:
        """The slope of the path where it begins: the tangent's where ramps are straight, none where they start flat."""
        if not self._past.wants_slope:
            return
        size = target - self.s
        model = self.assembly.model
        ramps = [drive.ramp for drive in model.drives] + [load.ramp for load in model.loads]
        rises = [(ramp.rate(self.s) * size, ramp.value(target) - ramp.value(self.s)) for ramp in ramps]
        straight = all(isclose(rate, rise, rel_tol=1e-9, abs_tol=1e-12) for rate, rise in rises)
        if not straight and any(rate for rate, _ in rises):
            return
        slope = predicted.copy()
        slope.axpy(-1.0, self.x)
        slope.scale(1.0 / size if straight else 0.0)
        self._past.set_slope(slope)
        slope.destroy()

    def _accept(self, s: float, x: PETSc.Vec) -> None:
        """Make x at s the present state and remember it."""
        self.x.destroy()
        self.s, self.x = s, x
        if s in self.corners:
            self._past.forget()
        self._past.add(s, x)

    def _adapt(self, step: PathStep) -> None:
        """The size of the next step from how hard this one was."""
        if step.newton <= QUICK:
            self._step = max(self._step, step.size) * 2 if step.size >= 0.5 * self._step else self._step
        elif step.newton >= SLOW:
            self._step = step.size / 2
