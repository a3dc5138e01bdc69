"""Following a motion: step after step to outputs and corners of ramps, which are hit exactly."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from itertools import pairwise
from math import isfinite

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.errors import Interrupted, MotionStopped
from ancf_petsc.motion.integrators import Integrator, Step, steps_in

SHORTER = 32
"""How many times shorter the step is that tells a step too long from a motion that cannot go on."""
log = logging.getLogger("ancf")


class TimeIntegration:
    """Moves an integrator through time. `on_step(step)` is called after each accepted step.

    outputs: times to hit, ascending from after 0. on_corner(time): called after a ramp's corner was passed.
    """

    def __init__(
        self,
        integrator: Integrator,
        outputs: Sequence[float],
        on_step: Callable[[Step], None],
        on_corner: Callable[[float], None],
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self.integrator = integrator
        self.equations = integrator.equations
        self.corners = [corner for corner in self.equations.corners if 0.0 < corner < outputs[-1]]
        self.marks = [0.0, *sorted({*outputs, *self.corners})]
        self.on_step, self.on_corner, self.interrupted = on_step, on_corner, interrupted
        self._before = (integrator.x.copy(), integrator.v.copy())

    def destroy(self) -> None:
        """Free PETSc's objects."""
        for vector in self._before:
            vector.destroy()

    def run(self) -> None:
        """To the last output. Raises MotionStopped with the last good state in place, Interrupted when
        asked to stop.
        """
        for begin, end in pairwise(self.marks):
            if end <= self.integrator.time:  # before a state that the motion goes on from
                continue
            for goal in self._goals(begin, end):
                while self.integrator.time < goal:
                    self._advance(goal)
            if end in self.corners:
                self.equations.pass_corner(end, self.integrator.v)
                self.integrator.restart()
                self.on_corner(end)

    def _goals(self, begin: float, end: float) -> list[float]:
        """Ends of fixed steps, equal within the interval; its end alone where the method leaps."""
        if self.integrator.leaps:
            return [end]
        parts = steps_in(end - begin, self.integrator.settings.step)
        return [begin + (end - begin) * k / parts for k in range(1, parts)] + [end]

    def _advance(self, goal: float) -> None:
        integrator = self.integrator
        if self.interrupted():
            raise Interrupted(f"stopped at time {integrator.time:.6g}; everything up to here is saved")
        for kept, now in zip(self._before, (integrator.x, integrator.v), strict=True):
            now.copy(kept)
        start, carried = integrator.time, integrator.a
        try:
            step = integrator.step_to(goal)
            fastest = integrator.v.norm(PETSc.NormType.INFINITY)
            if not isfinite(integrator.x.norm() + fastest * fastest):
                reached, integrator.time = integrator.time, start
                raise integrator.failed(reached, "numbers are not finite any more")
        except MotionStopped as error:
            self._go_back(start, carried)
            kind = "step_too_long" if self._is_too_long(goal) else "diverged"
            self._go_back(start, carried)
            raise MotionStopped(str(error), {**error.facts, "kind": kind, "time": start}) from error
        self.on_step(step)

    def _go_back(self, time: float, carried: NDArray[np.float64]) -> None:
        """To the state before the step."""
        self.integrator.time, self.integrator.a = time, carried
        for kept, now in zip(self._before, (self.integrator.x, self.integrator.v), strict=True):
            kept.copy(now)

    def _is_too_long(self, goal: float) -> bool:
        """Whether the step that failed was longer than the method's limit, or one much shorter goes on from there. Collective."""
        integrator, size = self.integrator, self.integrator.settings.step
        if integrator.adaptive:
            return False
        if integrator.longest_stable is not None:
            return size > integrator.longest_stable
        start = integrator.time
        try:
            integrator.restart()
            integrator.step_to(start + min(size, goal - start) / SHORTER)
        except MotionStopped:
            return False
        return isfinite(integrator.x.norm() + integrator.v.norm() ** 2)


def warn_of_long_step(integrator: Integrator, size: float) -> None:
    """Say how long a step may be; warn of one that is longer."""
    longest = integrator.longest_stable
    if longest is None:
        return
    limit = integrator.highest_stable or 0.0
    log.info(
        "highest frequency about %.6g rad per unit of time: stable steps up to about %.4g (omega h <= %g)",
        limit / longest,
        longest,
        limit,
    )
    if not integrator.adaptive and size > longest:
        log.warning(
            "dynamics.step = %.4g is above the stable step of %s: it may run into non-finite numbers; "
            "take step = %.3g or less",
            size,
            integrator.name,
            longest,
        )
