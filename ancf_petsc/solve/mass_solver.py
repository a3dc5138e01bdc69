"""Solving with the mass matrix of the free degrees of freedom.

One rank: the inverse for very small bodies, else PETSc's Cholesky of the scalar mass; one of them per set
of free nodes, all its components at once. Several ranks, or a large body: Chebyshev's iteration over the
diagonal on fixed bounds (Golub and Varga 1961): no dot products, so every number of ranks gives the same
numbers.
"""

from __future__ import annotations

from math import ceil, log, sqrt

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array

from ancf_petsc.system.mass import Mass

LARGEST_TO_INVERT, LARGEST_TO_FACTOR = 150, 20_000
ACCURACY = 1e-13


class MassSolver:
    """Solves M a = b on the free degrees of freedom; driven ones get 0. way: inverse, cholesky, chebyshev;
    None chooses. is_inverted: whether there is an `explicit_inverse`.
    """

    def __init__(self, mass: Mass, way: str | None = None) -> None:
        self.mass = mass
        model = mass.assembly.model
        self.free = model.motion[: model.owned] < 0
        way = way or self._choose()
        self.is_inverted = mass.lumped or way == "inverse"
        self._factors = [] if way == "chebyshev" else self._factor(_Inverse if way == "inverse" else _Factor)
        root = sqrt(mass.bounds[1] / mass.bounds[0])
        self._iterations = 1 if mass.lumped else ceil(log(ACCURACY / 2) / log((root - 1) / (root + 1)))

    def solve(self, b: NDArray) -> NDArray[np.float64]:
        """a (n, 3) from b (n, 3) on owned nodal vectors. Collective."""
        if self.mass.lumped:
            return np.where(self.free, b / self.mass.diagonal[:, None], 0.0)
        if self._factors:
            result = np.zeros_like(b)
            for factor in self._factors:
                factor.solve(b, result)
            return result
        return self._chebyshev(b)

    def explicit_inverse(self) -> tuple[NDArray, NDArray, NDArray]:
        """Of a mass that `is_inverted`: inverses (k, n, n), the one that serves each component (3,), and 1 /
        mass (n, 3), 0 where driven. A lumped mass has the last alone.
        """
        share = self.free / self.mass.diagonal[:, None]
        which = np.zeros(3, np.int64)
        if self.mass.lumped:
            return np.zeros((0, 0, 0)), which, share
        inverses = [factor for factor in self._factors if isinstance(factor, _Inverse)]
        for k, factor in enumerate(inverses):
            which[factor.axes] = k
        return np.array([factor.inverse for factor in inverses]), which, share

    def destroy(self) -> None:
        """Free PETSc's objects."""
        for factor in self._factors:
            factor.destroy()

    def _choose(self) -> str:
        nodes = self.mass.assembly.model.owned
        if self.mass.comm.size > 1 or self.mass.lumped or nodes > LARGEST_TO_FACTOR:
            return "chebyshev"
        return "inverse" if nodes <= LARGEST_TO_INVERT else "cholesky"

    def _factor(self, kind: type[_Inverse] | type[_Factor]) -> list[_Inverse | _Factor]:
        pointers, columns = self.mass.assembly.graph
        n = len(self.free)
        matrix = csr_array((self.mass.values, columns, pointers), shape=(n, n))
        sets: dict[bytes, list[int]] = {}
        for axis in range(3):
            sets.setdefault(self.free[:, axis].tobytes(), []).append(axis)
        rows = {key: np.flatnonzero(np.frombuffer(key, bool)) for key in sets}
        return [kind(matrix[rows[key]][:, rows[key]], rows[key], axes, n) for key, axes in sets.items()]

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


class _Inverse:
    """The inverse of the mass of some nodes, zero elsewhere, and the components it serves."""

    def __init__(self, matrix: csr_array, rows: NDArray, axes: list[int], total: int) -> None:
        self.axes = slice(None) if len(axes) == 3 else axes
        self.inverse = np.zeros((total, total))
        self.inverse[np.ix_(rows, rows)] = np.linalg.inv(matrix.toarray())

    def solve(self, b: NDArray, into: NDArray) -> None:
        into[:, self.axes] = self.inverse @ b[:, self.axes]

    def destroy(self) -> None:
        """There is nothing of PETSc's."""


class _Factor:
    """The factor of the mass of some nodes, and the components it serves."""

    def __init__(self, matrix: csr_array, rows: NDArray, axes: list[int], _: int) -> None:
        self.place = np.ix_(rows, np.array(axes))
        size, count = len(rows), len(axes)
        integers = PETSc.IntType
        csr = (matrix.indptr.astype(integers), matrix.indices.astype(integers), matrix.data)
        self._matrix = PETSc.Mat().createAIJ((size, size), csr=csr, comm=PETSc.COMM_SELF)
        self._pc = PETSc.PC().create(PETSc.COMM_SELF)
        self._pc.setOperators(self._matrix)
        self._pc.setOptionsPrefix("mass_")
        self._pc.setType(PETSc.PC.Type.CHOLESKY)
        self._pc.setUp()
        self._right, self._left = np.zeros((count, size)), np.zeros((count, size))
        self._dense = [
            PETSc.Mat().createDense((size, count), array=held.ravel(), comm=PETSc.COMM_SELF)
            for held in (self._right, self._left)
        ]

    def solve(self, b: NDArray, into: NDArray) -> None:
        self._right[:] = b[self.place].T
        self._pc.getFactorMatrix().matSolve(*self._dense)
        into[self.place] = self._left.T

    def destroy(self) -> None:
        for item in (self._pc, self._matrix, *self._dense):
            item.destroy()
