"""Simple bodies in compiled loops: what `kernel/motion` takes of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.kernel.choice import kernel_set
from ancf_petsc.kernel.implicit import Progress, Scheme, Test
from ancf_petsc.motion.equations import Equations

CELLS_AT_ONCE = 10**7
"""Cells times evaluations of forces of one leap: about half a second between two looks at Ctrl-C."""


class Leap(NamedTuple):
    """What `FusedMotion.leap` did. status: as `kernel/adaptive` has it. work, loss: of loads and damping."""

    status: int
    time: float
    steps: int
    rejected: int
    work: float
    loss: float
    proposed: float
    speed: float


def fused_motion(equations: Equations) -> FusedMotion | None:
    """For one rank, one material, an element with such kernels, nothing driven along, a mass that is factored; else None."""
    model = equations.assembly.model
    simple = equations.comm.size == 1 and len(model.regions) == 1 and not equations.is_driven
    fits = simple and kernel_set(model.element).motion is not None and equations.solver.is_factored
    return FusedMotion(equations) if fits else None


class FusedMotion:
    """Rates of change and steps of a body that `fused_motion` took.

    steady: whether the loads stay as they are. at_once: evaluations of forces of one leap.
    """

    def __init__(self, equations: Equations) -> None:
        assembly, mass, model = equations.assembly, equations.mass, equations.assembly.model
        kernels = kernel_set(model.element).motion
        assert kernels is not None
        region = model.regions[0]
        self._kernels = kernels(region.law)
        self._damping, self._duration = equations.damping, equations.duration
        self._loads = model.loads
        self._body = (tuple(model.tables), region.parameters)
        n = model.owned
        self._patterns = np.array([load.pattern for load in model.loads]).reshape(-1, n, 3)
        self._mass = tuple(equations.solver.factors())
        self._graph = (*assembly.graph, mass.values)
        self._shape = (2, n, 3)
        self._buffers = (np.empty((n, 3)), np.empty((3, n)))
        self._values, self._fields = np.empty((n, 3)), (np.empty((n, 3)), np.empty((n, 3)))
        self._stages = (np.empty((7, 2, n, 3)), np.empty((2, n, 3)))
        self.steady = all(load.ramp.kind == "constant" for load in model.loads)
        self._now = self._factors(np.zeros(1))[0]
        self.at_once = max(1, CELLS_AT_ONCE // max(1, len(model.cells)))

    def rates(self, t: float, y: NDArray, f: NDArray) -> None:
        """f = dy/dt of y = (x, v), flat, at time t."""
        state, change = y.reshape(self._shape), f.reshape(self._shape)
        self._kernels.rates(state, *self._system(self._factors_at(t)), change)

    def march(
        self, start: float, h: float, count: int, x: NDArray, v: NDArray, a: NDArray
    ) -> tuple[float, float]:
        """`count` steps h of the central difference: x, v, a (n, 3) move on. Returns work of the loads and loss."""
        factors = self._factors(start + h * np.arange(count + 1))
        body, patterns, mass, graph = self._body, self._patterns, self._mass, self._graph
        return self._kernels.march(
            x, v, a, h, self._damping, body, factors, patterns, mass, graph, *self._buffers
        )

    def leap(
        self, y: NDArray, span: tuple[float, float, float], control: tuple[float, float, float, float, float]
    ) -> Leap:
        """Steps of the adaptive pair under `steady` loads: y (flat) moves on. span, control: see `kernel/adaptive`."""
        state = y.reshape(self._shape)
        before = state[0].copy()
        status, time, steps, rejected, loss, proposed, speed = self._kernels.leap(
            state,
            span,
            max(1, self.at_once // 6),
            control,
            self._damping,
            self._graph,
            self._system(self._now),
            *self._stages,
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
        buffers = (*self._fields, self._buffers[0], self._values)
        share = self._mass[3]
        return self._kernels.alpha(
            *state,
            progress,
            len(times),
            scheme,
            test,
            loads,
            self._body,
            self._graph,
            share,
            solver,
            buffers,
        )

    def unbalance(
        self, t: float, x: NDArray, d: NDArray, part: float, carried: NDArray
    ) -> tuple[NDArray, float]:
        """M carried + Q(x + part d) - Q_e(t) (n, 3), valid until the next call, and the sum of squares of the three."""
        force, values = self._buffers[0], self._values
        factors = self._factors_at(t)
        total = self._kernels.unbalance(
            x, d, part, carried, self._body, factors, self._patterns, self._graph, force, values
        )
        return values, total

    def _system(self, factors: NDArray) -> tuple:
        """What the rates depend on beside the state."""
        return (self._damping, self._body, factors, self._patterns, self._mass, *self._buffers)

    def _factors_at(self, t: float) -> NDArray[np.float64]:
        return self._now if self.steady else self._factors(np.array([t]))[0]

    def _factors(self, times: NDArray) -> NDArray[np.float64]:
        """(m, l) of the loads at the times (m,)."""
        if self.steady:
            return np.ones((len(times), len(self._loads)))
        values = [[load.ramp.value(t / self._duration) for load in self._loads] for t in times]
        return np.array(values, float).reshape(len(times), len(self._loads))
