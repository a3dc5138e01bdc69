"""A model of runs on many ranks, fitted to runs on one and two, to counted ghosts and timed messages.

    T(n, p) = serial n + work n (1 + overlap) / p
              + iterations (exchanges (neighbours latency + bytes / bandwidth) + sums sum log2 p)

serial: per element, by the root rank alone. work: per element, shared by the ranks, as found on two at once, for
the ranks of a node share its memory. Ghosts grow with the surface of a part, (nodes / p)^(2/3).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, log2
from typing import Any

import numpy as np

EXCHANGES, SUMS = (
    1,
    4,
)  # of conjugate gradients with two levels, an iteration: the fourth sum is over the parts
TWO_LEVEL_RANKS = 64  # beyond them multigrid takes over
SMOOTHING = 6  # exchanges of a multigrid cycle on every level
COARSENING = 8  # degrees of freedom of a level over those of the next
BYTES = 24  # of a node's values


@dataclass(frozen=True)
class Parts:
    """Seconds of a run on p ranks."""

    ranks: int
    elements: float
    serial: float
    shared: float
    messages: float
    sums: float

    @property
    def total(self) -> float:
        return self.serial + self.shared + self.messages + self.sums


class Model:
    """Fitted to the results of `ancf bench`: a run on two ranks, the set-up, scaling/*.

    multigrid: what the run's linear solver was.
    """

    def __init__(self, results: dict[str, Any], run: str, *, multigrid: bool) -> None:
        self.multigrid = multigrid
        facts = results[run]["facts"]
        self.elements, self.dof = facts["elements"], facts["dof"]
        self.iterations = facts["iterations"]["linear"]
        setup = results["setup_480k"]
        alone = setup["facts"]["seconds"]
        self.serial = (np.median(alone["read"]) + np.median(alone["tables"])) / 478_059
        counted = [
            result["facts"] | {"ranks": result["ranks"]}
            for name, result in results.items()
            if "messages" in name
        ]
        self._fit_division(counted)
        exchange = results["scaling/exchange"]
        self.latency = 1e-6 * exchange["median"]
        self.bandwidth = 1e9 * float(np.median(exchange["facts"]["bandwidth_gb_s"]))
        self.sum_time = 1e-6 * float(np.median(exchange["facts"]["sum_us"]))
        self.work = 0.0
        measured = results[run]["median"]
        rest = measured - self.parts(self.elements, 2).total
        self.work = 2 * rest / self.elements / (1 + self.overlap(self.elements, 2))

    def _fit_division(self, counted: list[dict[str, Any]]) -> None:
        """Ghosts, elements counted twice and neighbours by least squares through what was counted."""
        ranks = np.array([found["ranks"] for found in counted], float)
        surface = np.array([(found["nodes"] / found["ranks"]) ** (2 / 3) for found in counted])
        ghosts = np.array([found["ghosts"] for found in counted], float)
        twice = np.array([found["elements_over_share"] - 1 for found in counted])
        share = np.array([(found["elements"] / found["ranks"]) ** (-1 / 3) for found in counted])
        inside = 1 - ranks ** (-1 / 3)
        neighbours = np.array([found["neighbours"] for found in counted], float)
        self.ghost_factor = float(ghosts @ surface / (surface @ surface))
        self.overlap_factor = float(twice @ share / (share @ share))
        self.neighbour_limit = float(neighbours @ inside / (inside @ inside))

    def overlap(self, elements: float, ranks: int) -> float:
        """Elements that several ranks visit, over a rank's share."""
        return self.overlap_factor * (elements / ranks) ** (-1 / 3) if ranks > 1 else 0.0

    def parts(self, elements: float, ranks: int) -> Parts:
        """The seconds of a run that takes as many iterations as the measured one."""
        nodes = elements * self.dof / 3 / self.elements
        shared = self.work * elements / ranks * (1 + self.overlap(elements, ranks))
        if ranks == 1:
            return Parts(1, elements, self.serial * elements, shared, 0.0, 0.0)
        neighbours = min(ranks - 1, self.neighbour_limit * (1 - ranks ** (-1 / 3)))
        ghosts = self.ghost_factor * (nodes / ranks) ** (2 / 3)
        levels = max(1.0, log(3 * nodes) / log(COARSENING)) if self.multigrid else 0.0
        exchanges = EXCHANGES + SMOOTHING * levels
        message = neighbours * self.latency + ghosts * BYTES / self.bandwidth
        return Parts(
            ranks,
            elements,
            self.serial * elements,
            shared,
            self.iterations * exchanges * message,
            self.iterations * SUMS * self.sum_time * log2(ranks),
        )
