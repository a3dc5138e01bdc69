"""The explicit Runge-Kutta methods, a row each, under PETSc's names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class RungeKutta(NamedTuple):
    """A method of s stages. stages (s, s): weights of the stages before each; weights (s,): of the step.

    lower (s,): weights of an embedded step one order below, by which the method adapts; none where there is no such.
    """

    name: str
    order: int
    stages: Floats
    weights: Floats
    lower: Floats | None = None

    @property
    def difference(self) -> Floats:
        """Weights (s,) of the error of the step, zero without an embedded one."""
        return np.zeros_like(self.weights) if self.lower is None else self.lower - self.weights

    @property
    def as_arguments(self) -> tuple[Floats, Floats, Floats, float, bool]:
        """What `adaptive.leap` takes of it."""
        return self.stages, self.weights, self.difference, float(self.order), self.reuses_last

    @property
    def reuses_last(self) -> bool:
        """Whether the last stage is the first of the next step."""
        return bool(np.array_equal(self.stages[-1], self.weights))


def method(
    name: str, order: int, rows: Sequence[Sequence[float]], weights: ArrayLike, lower: ArrayLike | None = None
) -> RungeKutta:
    """A row of the table, from the rows of its stages below the diagonal.

    Raises ValueError where the weights do not integrate powers of the time up to the order less one.
    """
    b = np.array(weights, float)
    stages = np.zeros((len(b), len(b)))
    for i, row in enumerate(rows):
        stages[i + 1, : len(row)] = row
    c = stages.sum(axis=1)
    for known, reached in ((b, order), (b if lower is None else np.array(lower, float), order - 1)):
        sums = [known @ c**k - 1 / (k + 1) for k in range(reached)]
        if np.abs(sums).max() > 1e-14:
            raise ValueError(f"{name}: weights are not of order {reached}")
    return RungeKutta(name, order, stages, b, None if lower is None else np.array(lower, float))


DORMAND_PRINCE = [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84]

EXPLICIT = {
    row.name: row
    for row in (
        method("4", 4, [[1 / 2], [0, 1 / 2], [0, 0, 1]], [1 / 6, 1 / 3, 1 / 3, 1 / 6]),
        # J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19
        method(
            "5dp",
            5,
            [
                [1 / 5],
                [3 / 40, 9 / 40],
                [44 / 45, -56 / 15, 32 / 9],
                [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
                [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
                DORMAND_PRINCE,
            ],
            [*DORMAND_PRINCE, 0],
            [5179 / 57600, 0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40],
        ),
    )
}
