"""Quasi-static load paths: equilibrium after equilibrium in pseudo-time s from 0 to exactly 1.

Predictor: the tangent for the first step and after corners of a ramp, then extrapolation of the last states. A step
that fails is halved, one that converges quickly lets the next grow; outputs and corners are hit exactly.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from math import ceil, isclose
from typing import Any

import numpy as np
from petsc4py import PETSc

from ancf_petsc.errors import Interrupted, NoEquilibrium
from ancf_petsc.parallel.fields import field
from ancf_petsc.solve.critical import Watch
from ancf_petsc.solve.events import CriticalPoint, Crossing
from ancf_petsc.solve.extrapolation import Extrapolation
from ancf_petsc.solve.marks import Jump, Marks, PathStep
from ancf_petsc.solve.newton import Newton, Outcome
from ancf_petsc.solve.settle import settle
from ancf_petsc.solve.stability import Last, why_it_ends
from ancf_petsc.solve.step_control import StepControl

LONGEST_FIRST_STEP = 0.1
QUICK, SLOW = 5, 9
FAR, FASTER, NEAR = 1.0, 3.0, 0.01
"""What is looked at by a step back: states farther from the predicted one than that is away, and steps that move the body so
many times faster than the one before; both if it is more than this part of its size.
"""
FINER, MOST_TRIALS = 256, 25
"""Where a path ends: how many times shorter steps are tried, and how many."""
MOST_JUMPS, AFTER_JUMP = 100, 0.01
"""Of damped motion on one path, and the first step after one."""
SAME_STATE = 1e-3
log = logging.getLogger("ancf")


class LoadPath:
    """Moves a state along the path. `on_step(step, x)` is called after each accepted step.

    start: the state at s = 0, default the undeformed one. watch: looks for critical points; `on_event(event, x)` is
    called at each. on_bifurcation: what to do there: report, stop or follow. on_jump: where the path ends, damped motion carries
    the body on, and `on_jump(jump, before, x)` is called with the states before and after; None ends the run there.
    """

    def __init__(
        self,
        newton: Newton,
        marks: Marks,
        smallest_step: float,
        on_step: Callable[[PathStep, PETSc.Vec], None] = lambda step, x: None,
        interrupted: Callable[[], bool] = lambda: False,
        *,
        start: PETSc.Vec | None = None,
        on_bifurcation: str = "report",
        on_event: Callable[[CriticalPoint, PETSc.Vec], None] = lambda event, x: None,
        on_jump: Callable[[Jump, PETSc.Vec, PETSc.Vec], None] | None = None,
    ) -> None:
        self.newton = newton
        self.assembly = newton.assembly
        self.marks = marks
        self.smallest_step = smallest_step
        self.on_step = on_step
        self.interrupted = interrupted
        self.on_jump, self._jumps = on_jump, 0
        self.s = 0.0
        self.x = start or self.assembly.reference_vector()
        self.watch = Watch(newton)
        self._crossing = Crossing(self.watch, on_bifurcation, on_event)
        self._trying = False  # a path that only looks how far it leads: nothing is judged or said
        self._rate = np.inf  # of the last step: largest change of a component over that of s
        self._at_hand = False  # whether the linear solver holds a tangent of the last trial
        self._past = Extrapolation()
        self._past.add(0.0, self.x)
        self._step = min(marks.after(0.0), LONGEST_FIRST_STEP)

    def state(self) -> dict[str, Any]:
        """All that the rest of the path hangs on, between two steps."""
        return {
            "s": self.s,
            "x": field(self.x),
            "rate": self._rate,
            "at_hand": self._at_hand,
            "step": self._step,
            "jumps": self._jumps,
            "past": self._past.state(),
            "watch": self.watch.state(),
            "crossing": self._crossing.state(),
            "newton": self.newton.state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state. Collective."""
        self.newton.restore(state["newton"])
        self.s, self._rate, self._at_hand = state["s"], state["rate"], state["at_hand"]
        self._step, self._jumps = state["step"], state["jumps"]
        self.x.array[:] = state["x"].ravel()
        self._past.restore(state["past"], self.x)
        self.watch.restore(state["watch"])
        self._crossing.restore(state["crossing"])
        self.newton.set_pseudo_time(self.s)

    def run(self) -> None:
        """Follow the path to s = 1. Raises NoEquilibrium where it ends, Interrupted when asked to stop."""
        try:
            while self.s < 1.0:
                if self.interrupted():
                    raise Interrupted(f"stopped at pseudo-time {self.s:.6g}; everything up to here is saved")
                self._advance()
        finally:
            self.watch.destroy()

    def _advance(self) -> None:
        """One accepted step, after as many halvings as it takes."""
        while True:
            target = self._target()
            trial, outcome = self._attempt(target)
            if not outcome.converged:
                trial.destroy()
                if self._shorten(target, outcome.reason):
                    return
                continue
            at_output = target in self.marks.outputs
            found: tuple[float, PETSc.Vec] | None = (target, trial)
            if self._trying:
                break
            found = self._crossing.judge(
                self.s,
                target,
                trial,
                self.smallest_step,
                at_hand=self._at_hand,
                at_output=at_output,
                effort=outcome.linear,
            )
            if found is not None:
                break
            self._step = (target - self.s) / 4
            log.info("  step to s = %.6g led to an unstable state: shortened", target)
            self.newton.control.note("shortened", "it led to an unstable state", self.s, self._step)
        assert found is not None
        s, x = found
        step = PathStep(
            s, s - self.s, outcome.newton, outcome.linear, outcome.residuals, s in self.marks.outputs
        )
        self._accept(s, x, branched=s != target or x is not trial)
        self._adapt(step)
        self.on_step(step, self.x)
        self._crossing.stop_if_asked()

    def _shorten(self, target: float, reason: str) -> bool:
        """After a step that failed: another linear solver, half the step, or the end of the path. Returns whether damped motion
        went on from there.
        """
        linear, size = self.newton.linear, (target - self.s) / 2
        if linear.gave_up() and (linear.is_cheap_to_factor or size < self.smallest_step):
            self.newton.factor_from_now_on(self.s)
            return False
        if size < self.smallest_step:
            if self._trying:
                raise NoEquilibrium(reason)
            self._jump(target, self._end(target, reason))
            return True
        log.info("  step to s = %.6g failed (%s): halved to %.3g", target, reason, size)
        self.newton.control.note("halved", reason, self.s, size)
        self._step = size
        return False

    def _jump(self, target: float, why: NoEquilibrium) -> None:
        """By damped motion to a state of rest at `target`. Raises NoEquilibrium where that is not asked for, or there is none."""
        if self.on_jump is None:
            raise why
        if self._jumps >= MOST_JUMPS:
            raise NoEquilibrium(f"{why}; damped dynamics went on {MOST_JUMPS} times before", why.facts)
        x = self.x.copy()
        self.assembly.set_driven(x, target)
        found = settle(self.newton, self.watch, target, x, self.interrupted)
        if found is None:
            x.destroy()
            nowhere = f"damped dynamics found no state of rest at pseudo-time {target:.6g} either"
            raise NoEquilibrium(f"{why}; {nowhere}", why.facts)
        before, was = self.x.copy(), self.s
        self.watch.negative = 0
        self.watch.history.append((target, found.lowest))
        self._accept(target, x, branched=True)
        self._crossing.remember(target, x)
        self._step, self._jumps = max(self._step, AFTER_JUMP), self._jumps + 1
        self.newton.control.note("dynamics", str(why), was)
        self.on_jump(Jump(was, target, found.steps, why), before, x)
        before.destroy()

    def _end(self, target: float, reason: str) -> NoEquilibrium:
        """What to say of a step to `target` that failed, as short as it may be."""
        limit = self._crossing.limit_point(self.s, self.x, self.smallest_step)
        beyond = self.try_beyond(target, self.smallest_step / FINER, MOST_TRIALS)
        last = Last(self.s, self.x, reason, self.smallest_step, target, beyond, limit)
        error = why_it_ends(self.newton, self.watch, last)
        beyond[1].destroy()
        return error

    def try_beyond(self, target: float, least: float, most: int) -> tuple[float, PETSc.Vec]:
        """How far a path from here leads towards `target` by steps down to `least`, and at most so many: pseudo-time and state."""
        trial = LoadPath(
            self.newton, Marks.of([target], tuple(self.marks.corners)), least, start=self.x.copy()
        )
        trial.s, trial._trying, trial._step = self.s, True, (target - self.s) / 4
        trial._past.forget()
        trial._past.add(self.s, trial.x)
        control, self.newton.control = self.newton.control, StepControl()
        try:
            for _ in range(most):
                trial._advance()
                if trial.s >= target or self.interrupted():
                    break
        except NoEquilibrium:
            pass
        finally:
            self.newton.control = control
            trial.watch.destroy()
            trial._past.forget()
        return trial.s, trial.x

    def _target(self) -> float:
        """Where the next step ends: on the next mark, or on an equal part of the way to it."""
        mark = self.marks.after(self.s)
        parts = ceil((mark - self.s) / self._step * (1 - 1e-9))
        return mark if parts <= 1 else self.s + (mark - self.s) / parts

    def _attempt(self, target: float) -> tuple[PETSc.Vec, Outcome]:
        """Newton from a predicted state; where extrapolation predicts badly, or cells inside out, from the tangent's."""
        trial = self._past.at(target)
        if trial is not None:
            self.assembly.set_driven(trial, target)
            outcome = self._solve(target, trial)
            if outcome.converged:
                return trial, outcome
            self.newton.control.note(
                "predictor",
                f"extrapolated states did not do ({outcome.reason}): the tangent predicts",
                self.s,
            )
            trial.destroy()
        trial = self.x.copy()
        self.newton.predict(trial, self.s, target)
        if self.watch.begin(self.s):
            self._crossing.remember(self.s, self.x)
        self._note_slope(trial, target)
        predicted = trial.copy()
        outcome = self._solve(target, trial)
        if not outcome.converged and self.newton.can_be_careful and not self.newton.linear.gave_up():
            careful = self._solve(target, predicted, careful=True)
            if careful.converged:
                log.info("  step to s = %.6g: %s; with a line search it is found", target, outcome.reason)
                self.newton.control.note("line search", outcome.reason, self.s)
                trial, predicted, outcome = predicted, trial, careful
        predicted.destroy()
        return trial, outcome

    def _solve(self, target: float, x: PETSc.Vec, *, careful: bool = False) -> Outcome:
        """Newton from a predicted state x. What it finds far from there belongs to this path if a step leads back."""
        predicted = x.copy()
        outcome = self.newton.solve(target, x, careful=careful)
        self._at_hand = outcome.newton > 0
        if outcome.converged:
            corrected, moved = self._distance(x, predicted), self._distance(x, self.x)
            astray = corrected > FAR * self._distance(predicted, self.x)
            faster = moved > FASTER * self._rate * (target - self.s)
            if max(
                corrected * astray, moved * faster
            ) > NEAR * self.assembly.model.size and not self._leads_back(x, target):
                outcome = replace(outcome, converged=False, reason="it leads to another branch")
        predicted.destroy()
        return outcome

    def _leads_back(self, x: PETSc.Vec, target: float) -> bool:
        """Whether a step back from a state x at `target` ends at the present state: it does not after a jump."""
        back = x.copy()
        self.newton.predict(back, target, self.s)
        converged = self.newton.solve(self.s, back).converged
        found = converged and self._distance(back, self.x) <= SAME_STATE * self._distance(x, self.x)
        back.destroy()
        self._at_hand = False
        self.newton.set_pseudo_time(target)
        return found

    def _distance(self, x: PETSc.Vec, y: PETSc.Vec) -> float:
        """The largest difference of the components of two states. Collective."""
        difference = x.copy()
        difference.axpy(-1.0, y)
        largest = difference.norm(PETSc.NormType.INFINITY)
        difference.destroy()
        return largest

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

    def _accept(self, s: float, x: PETSc.Vec, *, branched: bool) -> None:
        """Make x at s the present state and remember it. branched: it lies on another branch than those before."""
        turns = s in self.marks.corners or branched
        self._rate = np.inf if turns else self._distance(x, self.x) / (s - self.s)
        self.x.destroy()
        self.s, self.x = s, x
        if turns:
            self._past.forget()
            self._step = min(self._step, LONGEST_FIRST_STEP)
        self._past.add(s, x)

    def _adapt(self, step: PathStep) -> None:
        """The size of the next step from how hard this one was."""
        if step.newton <= QUICK:
            self._step = max(self._step, step.size) * 2 if step.size >= 0.5 * self._step else self._step
        elif step.newton >= SLOW:
            self._step = step.size / 2
