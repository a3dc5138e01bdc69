"""What an integrator is: PETSc's TS behind one method, `advance`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.errors import MotionStopped
from ancf_petsc.input.methods import METHODS
from ancf_petsc.motion.compiled import CompiledMotion, compiled_motion
from ancf_petsc.motion.equations import Equations
from ancf_petsc.parallel.fields import field

SHORTEST = 1e-13  # of the duration: a step so short does not move the clock reliably
TINY = 0.9e-9  # of the usual step: increments so small are rounding, and velocities made of them are wrong


def steps_in(interval: float, step: float) -> int:
    """The fewest equal steps, none longer than `step`, that fill an interval."""
    return max(1, ceil(interval / step * (1 - 1e-9)))


@dataclass(frozen=True)
class Settings:
    """What a case may set. step: 0 where the method chooses its steps by `tolerance`. interval: of the outputs. option: of the
    method's own key."""

    step: float = 0.0
    interval: float = 0.0
    tolerance: float = 0.0
    option: float = 0.0


@dataclass(frozen=True)
class Step:
    """An accepted step, or `count` of them at once. known: external work and loss in it, where the method has
    them exactly.
    """

    time: float
    size: float
    newton: int = 0
    linear: int = 0
    rejected: int = 0
    known: tuple[float, float] | None = None
    count: int = 1


class Integrator(ABC):
    """Moves the state: time, x and v (PETSc vectors), and a (n, 3) where the method carries accelerations.

    A subclass sets `self.ts` up and says what a step does to the state.
    """

    name: str
    highest_stable: float | None = None  # omega h of explicit methods for undamped bodies

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        self.equations = equations
        self.settings = settings
        self.time = 0.0
        self.x, self.v = x, v
        self.a: NDArray[np.float64] = np.zeros((0, 3))
        self.ts = PETSc.TS().create(equations.comm)
        self.ts.setMaxTime(1e300)
        self.ts.setMaxSteps(2**31 - 1)
        self.ts.setExactFinalTime(PETSc.TS.ExactFinalTime.STEPOVER)
        self.ts.setErrorIfStepFails(False)

    @cached_property
    def compiled(self) -> CompiledMotion | None:
        """The motion in compiled loops, where the body is simple enough."""
        return compiled_motion(self.equations)

    @property
    def adaptive(self) -> bool:
        """Whether the method chooses its steps."""
        return self.settings.step == 0.0

    @property
    def is_compiled(self) -> bool:
        """Whether steps are made in compiled loops."""
        return False

    @property
    def leaps(self) -> bool:
        """Whether `advance` goes on to its goal by itself, in one call or several."""
        return self.adaptive

    @property
    def longest_stable(self) -> float | None:
        """The longest stable fixed step of an explicit method; None for implicit ones."""
        return None

    @property
    def usual_step(self) -> float:
        """What a step is compared with: the one asked for, or the interval of outputs."""
        return self.settings.step or self.settings.interval

    @property
    def reach(self) -> float:
        """A goal closer than this is reached: what is left is rounding. No step is as short."""
        return max(SHORTEST * self.equations.duration, TINY * self.usual_step)

    def step_to(self, goal: float) -> Step:
        """`advance` that refuses to go a rounding error far. Raises MotionStopped."""
        left = goal - self.time
        if left <= TINY * self.usual_step:
            raise MotionStopped(
                f"{self.name} refuses to step from time {self.time:.6g} by {left:.3g}, {left / self.usual_step:.1g} of the "
                "usual step: two time points of the case differ by rounding; take another dynamics.outputs and report it"
            )
        return self.advance(goal)

    @abstractmethod
    def advance(self, goal: float) -> Step:
        """One step: to `goal`, or, where the method leaps, at most to `goal`. Raises MotionStopped."""

    @property
    def is_ready(self) -> bool:
        """Whether `state` says all."""
        return True

    def state(self) -> dict[str, Any]:
        """All that the rest of the motion hangs on, between two steps."""
        return {
            "time": self.time,
            "x": field(self.x),
            "v": field(self.v),
            "piece": self.equations.piece,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state. Collective."""
        self.time, self.equations.piece = state["time"], state["piece"]
        self.x.array[:], self.v.array[:] = state["x"].ravel(), state["v"].ravel()

    def restart(self) -> None:
        """Forget what was before: the velocity jumped. The state has been set."""
        self.ts.restartStep()

    def set_solver_up(self) -> None:
        """Set the solvers up on the undeformed body, so that every option has been asked for."""
        self.ts.setUp()

    def describe(self) -> str:
        """The method in words."""
        how = f"tolerance {self.settings.tolerance:g}" if self.adaptive else "fixed step"
        return f"{self.name}, {how}"

    def destroy(self) -> None:
        """Free PETSc's objects; a TS that is left to Python's end can crash it."""
        self.ts.destroy()

    def failed(self, goal: float, why: str) -> MotionStopped:
        """The error of a step that failed."""
        cure = "a smaller tolerance" if self.adaptive else "a smaller dynamics.step"
        others = " or ".join(f'"{row.name}"' for row in METHODS.values() if row.conserves)
        hint = "" if METHODS[self.name].conserves else f", or integrator = {others}"
        return MotionStopped(
            f"{self.name} cannot go on from time {self.time:.6g} to {goal:.6g}: {why}; try {cure}{hint}"
        )
