"""Simple bodies in compiled loops: what `kernel/motion` takes of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.kernel import adaptive, implicit, motion
from ancf_petsc.kernel.choice import kernel_set
from ancf_petsc.kernel.explicit import RungeKutta
from ancf_petsc.kernel.implicit import Progress, Scheme, Test
from ancf_petsc.kernel.motion import System
from ancf_petsc.motion.equations import Equations

CELLS_AT_ONCE = 10**7
"""Cells times evaluations of forces of one leap: about half a second between two looks at Ctrl-C."""


class Leap(NamedTuple):
    """What `CompiledMotion.leap` did. status: as `kernel/adaptive` has it. work, loss: of loads and damping."""

    status: int
    time: float
    steps: int
    rejected: int
    work: float
    loss: float
    proposed: float
    speed: float


def compiled_motion(equations: Equations) -> CompiledMotion | None:
    """For one rank, one material, an element with such kernels, nothing driven along, a mass that is factored; else None."""
    model = equations.assembly.model
    simple = equations.comm.size == 1 and len(model.regions) == 1
    simple = simple and not equations.is_driven and not model.frames
    fits = simple and kernel_set(model.element).force_of_all is not None and equations.solver.is_factored
    return CompiledMotion(equations) if fits else None


class CompiledMotion:
    """Rates of change and steps of a body that `compiled_motion` took.

    steady: whether the loads stay as they are. at_once: evaluations of forces of one leap.
    """

    def __init__(self, equations: Equations) -> None:
        assembly, mass, model = equations.assembly, equations.mass, equations.assembly.model
        force_of_all = kernel_set(model.element).force_of_all
        assert force_of_all is not None
        region, cells = model.regions[0], tuple(model.tables)
        self._duration, self._loads = equations.duration, model.loads
        n = model.owned
        self._patterns = np.array([load.pattern for load in model.loads]).reshape(-1, n, 3)
        self._system = tuple(
            System(
                body=(force_of_all(region.law, cells), cells, region.parameters, (region.first, region.last)),
                damping=float(equations.damping),
                mass=tuple(equations.solver.factors()),
                graph=(*assembly.graph, mass.values),
                buffers=(np.empty((n, 3)), np.empty((3, n))),
            )
        )
        self._shape = (2, n, 3)
        self._buffers = tuple(np.empty((3, n, 3)))
        self.steady = all(load.ramp.kind == "constant" for load in model.loads)
        self._now = self._factors(np.zeros(1))[0]
        self.at_once = max(1, CELLS_AT_ONCE // max(1, len(model.cells)))

    def rates(self, t: float, y: NDArray, f: NDArray) -> None:
        """f = dy/dt of y = (x, v), flat, at time t."""
        state, change = y.reshape(self._shape), f.reshape(self._shape)
        motion.rates(state, self._loads_at(t), self._system, change)

    def march(
        self, start: float, h: float, count: int, x: NDArray, v: NDArray, a: NDArray
    ) -> tuple[float, float]:
        """`count` steps h of the central difference: x, v, a (n, 3) move on. Returns work of the loads and loss."""
        loads = (self._factors(start + h * np.arange(count + 1)), self._patterns)
        return motion.march((x, v, a), h, loads, self._system)

    def leap(
        self,
        y: NDArray,
        method: RungeKutta,
        span: tuple[float, float, float],
        control: tuple[float, float, float, float, float],
    ) -> Leap:
        """Steps of an adaptive pair under `steady` loads: y (flat) moves on. span, control: see `kernel/adaptive`."""
        state = y.reshape(self._shape)
        before = state[0].copy()
        course = ((*span, max(1, self.at_once // (len(method.weights) - method.reuses_last))), control)
        status, time, steps, rejected, loss, proposed, speed = adaptive.leap(
            state, method.as_arguments, course, (self._now, self._patterns), self._system
        )
        return Leap(status, time, steps, rejected, self.work(before, state[0]), loss, proposed, speed)

    def work(self, before: NDArray, after: NDArray) -> float:
        """Of `steady` loads between two positions (n, 3)."""
        return float(np.vdot(np.tensordot(self._now, self._patterns, 1), after - before))

    def implicit(
        self,
        state: tuple[NDArray, NDArray, NDArray, NDArray],
        progress: Progress,
        times: NDArray,
        scheme: Scheme,
        test: Test,
        solver: tuple[NDArray, NDArray],
    ) -> tuple[int, Progress]:
        """Steps of generalised alpha, their loads taken at `times`: x, v, a, d (n, 3) move on. solver: starts and
        factor of the tangent. See `kernel/implicit`.
        """
        loads = (self._factors(times), self._patterns)
        rules = (tuple(scheme), tuple(test), solver, self._buffers)
        status, reached = implicit.alpha_steps(state, tuple(progress), rules, loads, self._system)
        return status, Progress(*reached)

    def unbalance(
        self, t: float, x: NDArray, d: NDArray, part: float, carried: NDArray
    ) -> tuple[NDArray, float]:
        """M carried + Q(x + part d) - Q_e(t) (n, 3), valid until the next call, and the sum of squares of the three."""
        values = self._buffers[2]
        return values, motion.unbalance((x, d, carried), part, self._loads_at(t), self._system, values)

    def _loads_at(self, t: float) -> tuple[NDArray, NDArray]:
        """Factors (l,) and patterns (l, n, 3) of the loads at a time."""
        return (self._now if self.steady else self._factors(np.array([t]))[0]), self._patterns

    def _factors(self, times: NDArray) -> NDArray[np.float64]:
        """(m, l) of the loads at the times (m,)."""
        if self.steady:
            return np.ones((len(times), len(self._loads)))
        values = [[load.ramp.value(t / self._duration) for load in self._loads] for t in times]
        return np.array(values, float).reshape(len(times), len(self._loads))
