"""Work of driven degrees of freedom and of dead loads along the path.

All of it hangs on a few scalars: each motion has the sum of reactions on its degrees of freedom, each load the
displacement its pattern sees. W = sum_m ∫ R_m dq_m + sum_l ∫ p_l dD_l, where q_m(s) and p_l(s) are the ramps, known
exactly, and R_m, D_l follow the polynomial through the last accepted states.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.system.constraint import Motion
from ancf_petsc.system.load import Load

POINTS = 4
ABSCISSAE, WEIGHTS = np.polynomial.legendre.leggauss(8)


class PathWork:
    """Adds up external work. `reactions` (m,) and `displacements` (l,) belong to motions and loads."""

    def __init__(self, motions: Sequence[Motion], loads: Sequence[Load]) -> None:
        self.motions = motions
        self.loads = loads
        self.total = 0.0
        self._before = 0.0
        self._settled = False
        self._states: list[tuple[float, NDArray, NDArray]] = []

    def start(self, s: float, reactions: NDArray, displacements: NDArray) -> None:
        """Begin a smooth piece of the path: at the start, and where a ramp has a corner."""
        self._before = self.total
        self._settled = False
        self._states = [(s, reactions, displacements)]

    def add(self, s: float, reactions: NDArray, displacements: NDArray) -> None:
        """Go on to the state at s. While few states are known, all of the piece is integrated again with them."""
        self._states.append((s, reactions, displacements))
        if len(self._states) > POINTS:
            del self._states[0]
        newest = len(self._states) - 1
        if self._settled:
            self.total += self._increment(newest)
        else:
            self.total = self._before + sum(self._increment(k) for k in range(1, newest + 1))
            self._settled = newest == POINTS - 1

    def _increment(self, k: int) -> float:
        """Work between states k - 1 and k."""
        if len(self._states) == 2:
            return self._trapezoid()
        times = np.array([state[0] for state in self._states])
        middle, half = (times[k] + times[k - 1]) / 2, (times[k] - times[k - 1]) / 2
        work = 0.0
        for t, weight in zip(middle + half * ABSCISSAE, half * WEIGHTS, strict=True):
            basis = _lagrange(times, t)
            reactions = sum(b * state[1] for b, state in zip(basis, self._states, strict=True))
            displacements = sum(b * state[2] for b, state in zip(basis, self._states, strict=True))
            rates = [motion.amplitude * motion.ramp.rate(t) for motion in self.motions]
            growth = [load.ramp.rate(t) for load in self.loads]
            work += weight * (np.dot(reactions, rates) - np.dot(displacements, growth))
        for number, load in enumerate(self.loads):
            ends = [load.ramp.value(times[j]) * self._states[j][2][number] for j in (k - 1, k)]
            work += ends[1] - ends[0]
        return float(work)

    def _trapezoid(self) -> float:
        """Work between the first two states: force against displacement is a straight line, whatever the ramp."""
        (s0, reactions_0, seen_0), (s1, reactions_1, seen_1) = self._states
        moved = [motion.value(s1) - motion.value(s0) for motion in self.motions]
        factors = [0.5 * (load.ramp.value(s0) + load.ramp.value(s1)) for load in self.loads]
        return float(np.dot(0.5 * (reactions_0 + reactions_1), moved) + np.dot(factors, seen_1 - seen_0))


def _lagrange(nodes: NDArray, t: float) -> NDArray:
    """Values at t of the polynomials that are 1 at one node and 0 at the others."""
    basis = np.ones(len(nodes))
    for i in range(len(nodes)):
        for j in range(len(nodes)):
            if i != j:
                basis[i] *= (t - nodes[j]) / (nodes[i] - nodes[j])
    return basis
