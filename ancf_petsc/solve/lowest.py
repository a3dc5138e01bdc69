"""The lowest eigenvalue of the tangent and its mode, followed along a path by a few iterations a state.

K phi = lambda D phi, D the diagonal of the first tangent: lambda has no unit, and its sign is that of the tangent. Each
iteration takes the best of three vectors, the mode, its preconditioned residual and the step before: A. V. Knyazev,
Toward the optimal preconditioned eigensolver (LOBPCG), SIAM J. Sci. Comput. 23 (2001) 517, with one vector. The
preconditioner is that of the last linear solve; where the tangent was factored this is inverse iteration.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.parallel.exchange import combined
from ancf_petsc.parallel.fields import field
from ancf_petsc.solve.newton import Newton

SETTLED = 1e-3
"""Of a value's change in an iteration: it is known then."""


class LowestMode:
    """Follows the lowest mode of Newton's tangent. value: the last eigenvalue. Every method is collective.

    mode (n, 3): on owned nodal vectors, of length 1 by D; zero where driven.
    """

    def __init__(self, newton: Newton) -> None:
        self.newton = newton
        self.assembly = newton.assembly
        self.value = np.inf
        self._free = (self.assembly.model.drive[: self.assembly.model.owned] < 0).ravel()
        self._mode = self._start()
        self._scale, self._known = np.zeros(0), False
        self._in, self._out = self.assembly.vector(), self.assembly.vector()

    def destroy(self) -> None:
        """Free PETSc's objects."""
        self._in.destroy()
        self._out.destroy()

    @property
    def scale(self) -> NDArray[np.float64]:
        """D (3 n,)."""
        return self._scale

    @property
    def mode(self) -> NDArray[np.float64]:
        return self._mode.reshape(-1, 3)

    def state(self) -> dict[str, Any]:
        """What the next look begins with."""
        scale = self._scale if self._known else np.zeros_like(self._mode)
        return {
            "value": self.value,
            "mode": field(self._mode),
            "scale": field(scale),
            "known": self._known,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state."""
        self.value, self._mode = state["value"], state["mode"].ravel()
        self._scale, self._known = state["scale"].ravel(), state["known"]

    def restart(self) -> None:
        """Forget the mode: of equal eigenvalues the next look finds the same one, whatever was looked at before."""
        self._mode = self._start()

    def look(self, iterations: int) -> float:
        """The lowest eigenvalue of the tangent that the linear solver holds, after as many iterations at most."""
        if not self._known:
            self._scale, self._known = self._diagonal(), True
        if not self._dot(self._mode):
            return np.inf
        vectors = self._mode[None]
        products = self._times(self._mode)[None]
        value = np.inf
        for _ in range(iterations):
            value, before = self._value(vectors[0], products[0]), value
            if abs(before - value) <= SETTLED * abs(value):
                break
            residual = products[0] - value * self._scale * vectors[0]
            fresh = self._preconditioned(residual)
            size = np.sqrt(self._dot(self._scale * fresh, fresh))
            if not np.isfinite(size) or size == 0.0:
                break
            fresh /= size
            vectors = np.concatenate((vectors[:1], fresh[None], vectors[1:]))
            products = np.concatenate((products[:1], self._times(fresh)[None], products[1:]))
            vectors, products = self._best(vectors, products)
        self.value = self._value(vectors[0], products[0])
        self._mode = vectors[0].copy()
        return self.value

    def _best(self, vectors: NDArray, products: NDArray) -> tuple[NDArray, NDArray]:
        """The lowest combination (1, n) of vectors (k, n), and what of it is not the first vector; with products."""
        k = len(vectors)
        sums = combined(
            self.assembly.comm, np.concatenate((vectors @ (self._scale * vectors).T, vectors @ products.T))
        )
        gram, stiffness = sums[:k], (sums[k:] + sums[k:].T) / 2
        lengths, axes = np.linalg.eigh(gram)
        good = lengths > 1e-12 * lengths[-1]
        basis = axes[:, good] / np.sqrt(lengths[good])
        _, inner = np.linalg.eigh(basis.T @ stiffness @ basis)
        weights = basis @ inner[:, 0]
        rest = np.where(np.arange(k) == 0, 0.0, weights)
        length = np.sqrt(max(rest @ gram @ rest, 0.0))
        rows = weights[None] if length == 0.0 else np.stack((weights, rest / length))
        return rows @ vectors, rows @ products

    def _value(self, vector: NDArray, product: NDArray) -> float:
        sums = np.array([vector @ product, vector @ (self._scale * vector)])
        above, below = combined(self.assembly.comm, sums)
        return float(above / below)

    def _dot(self, a: NDArray, b: NDArray | None = None) -> float:
        return float(combined(self.assembly.comm, float(a @ (a if b is None else b))))

    def _times(self, vector: NDArray) -> NDArray[np.float64]:
        """The tangent times a vector."""
        self._in.array[:] = vector
        self.newton.linear.operator.mult(self._in, self._out)
        return self._out.array_r.copy()

    def _preconditioned(self, residual: NDArray) -> NDArray[np.float64]:
        self._in.array[:] = residual
        self.newton.linear.ksp.getPC().apply(self._in, self._out)
        return np.where(self._free, self._out.array_r, 0.0)

    def _diagonal(self) -> NDArray[np.float64]:
        """The size of the diagonal, nowhere so small that it would be all that counts."""
        diagonal = np.abs(self.newton.matrix.mat.getDiagonal().array_r)
        return np.maximum(diagonal, 1e-9 * self.newton.matrix.largest_diagonal)

    def _start(self) -> NDArray[np.float64]:
        """A vector without symmetry, the same on any number of ranks: it hangs on places in the file alone."""
        model = self.assembly.model
        row = model.numbering.file_nodes[: model.owned, None]
        numbers = np.sin(12.9898 * (row + 1.0) + 78.233 * np.arange(3)) * 43758.5453
        return np.where(self._free, (numbers - np.floor(numbers)).ravel() - 0.3, 0.0)
