"""Parts of a body that move as rigid ones: the coarse space of a preconditioner of two levels.

R. A. Nicolaides, Deflation of conjugate gradients with applications to boundary value problems, SIAM J. Numer. Anal.
24 (1987) 355, with the rigid motions in place of constants.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.algebra.coarse import add_coarse_matrix, add_motion, restrict
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.linear.half import HalfMatrix

MOST_PARTS = 128  # over all ranks: every rank inverts the coarse matrix, of six times as many rows
DENSITY = 0.5  # parts over the square root of nodes
Floats = NDArray[np.float64]


class RigidParts:
    """Divides the body into parts, and solves for their motions. Every method is collective."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly, model = assembly, assembly.model
        comm, own, slots = model.comm, model.own_positions, model.slots
        total = combined(comm, len(own))
        wanted = min(MOST_PARTS, DENSITY * sqrt(total)) * len(own) / total
        mine = min(max(1, round(wanted)), len(own))
        before = int(comm.scan(mine) - mine)
        self.count = int(combined(comm, mine))
        labels = np.zeros(model.owned)
        labels[own] = before + bisected(model.reference[own], mine)
        labels = labels[np.arange(model.owned) - slots[: model.owned]]
        field = np.repeat(labels[:, None], 3, axis=1)
        self._part = assembly.with_ghosts(field, np.empty_like(model.reference))[:, 0].astype(np.int64)
        self._free = (model.drive < 0).astype(float)
        self._free[model.frames.vectors] = (
            0.0  # their components are not those of the motions: they are left to the factors
        )
        self._shifts = (slots == 0).astype(float)
        self._arms = np.empty_like(model.reference)
        self._inverse = np.zeros((6 * self.count, 6 * self.count), np.float32)
        self._coarse = np.empty(6 * self.count)

    def fill(self, matrix: HalfMatrix, positions: Floats) -> None:
        """Take the stiffness of the parts at local positions (v, 3), those of ghosts included."""
        model, comm = self.assembly.model, self.assembly.comm
        own = model.own_positions
        sums = [np.bincount(self._part[own], positions[own, i], self.count) for i in range(3)]
        counts = np.bincount(self._part[own], minlength=self.count)
        total = combined(comm, np.array([*sums, counts], float))
        centres = (total[:3] / total[3]).T
        self._arms[:] = (positions - self._shifts[:, None] * centres[self._part]) / model.size
        stiffness = np.zeros((6 * self.count, 6 * self.count))
        add_coarse_matrix(matrix.half, matrix.ghosts, *self._motions, stiffness)
        self._inverse[:] = inverse(combined(comm, stiffness))

    def add_correction(self, r: Floats, z: Floats) -> None:
        """Add to z (n, 3) the motions that forces r (n, 3) make of the parts."""
        n = self.assembly.model.owned
        restrict(*self._motions, n, r, self._coarse)
        if self.assembly.comm.size > 1:
            self.assembly.comm.Allreduce(MPI.IN_PLACE, self._coarse)
        add_motion(*self._motions, n, (self._inverse @ self._coarse.astype(np.float32)).astype(float), z)

    @property
    def _motions(self) -> tuple[NDArray, Floats, Floats, Floats]:
        return self._part, self._arms, self._shifts, self._free


def bisected(points: Floats, parts: int) -> NDArray[np.int64]:
    """Labels (n,) of as many parts of points (n, 3), equal in number, halved along their longest side."""
    labels = np.zeros(len(points), np.int64)
    waiting = [(np.arange(len(points)), 0, parts)] if parts else []
    while waiting:
        chosen, first, count = waiting.pop()
        if count == 1:
            labels[chosen] = first
            continue
        axis = int(np.argmax(np.ptp(points[chosen], axis=0)))
        half = count // 2
        cut = len(chosen) * half // count
        order = chosen[np.argpartition(points[chosen, axis], cut)]
        waiting += [(order[:cut], first, half), (order[cut:], first + half, count - half)]
    return labels


def inverse(stiffness: Floats) -> Floats:
    """Of a positive definite matrix whose empty rows stay empty; zero, no motion, where it is not definite."""
    diagonal = stiffness.diagonal()
    held = diagonal <= 1e-12 * diagonal.max(initial=0.0)
    filled = stiffness + np.diag(np.where(held, 1.0, 0.0))
    filled[held], filled[:, held] = 0.0, 0.0
    filled[held, held] = 1.0
    try:
        np.linalg.cholesky(filled)
    except np.linalg.LinAlgError:
        return np.zeros_like(filled)
    found = np.linalg.inv(filled)
    found[held] = 0.0
    return found
