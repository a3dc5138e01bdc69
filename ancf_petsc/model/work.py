"""Work of driven degrees of freedom and of dead loads along the path.

All of it hangs on a few scalars: each drive has the sum of reactions on its degrees of freedom, each load the
displacement its pattern sees. W = sum_m ∫ R_m dq_m + sum_l ∫ p_l dD_l, where R_m over q_m and D_l over p_l follow
polynomials through the last accepted states: over the displacement a force is smoother than over the pseudo-time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.model.drive import Drive
from ancf_petsc.model.load import Load
from ancf_petsc.model.ramp import Ramp

POINTS = 4
ABSCISSAE, WEIGHTS = np.polynomial.legendre.leggauss(4)


class PathWork:
    """Adds up external work. `reactions` (m,) and `displacements` (l,) belong to drives and loads."""

    def __init__(self, drives: Sequence[Drive], loads: Sequence[Load]) -> None:
        self.drives = drives
        self.loads = loads
        self.total = 0.0
        self._before = 0.0
        self._settled = False
        self._states: list[tuple[float, NDArray, NDArray, float | None]] = []

    def state(self) -> dict[str, Any]:
        """The sum, and what goes on from."""
        return {
            "total": self.total,
            "before": self._before,
            "settled": self._settled,
            "states": [list(state) for state in self._states],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state."""
        self.total, self._before = state["total"], state["before"]
        self._settled = state["settled"]
        self._states = [(s, reactions, seen, length) for s, reactions, seen, length in state["states"]]

    def start(
        self, s: float, reactions: NDArray, displacements: NDArray, length: float | None = None
    ) -> None:
        """Begin a smooth piece of the path: at the start, and where a ramp has a corner."""
        self._before = self.total
        self._settled = False
        self._states = [(s, reactions, displacements, length)]

    def add(self, s: float, reactions: NDArray, displacements: NDArray, length: float | None = None) -> None:
        """Go on to the state at s. While few states are known, all of the piece is integrated again with them.

        length: of the path so far, where s may turn back: everything is a polynomial of it then.
        """
        self._states.append((s, reactions, displacements, length))
        if len(self._states) > POINTS:
            del self._states[0]
        newest = len(self._states) - 1
        if self._settled:
            self.total += self._increment(newest)
        else:
            self.total = self._before + sum(self._increment(k) for k in range(1, newest + 1))
            self._settled = newest == POINTS - 1

    def jump(self, s: float, reactions: NDArray, displacements: NDArray) -> float:
        """Go on to the state at s which the body has come to under the loads and moves of s; the path begins anew there. Returns
        the work in between: moves come first, against the reactions before.
        """
        before, reactions_before, seen_before, _ = self._states[-1]
        work = 0.0
        for m, drive in enumerate(self.drives):
            work += drive.amplitude * (drive.ramp.value(s) - drive.ramp.value(before)) * reactions_before[m]
        for number, load in enumerate(self.loads):
            work += load.ramp.value(s) * (displacements[number] - seen_before[number])
        self.total += work
        self.start(s, reactions, displacements)
        return work

    def _increment(self, k: int) -> float:
        """Work between states k - 1 and k."""
        times = [state[0] for state in self._states]
        lengths = [state[3] for state in self._states if state[3] is not None]
        work = 0.0
        for m, drive in enumerate(self.drives):
            reactions = [state[1][m] for state in self._states]
            work += drive.amplitude * _integral(drive.ramp, times, reactions, k, lengths)
        for number, load in enumerate(self.loads):
            seen = [state[2][number] for state in self._states]
            ends = [load.ramp.value(times[j]) * seen[j] for j in (k - 1, k)]
            work += ends[1] - ends[0] - _integral(load.ramp, times, seen, k, lengths)
        return work


def _integral(
    ramp: Ramp, times: Sequence[float], values: Sequence[float], k: int, lengths: Sequence[float]
) -> float:
    """∫ values df from state k - 1 to k, f the factor of the ramp, in which the values follow a polynomial; values and
    factor are polynomials of the length of the path where that is given.
    """
    factors = np.array([ramp.value(t) for t in times])
    if len(lengths) == len(times):
        along = np.array(lengths)
        middle, half = (along[k] + along[k - 1]) / 2, (along[k] - along[k - 1]) / 2
        points = middle + half * ABSCISSAE
        rates = np.polynomial.Polynomial.fit(along, factors, len(along) - 1).deriv()
        return float(half * WEIGHTS @ (_lagrange(along, points) @ values * rates(points)))
    low, high = factors[k - 1], factors[k]
    if low == high:
        return 0.0
    middle, half = (high + low) / 2, (high - low) / 2
    points = middle + half * ABSCISSAE
    return float(half * WEIGHTS @ (_lagrange(factors, points) @ values))


def _lagrange(nodes: NDArray, points: NDArray) -> NDArray:
    """Values (p, n) at points of the polynomials that are 1 at one of n nodes and 0 at the others."""
    basis = np.ones((len(points), len(nodes)))
    for i in range(len(nodes)):
        for j in range(len(nodes)):
            if i != j:
                basis[:, i] *= (points - nodes[j]) / (nodes[i] - nodes[j])
    return basis
