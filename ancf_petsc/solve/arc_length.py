"""Load paths that are followed by their length, so that the load factor s may fall: past limit points, to s = 1.

Unknowns are the state and s together. A step goes along the tangent of the path, then Newton's method brings it back to
equilibrium in the plane across the tangent (E. Riks, Int. J. Solids Struct. 15 (1979) 529; H. B. Keller's
pseudo-arclength), which has one root where spheres have two. The tangent keeps its sense: that of the last one. Each
iteration solves for two right-hand sides, the out-of-balance force and what s adds. Lengths: the state's change over
that of the first tangent for s = 1, and the change of s, as two sides of a right angle.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.errors import Interrupted, NoEquilibrium
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.parallel.fields import field
from ancf_petsc.solve.cause import cause_of
from ancf_petsc.solve.critical import CLOSE, Watch
from ancf_petsc.solve.cubic import crossing, cubic, extreme
from ancf_petsc.solve.events import CriticalPoint, ended_at, place_of
from ancf_petsc.solve.extrapolation import filled
from ancf_petsc.solve.load_path import LONGEST_FIRST_STEP
from ancf_petsc.solve.marks import SAME_TIME, Marks, PathStep
from ancf_petsc.solve.newton import Newton
from ancf_petsc.solve.stability import Last, why_it_ends

WANTED, MOST_ITERATIONS, MOST_STEPS = 4, 12, 5000
STRAIGHT, SHARPEST = 0.95, 0.7
"""Cosines between the tangents at both ends of a step: below the first steps stop growing, below the second one is halved."""
MOST_AT_LIMIT, LEVEL = 6, 1e-3
"""Trials for a limit point, and the rate of s over that at the ends of the step that is level enough."""
ASTRAY = 'the path leads elsewhere; statics.control = "load" names its limit points'
LOST = {"kind": "lost_definiteness"}
EXACT = 1e-9
"""Reduction that iterative solvers are asked for."""
log = logging.getLogger("ancf")


@dataclass
class Point:
    """A state of the path with its unit tangent (direction (3 n,), rate of s). length: of the path up to it."""

    x: PETSc.Vec
    s: float
    direction: NDArray[np.float64]
    rate: float
    length: float = 0.0
    negative: int = 0
    limit: CriticalPoint | None = None


@dataclass
class Corrected:
    """What a corrector found: state, s, iterations with their linear ones; residual over the force scale."""

    x: PETSc.Vec
    s: float
    newton: int
    linear: int
    residual: float


class ArcLength:
    """Follows the path from `start` at s = 0 to s = 1. Calls as those of LoadPath; limit points are outputs, too."""

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
    ) -> None:
        self.newton, self.assembly = newton, newton.assembly
        self.marks, self.smallest_step = marks, smallest_step
        self.on_step, self.interrupted, self.on_event = on_step, interrupted, on_event
        self.on_bifurcation = on_bifurcation
        self.watch = Watch(newton)
        self.x, self.s = start or self.assembly.reference_vector(), 0.0
        self._scale, self._steps = 0.0, 0
        self._here: Point | None = None
        self._size = sqrt(2) * min(marks.after(0.0), LONGEST_FIRST_STEP)

    def run(self) -> None:
        """Raises NoEquilibrium where the path ends before s = 1, Interrupted when asked to stop."""
        try:
            self._here = self._here or self._point(self.x.copy(), 0.0, None)
            while self._steps < MOST_STEPS:
                if self.interrupted():
                    raise Interrupted(f"stopped at pseudo-time {self.s:.6g}; everything up to here is saved")
                self._here = self._advance(self._here)
                self._steps += 1
                if self.s == 1.0:
                    return
                if self.s < -1.0:
                    raise NoEquilibrium(f"the load factor fell to {self.s:.6g}: {ASTRAY}", LOST)
            raise NoEquilibrium(f"{MOST_STEPS} steps by arc length did not lead to s = 1: {ASTRAY}", LOST)
        finally:
            self.watch.destroy()

    def state(self) -> dict[str, Any]:
        """All that the rest of the path hangs on, between two steps."""
        here = self._here
        assert here is not None
        return {
            "s": self.s,
            "x": field(self.x),
            "point": [field(here.x), here.s, field(here.direction), here.rate, here.length, here.negative],
            "scale": self._scale,
            "size": self._size,
            "steps": self._steps,
            "watch": self.watch.state(),
            "newton": self.newton.state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state. Collective."""
        self.newton.restore(state["newton"])
        x, s, direction, rate, length, negative = state["point"]
        self._here = Point(filled(self.x, x), s, direction.ravel(), rate, length, negative)
        self.x.array[:] = state["x"].ravel()
        self.s, self._scale, self._size = state["s"], state["scale"], state["size"]
        self._steps = state["steps"]
        self.watch.restore(state["watch"])
        self.newton.set_pseudo_time(self.s)

    # --- steps

    def _advance(self, here: Point) -> Point:
        """One accepted step, after as many halvings as it takes, with the outputs on it."""
        while True:
            found, reason = self._correct(here, self._size)
            if found is not None:
                there = self._point(found.x, found.s, here, here.length + self._size)
                cosine = self._dot(here, there)
                if cosine >= SHARPEST or self._size / 2 < self.smallest_step:
                    break
                reason = "the path turns too sharply in it"
            if self._size / 2 < self.smallest_step:
                end = Last(self.s, self.x, reason, self.smallest_step, np.inf, (self.s, self.x))
                raise why_it_ends(self.newton, self.watch, end)
            self._size /= 2
            log.info("  step by arc length failed (%s): halved to %.3g", reason, self._size)
            self.newton.control.note("halved", reason, here.s, self._size)
        pieces = [(here, there, found)]
        if here.rate * there.rate < 0.0:
            pieces = self._at_limit(here, there, found)
        self._note_change(here, there)
        for first, last, corrected in pieces:
            self._outputs_between(first, last)
            if self.s == 1.0:
                break
            self._arrive(last, corrected)
            first.x.destroy()
        grown = min(max(sqrt(WANTED / max(found.newton, 1)), 0.5), 2.0)
        self._size *= grown if cosine >= STRAIGHT else min(grown, 1.0)
        return there

    def _correct(self, here: Point, size: float) -> tuple[Corrected | None, str]:
        """Equilibrium in the plane across the tangent, `size` away along it; None with the reason where there is none."""
        newton, assembly = self.newton, self.assembly
        x, s = here.x.copy(), here.s + size * here.rate
        x.array[:] += size * here.direction
        assembly.set_driven(x, s)
        linear, first = 0, np.inf
        for iteration in range(MOST_ITERATIONS + 1):
            newton.set_pseudo_time(s)
            residual, relative = newton.residual_at(x)
            if not np.isfinite(relative) or relative > 1e3 * max(first, 1e-3):
                x.destroy()
                return None, "forces that are not finite or grow"
            first = min(first, relative)
            if relative <= newton.tolerance:
                return Corrected(x, s, iteration, linear, relative), ""
            if iteration == MOST_ITERATIONS:
                break
            (by_force, by_load), count = self._solve(x, s, residual)
            linear += count
            off = self._inner(here.direction, x.array_r - here.x.array_r) + here.rate * (s - here.s) - size
            above = off + self._inner(here.direction, by_force)
            change = -above / (here.rate + self._inner(here.direction, by_load))
            x.array[:] += by_force + change * by_load
            s += change
            assembly.set_driven(x, s)
        x.destroy()
        return None, f"no convergence in {MOST_ITERATIONS} iterations"

    def _solve(self, x: PETSc.Vec, s: float, residual: NDArray) -> tuple[list[NDArray], int]:
        """With the tangent at x: what takes the residual (3 n,) away, and the change of the state with s; iterations."""
        newton = self.newton
        push, increment = newton.push(x, s, s + 1.0)
        newton.tangent_at(x)
        answers, iterations = [], 0
        for number, rhs in enumerate((-residual, push.array_r.copy())):
            push.array[:] = rhs
            answer = self._solved(push, x)
            iterations += newton.linear.ksp.getIterationNumber()
            answers.append(answer + increment.array_r if number else answer)
        push.destroy()
        increment.destroy()
        return answers, iterations

    def _solved(self, rhs: PETSc.Vec, x: PETSc.Vec) -> NDArray[np.float64]:
        """The tangent's answer, by factoring where an iterative solver gives up."""
        linear, answer = self.newton.linear, self.assembly.vector()
        linear.ask_for(EXACT)
        linear.ksp.solve(rhs, answer)
        if linear.gave_up():
            self.newton.factor_from_now_on(self.s)
            self.newton.tangent_at(x)
            linear.ksp.solve(rhs, answer)
        values = answer.array_r.copy()
        answer.destroy()
        return values

    def _point(self, x: PETSc.Vec, s: float, before: Point | None, length: float = 0.0) -> Point:
        """The state with its tangent, in the sense of the one before; at first s grows."""
        self.newton.set_pseudo_time(s)
        (_, by_load), _ = self._solve(x, s, np.zeros(len(x.array_r)))
        if before is None:
            self._scale = sqrt(combined(self.assembly.comm, float(by_load @ by_load))) or 1.0
        rate = 1.0 / sqrt(1.0 + self._inner(by_load, by_load))
        point = Point(x, s, rate * by_load, rate, length)
        if before is not None and self._dot(before, point) < 0.0:
            point.direction, point.rate = -point.direction, -point.rate
        value = self.watch.lowest.look(CLOSE)
        self.watch.history.append((s, value))
        count = self.watch.count(value)
        point.negative = 1 if count is None else count
        return point

    def _inner(self, a: NDArray, b: NDArray) -> float:
        return combined(self.assembly.comm, float(a @ b)) / self._scale**2

    def _dot(self, one: Point, other: Point) -> float:
        return self._inner(one.direction, other.direction) + one.rate * other.rate

    # --- what lies on a step

    def _at_limit(self, here: Point, there: Point, found: Corrected) -> list[tuple[Point, Point, Corrected]]:
        """The step cut in two at its limit point, found by the cubic through both ends, then by false position."""
        size = there.length - here.length
        low, high = (0.0, here.rate), (size, there.rate)
        at, middle, found_at = (
            size * extreme(here.s, there.s, size * here.rate, size * there.rate),
            None,
            found,
        )
        for _ in range(MOST_AT_LIMIT):
            corrected, _ = self._correct(here, at)
            if corrected is None:
                break
            if middle is not None:
                middle.x.destroy()
            found_at, middle = corrected, self._point(corrected.x, corrected.s, here, here.length + at)
            if abs(middle.rate) < LEVEL * max(abs(here.rate), abs(there.rate)):
                break
            low, high = ((at, middle.rate), high) if middle.rate * low[1] > 0.0 else (low, (at, middle.rate))
            at = low[0] + (high[0] - low[0]) * low[1] / (low[1] - high[1])
        if middle is None:
            return [(here, there, found)]
        place = place_of(self.assembly, middle.direction.reshape(-1, 3))
        between = (here.s, there.s)
        middle.limit = CriticalPoint(
            "limit point", middle.s, between, there.negative, *place, "the path goes on by its length"
        )
        return [(here, middle, found_at), (middle, there, found)]

    def _note_change(self, here: Point, there: Point) -> None:
        """Name a change of the negative directions that no limit point explains: another path crosses this one."""
        explained = here.rate * there.rate < 0.0
        if abs(there.negative - here.negative) == int(explained):
            return
        stop = self.on_bifurcation == "stop"
        done = "the path ends here, as statics.on_bifurcation asks" if stop else "the path goes straight on"
        place = place_of(self.assembly, self.watch.lowest.mode)
        cause = cause_of(self.assembly, here.x, self.watch.lowest.mode)
        middle, between = (here.s + there.s) / 2, (here.s, there.s)
        event = CriticalPoint("bifurcation", middle, between, there.negative, *place, done, cause.kind)
        self.newton.set_pseudo_time(here.s)
        self.on_event(event, here.x)
        if stop:
            raise ended_at(event, cause)

    def _outputs_between(self, here: Point, there: Point) -> None:
        """Equilibria at exactly the outputs' pseudo-times between two points, in the order of the path."""
        low, high = min(here.s, there.s), max(here.s, there.s)
        marks = [mark for mark in self.marks.outputs if low + SAME_TIME < mark < high - SAME_TIME]
        for mark in marks if there.s > here.s else reversed(marks):
            size = there.length - here.length
            ends = (here.s, there.s, size * here.rate, size * there.rate)
            part = crossing(*ends, mark)
            x = here.x.copy()
            x.array[:] = cubic(
                part, here.x.array_r, there.x.array_r, size * here.direction, size * there.direction
            )
            self.assembly.set_driven(x, mark)
            outcome = self.newton.solve(mark, x)
            if not outcome.converged:
                x.destroy()
                log.warning(
                    "no equilibrium was found at exactly pseudo-time %.6g: this output is left out", mark
                )
                continue
            length = here.length + part * (there.length - here.length)
            step = PathStep(
                mark, mark - self.s, outcome.newton, outcome.linear, outcome.residuals, True, length
            )
            self._take(x, step)
            if mark == 1.0:
                return

    def _arrive(self, point: Point, found: Corrected) -> None:
        self.newton.set_pseudo_time(point.s)
        if point.limit is not None:
            self.on_event(point.limit, point.x)
        step = PathStep(
            point.s,
            point.s - self.s,
            found.newton,
            found.linear,
            (found.residual,),
            point.limit is not None or point.s in self.marks.outputs,
            point.length,
        )
        self._take(point.x.copy(), step)

    def _take(self, x: PETSc.Vec, step: PathStep) -> None:
        self.x.destroy()
        self.x, self.s = x, step.s
        self.on_step(step, x)
