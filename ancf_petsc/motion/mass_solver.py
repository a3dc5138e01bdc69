"""Solving with the mass matrix of the free degrees of freedom.

One rank: Cholesky's factor of the scalar mass, all its components at once, one for each set of free nodes.
Several ranks, or a body whose factor would be large: Chebyshev's iteration over the diagonal on fixed bounds
(Golub and Varga 1961): no dot products, so every number of ranks gives the same numbers.
"""

from __future__ import annotations

from math import ceil, log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.algebra.envelope import envelope, factorise, solve_fields
from ancf_petsc.model.mass import Mass

MOST_FILL = 25
"""Entries of a factor to one of the mass up to which solving with it takes less time than iterating."""
ACCURACY = 1e-13


class Factors(NamedTuple):
    """Of the mass, as `algebra/envelope` has them: starts (n+1,), factors (k, size), which (3,) serves each component.

    share (n, 3): 1 / mass, 0 where driven. A lumped mass has the last alone, and no factors.
    """

    starts: NDArray[np.int64]
    factors: NDArray[np.float64]
    which: NDArray[np.int64]
    share: NDArray[np.float64]


class MassSolver:
    """Solves M a = b on the free degrees of freedom; driven ones get 0. method: cholesky, chebyshev; None chooses.

    is_factored: whether there are `factors`.
    """

    def __init__(self, mass: Mass, method: str | None = None) -> None:
        self.mass = mass
        model = mass.assembly.model
        self.free = model.drive[: model.owned] < 0
        self._starts = envelope(*mass.assembly.graph) if mass.comm.size == 1 else np.zeros(1, np.int64)
        method = method or self._choose()
        self.is_factored = mass.lumped or method == "cholesky"
        root = sqrt(mass.bounds[1] / mass.bounds[0])
        self._iterations = 1 if mass.lumped else ceil(log(ACCURACY / 2) / log((root - 1) / (root + 1)))
        self._factors = self._factor() if self.is_factored else None
        self._work = np.empty((3, model.owned))

    def solve(self, b: NDArray) -> NDArray[np.float64]:
        """a (n, 3) from b (n, 3) on owned nodal vectors. Collective."""
        if self.mass.lumped:
            return np.where(self.free, b / self.mass.diagonal[:, None], 0.0)
        if self._factors is None:
            return self._chebyshev(b)
        result = np.array(b, order="C")
        solve_fields(*self._factors[:3], result, self._work)
        return result

    def factors(self) -> Factors:
        """Of a mass that `is_factored`."""
        assert self._factors is not None
        return self._factors

    def _choose(self) -> str:
        if self.mass.assembly.model.frames:
            return "chebyshev"  # components of nodes with a frame hang together
        wide = self._starts[-1] > MOST_FILL * len(self.mass.values)
        return "chebyshev" if self.mass.comm.size > 1 or self.mass.lumped or wide else "cholesky"

    def _factor(self) -> Factors:
        share, which = self.free / self.mass.diagonal[:, None], np.zeros(3, np.int64)
        if self.mass.lumped:
            return Factors(np.zeros(1, np.int64), np.zeros((0, 0)), which, share)
        sets = [self.free[:, axis].tobytes() for axis in range(3)]
        kinds = list(dict.fromkeys(sets))
        which[:] = [kinds.index(each) for each in sets]
        factors = np.empty((len(kinds), self._starts[-1]))
        for kind, factor in zip(kinds, factors, strict=True):
            free = np.frombuffer(kind, bool).copy()
            if not factorise(self._starts, *self.mass.assembly.graph, self.mass.values, free, factor):
                raise ArithmeticError("the mass is not positive definite")
        return Factors(self._starts, factors, which, share)

    def _chebyshev(self, b: NDArray) -> NDArray:
        low, high = self.mass.bounds
        middle, half = (high + low) / 2, (high - low) / 2
        inverse = self.free / self.mass.diagonal[:, None]
        result, direction, step = np.zeros_like(b), np.zeros_like(b), 0.0
        residual = inverse * b
        for k in range(self._iterations):
            if k == 0:
                direction, step = residual / middle, 1.0 / middle
            else:
                beta = (half * step) ** 2 / (2.0 if k == 1 else 4.0)
                step = 1.0 / (middle - beta / step)
                direction = step * residual + beta * direction
            result += direction
            residual -= inverse * self.mass.times(direction)
        return result
