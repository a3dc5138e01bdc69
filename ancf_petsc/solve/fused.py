"""Simple bodies in compiled loops: what `kernel/motion` takes of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.kernel.choice import way_of
from ancf_petsc.solve.mass_solver import MassSolver
from ancf_petsc.system.mass import Mass


class FusedMotion:
    """Rates of change and steps of a body that `fits`. duration: of the motion, for the ramps of its loads."""

    def __init__(self, mass: Mass, solver: MassSolver, damping: float, duration: float) -> None:
        assembly, model = mass.assembly, mass.assembly.model
        kernels = way_of(model.element).motion
        assert kernels is not None
        region, (cells, gradients, volumes) = model.regions[0], model.tables
        self._rates, self._march, self._unbalance = kernels(region.law)
        self._damping, self._duration, self._loads = damping, duration, model.loads
        self._body = (cells, gradients, volumes, region.parameters)
        n = model.owned
        self._patterns = np.array([load.pattern for load in model.loads]).reshape(-1, n, 3)
        self._mass = solver.factors()
        self._graph = (*assembly.graph, mass.values)
        self._shape = (2, n, 3)
        self._buffers = (np.empty((n, 3)), np.empty((3, n)))
        self._values = np.empty((n, 3))
        self._steady = all(load.ramp.kind == "constant" for load in model.loads)
        self._now = self._factors(np.zeros(1))[0]

    @staticmethod
    def fits(mass: Mass, solver: MassSolver, *, moving: bool) -> bool:
        """One rank, one material, an element with such kernels, nothing driven along, a mass that is factored."""
        model = mass.assembly.model
        simple = mass.comm.size == 1 and len(model.regions) == 1 and not moving
        return simple and way_of(model.element).motion is not None and solver.is_factored

    def rates(self, t: float, y: NDArray, f: NDArray) -> None:
        """f = dy/dt of y = (x, v), flat, at time t."""
        factors = self._factors_at(t)
        state, change = y.reshape(self._shape), f.reshape(self._shape)
        self._rates(
            state, self._damping, self._body, factors, self._patterns, self._mass, *self._buffers, change
        )

    def march(
        self, start: float, h: float, count: int, x: NDArray, v: NDArray, a: NDArray
    ) -> tuple[float, float]:
        """`count` steps h of the central difference: x, v, a (n, 3) move on. Returns work of the loads and loss."""
        factors = self._factors(start + h * np.arange(count + 1))
        return self._march(
            x,
            v,
            a,
            h,
            self._damping,
            self._body,
            factors,
            self._patterns,
            self._mass,
            self._graph,
            *self._buffers,
        )

    def unbalance(
        self, t: float, x: NDArray, d: NDArray, part: float, carried: NDArray
    ) -> tuple[NDArray, float]:
        """M carried + Q(x + part d) - Q_e(t) (n, 3), valid until the next call, and the sum of squares of the three."""
        force, values = self._buffers[0], self._values
        factors = self._factors_at(t)
        total = self._unbalance(
            x, d, part, carried, self._body, factors, self._patterns, self._graph, force, values
        )
        return values, total

    def _factors_at(self, t: float) -> NDArray[np.float64]:
        return self._now if self._steady else self._factors(np.array([t]))[0]

    def _factors(self, times: NDArray) -> NDArray[np.float64]:
        """(m, l) of the loads at the times (m,)."""
        values = [[load.ramp.value(t / self._duration) for load in self._loads] for t in times]
        return np.array(values, float).reshape(len(times), len(self._loads))
