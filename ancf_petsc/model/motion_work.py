"""Work of loads and driven nodes and loss in a motion, added up step by step to a higher order than the
motion has.

Loss and load ramps: cubics through values and derivatives at both ends of a step. Driven nodes: the
polynomial through the last states, as along a quasi-static path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.model.drive import Drive
from ancf_petsc.model.load import Load
from ancf_petsc.model.work import PathWork

ABSCISSAE, WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Powers:
    """What the sums need of a state: rate of loss and its derivative, what loads see (l,) and its rate,
    reactions (m,).
    """

    loss: float
    loss_rate: float
    seen: NDArray[np.float64]
    seen_rate: NDArray[np.float64]
    reactions: NDArray[np.float64]


class MotionWork:
    """external, dissipated: sums since the start."""

    def __init__(self, drives: Sequence[Drive], loads: Sequence[Load], duration: float) -> None:
        self.loads, self.duration = loads, duration
        self.dissipated = 0.0
        self._of_loads = 0.0
        self._of_impulses = 0.0
        self._driven = PathWork(drives, [])
        self._drives = any(drive.amplitude for drive in drives)
        self._time, self._powers = 0.0, Powers(0.0, 0.0, np.zeros(0), np.zeros(0), np.zeros(0))

    def state(self) -> dict[str, Any]:
        """The sums, and what goes on from."""
        return {
            "dissipated": self.dissipated,
            "of_loads": self._of_loads,
            "of_impulses": self._of_impulses,
            "driven": self._driven.state(),
            "time": self._time,
            "powers": asdict(self._powers),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state."""
        self.dissipated, self._of_loads = state["dissipated"], state["of_loads"]
        self._of_impulses, self._time = state["of_impulses"], state["time"]
        self._driven.restore(state["driven"])
        self._powers = Powers(**state["powers"])

    @property
    def external(self) -> float:
        return self._of_loads + self._of_impulses + self._driven.total

    def start(self, time: float, powers: Powers, impulse: float = 0.0) -> None:
        """Begin a smooth piece; impulse: the work of a jump of driven velocities just before it."""
        self._of_impulses += impulse
        if self._drives:
            self._driven.start(time / self.duration, powers.reactions, np.zeros(0))
        self._time, self._powers = time, powers

    def add(self, time: float, now: Powers) -> None:
        """Go on to the state at `time`."""
        before, h = self._powers, time - self._time
        self.dissipated += h / 2 * (before.loss + now.loss) + h * h / 12 * (before.loss_rate - now.loss_rate)
        self._of_loads += self._load_work(time, before, now)
        if self._drives:
            self._driven.add(time / self.duration, now.reactions, np.zeros(0))
        self._time, self._powers = time, now

    def add_known(self, work: float, dissipated: float) -> None:
        """What a step knows exactly."""
        self._of_loads += work
        self.dissipated += dissipated

    def _load_work(self, time: float, before: Powers, now: Powers) -> float:
        work, h = 0.0, time - self._time
        for k, load in enumerate(self.loads):
            s0, s1 = self._time / self.duration, time / self.duration
            work += load.ramp.value(s1) * now.seen[k] - load.ramp.value(s0) * before.seen[k]
            if load.ramp.kind == "constant":
                continue
            for point, weight in zip((ABSCISSAE + 1) / 2, WEIGHTS / 2, strict=True):
                rate = load.ramp.rate(s0 + point * (s1 - s0)) / self.duration
                seen = _cubic(
                    point, h, (before.seen[k], now.seen[k]), (before.seen_rate[k], now.seen_rate[k])
                )
                work -= h * weight * rate * seen
        return float(work)


def _cubic(p: float, h: float, values: tuple[float, float], slopes: tuple[float, float]) -> float:
    """The cubic at part p of an interval of length h with values and slopes at its ends."""
    q = 1 - p
    ends = (1 + 2 * p) * q * q * values[0] + (1 + 2 * q) * p * p * values[1]
    return ends + h * p * q * (q * slopes[0] - p * slopes[1])
