"""Forces and tangents of a model in PETSc's vectors and matrices.

Rows are complete where they are owned, so only ghost positions travel. The tangent is written straight into the arrays of
the matrix, with rows and columns of driven degrees of freedom left out and one number on their diagonal.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.algebra.graph import block_starts, neighbours
from ancf_petsc.kernel.constant import add_mass_blocks
from ancf_petsc.model.model import Model
from ancf_petsc.parallel.exchange import combined


class Rows(NamedTuple):
    """Where the matrix's values lie: by scalar rows, own columns first, from `split` on those of ghosts.

    pointers (n + 1,) and columns of 3 x 3 blocks in the rows of the n owned nodal vectors; columns are local.
    """

    own_pointers: NDArray[np.int64]
    own_columns: NDArray[np.int32]
    other_pointers: NDArray[np.int64]
    other_columns: NDArray[np.int32]
    split: int


class Assembly:
    """Evaluates a model at states x, PETSc vectors of the owned nodal vectors."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.comm = model.comm
        self.largest_diagonal = 0.0
        n = model.owned
        self._positions = model.reference.copy()
        self._second = model.reference.copy()
        self._force = np.zeros_like(model.reference)
        self._driven_bits = model.driven_bits()
        self.driven = np.flatnonzero(model.motion[:n] >= 0)
        self.driven_motion = model.motion[:n].ravel()[self.driven]
        self._ghosts = self._ghost_scatter()

    # --- vectors

    def vector(self) -> PETSc.Vec:
        """A new vector of the owned nodal vectors, zero."""
        return PETSc.Vec().createMPI((3 * self.model.owned, None), bsize=3, comm=self.comm)

    def reference_vector(self) -> PETSc.Vec:
        """The undeformed state."""
        x = self.vector()
        x.array[:] = self.model.reference[: self.model.owned].ravel()
        return x

    def local(self, x: PETSc.Vec, into: NDArray | None = None) -> NDArray:
        """Values (v, 3) of x at owned nodal vectors and ghosts; valid until the next call with the same `into`."""
        values = self._positions if into is None else into
        values[: self.model.owned] = x.array_r.reshape(-1, 3)
        if self._ghosts is not None:
            scatter, ghosts, _ = self._ghosts
            scatter.scatter(x, ghosts, addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)
            values[self.model.owned :] = ghosts.array_r.reshape(-1, 3)
        return values

    def with_ghosts(self, field: NDArray, into: NDArray) -> NDArray:
        """A field (n, 3) on owned nodal vectors with its values at ghosts, in `into` (v, 3). Collective."""
        if self._ghosts is None:
            into[:] = field
            return into
        self._ghosts[2].array[:] = field.ravel()
        return self.local(self._ghosts[2], into)

    def set_driven(self, x: PETSc.Vec, s: float) -> None:
        """Put the driven degrees of freedom of x where they belong at pseudo-time s."""
        values = np.array([motion.value(s) for motion in self.model.motions] or [0.0])
        owned = self.model.reference[: self.model.owned].ravel()
        x.array[self.driven] = owned[self.driven] + values[self.driven_motion]

    def external_force(self, s: float) -> NDArray:
        """Dead loads on the owned nodal vectors (n, 3) at pseudo-time s."""
        total = np.zeros((self.model.owned, 3))
        for load in self.model.loads:
            total += load.ramp.value(s) * load.pattern
        return total

    @cached_property
    def graph(self) -> tuple[NDArray, NDArray]:
        """Pointers (n + 1,) and columns of the owned nodal vectors that share a cell with each: owned ones, then ghosts."""
        return neighbours(self.model.cells, len(self.model.reference), self.model.owned)

    # --- forces and energies

    def internal_force(self, x: PETSc.Vec) -> tuple[NDArray, float]:
        """Q (n, 3) of the owned nodal vectors, valid until the next call, and the smallest det F of this rank's cells."""
        positions, force = self.local(x), self._force
        force[:] = 0.0
        smallest = np.inf
        for region in self.model.regions:
            found = region.kernels.internal_force(
                positions, *self.model.tables, region.parameters, region.first, region.last, force
            )
            smallest = min(smallest, found)
        return force[: self.model.owned], smallest

    def mean_force(self, x0: PETSc.Vec, x1: PETSc.Vec) -> tuple[NDArray, float]:
        """Forces (n, 3) between two states whose work is exactly the growth of the energy, and the smallest det F1."""
        before, after = self._two_states(x0, x1)
        force = self._force
        force[:] = 0.0
        smallest = np.inf
        for region in self.model.regions:
            assert region.mean_kernels is not None
            found = region.mean_kernels.force(
                before, after, *self.model.tables, region.parameters, region.first, region.last, force
            )
            smallest = min(smallest, found)
        return force[: self.model.owned], smallest

    def _two_states(self, x0: PETSc.Vec, x1: PETSc.Vec) -> tuple[NDArray, NDArray]:
        return self.local(x0, into=self._second), self.local(x1)

    def smallest_det(self, x: PETSc.Vec) -> float:
        """Smallest det F over all cells."""
        return combined(self.comm, self.internal_force(x)[1], MPI.MIN)

    def strain_energy(self, x: PETSc.Vec) -> float:
        """Strain energy of the whole body."""
        positions = self.local(x)
        own = [
            region.kernels.energy(
                positions, *self.model.tables, region.parameters, region.first, region.own_last
            )
            for region in self.model.regions
        ]
        return combined(self.comm, sum(own))

    def tangent_product(self, x: PETSc.Vec, direction: PETSc.Vec) -> NDArray:
        """The tangent at x times a direction: (n, 3) on owned nodal vectors, driven rows and columns included."""
        positions = self.local(x)
        along = self.local(direction, into=np.empty_like(positions))
        force = np.zeros_like(positions)
        for region in self.model.regions:
            region.kernels.tangent_product(
                positions, along, *self.model.tables, region.parameters, region.first, region.last, force
            )
        return force[: self.model.owned]

    def fields(self, x: PETSc.Vec) -> tuple[NDArray, NDArray, NDArray]:
        """Green-Lagrange strain (e, 9), Cauchy stress (e, 9) and det F (e,) of this rank's cells."""
        positions, e = self.local(x), len(self.model.cells)
        strain, cauchy, det = np.empty((e, 9)), np.empty((e, 9)), np.empty(e)
        for region in self.model.regions:
            region.kernels.fields(
                positions,
                *self.model.tables,
                region.parameters,
                region.first,
                region.last,
                strain,
                cauchy,
                det,
            )
        return strain, cauchy, det

    # --- the matrix

    def create_matrix(self, *, symmetric: bool = True) -> PETSc.Mat:
        """A matrix that shares its arrays with `tangent`; zero, all blocks of cells present."""
        n = self.model.owned
        pointers, columns = self.graph
        rows = np.repeat(np.arange(n), np.diff(pointers))
        own = columns < n
        parts = []
        for inside in (own, ~own):
            counts = np.bincount(rows[inside], minlength=n)
            parts.append((np.concatenate(([0], np.cumsum(counts))), columns[inside]))
        self.rows = Rows(*parts[0], *parts[1], split=9 * int(own.sum()))
        own_counts, other_counts = np.diff(self.rows.own_pointers), np.diff(self.rows.other_pointers)
        self._starts = block_starts(self.model.cells, n, *self.rows[:4], 3)
        self._strides = np.zeros((len(self.model.reference), 2), np.int32)
        self._strides[:n, 0], self._strides[:n, 1] = 3 * own_counts, 3 * other_counts
        self.values = np.zeros(9 * len(columns))  # of the matrix made last
        self._diagonal = self._diagonal_places()
        matrix = self._share()
        matrix.setBlockSize(3)  # petsc4py leaves it out where arrays are shared
        if symmetric:
            matrix.setOption(PETSc.Mat.Option.SYMMETRIC, flag=True)
            matrix.setOption(PETSc.Mat.Option.SYMMETRY_ETERNAL, flag=True)
        return matrix

    def tangent(self, x: PETSc.Vec, matrix: PETSc.Mat, add: Callable[[], None] | None = None) -> None:
        """Fill the matrix with the tangent at x, and what `add` adds to it (`add_mass`)."""
        positions, values = self.local(x), self.values
        values[:] = 0.0
        for region in self.model.regions:
            region.kernels.tangent(
                positions,
                *self.model.tables,
                region.parameters,
                region.first,
                region.last,
                self._starts,
                self._strides,
                self.rows.split,
                self._driven_bits,
                values,
            )
        if add is not None:
            add()
        self._finish(matrix)

    def mean_tangent(
        self, x0: PETSc.Vec, x1: PETSc.Vec, matrix: PETSc.Mat, add: Callable[[], None] | None = None
    ) -> None:
        """Fill the matrix with the derivative of `mean_force` with respect to x1, and what `add` adds to it."""
        before, after = self._two_states(x0, x1)
        self.values[:] = 0.0
        for region in self.model.regions:
            assert region.mean_kernels is not None
            region.mean_kernels.tangent(
                before,
                after,
                *self.model.tables,
                region.parameters,
                region.first,
                region.last,
                self._starts,
                self._strides,
                self.rows.split,
                self._driven_bits,
                self.values,
            )
        if add is not None:
            add()
        self._finish(matrix)

    def add_mass(self, mass: NDArray, factor: float) -> None:
        """Add factor times a mass, one number per entry of the graph, to the matrix that is being filled."""
        add_mass_blocks(
            *self.graph,
            mass,
            factor,
            self.rows.own_pointers,
            self.rows.other_pointers,
            self.rows.split,
            self._driven_bits,
            self.values,
        )

    def fill_mass(self, matrix: PETSc.Mat, mass: NDArray) -> None:
        """Fill the matrix with a mass; driven degrees of freedom get none."""
        self.values[:] = 0.0
        self.add_mass(mass, 1.0)
        matrix.stateIncrease()
        matrix.assemble()

    def _finish(self, matrix: PETSc.Mat) -> None:
        """One number on the diagonal of all driven degrees of freedom: the mean of the others."""
        values = self.values
        diagonal = values[self._diagonal]
        free = np.ones(len(diagonal), bool)
        free[self.driven] = False
        total, count, largest = diagonal[free].sum(), free.sum(), np.abs(diagonal[free]).max(initial=0.0)
        total, count = combined(self.comm, np.array([total, count]))
        self.largest_diagonal = combined(self.comm, largest, MPI.MAX)
        values[self._diagonal[self.driven]] = (
            total / count if count and total > 0.0 else self.largest_diagonal or 1.0
        )
        matrix.stateIncrease()
        matrix.assemble()

    def _share(self) -> PETSc.Mat:
        """PETSc's matrix on this object's array of values."""
        rows, n, total = self.rows, 3 * self.model.owned, combined(self.comm, 3 * self.model.owned)
        own = (*_scalar_rows(rows.own_pointers, rows.own_columns), self.values[: rows.split])
        sizes = ((n, total), (n, total))
        if self.comm.size == 1:
            return PETSc.Mat().createAIJWithArrays(sizes, own, comm=self.comm)
        numbers = self.model.ghost_numbers[rows.other_columns - self.model.owned]
        other = (*_scalar_rows(rows.other_pointers, numbers), self.values[rows.split :])
        return PETSc.Mat().createAIJWithArrays(sizes, (own, other), comm=self.comm)

    def _diagonal_places(self) -> NDArray:
        """Where the diagonal of each owned degree of freedom lies in the values."""
        pointers, columns = self.rows.own_pointers, self.rows.own_columns
        n = self.model.owned
        counts = np.diff(pointers)
        rows = np.repeat(np.arange(n), counts)
        slot = np.flatnonzero(columns == rows) - pointers[:-1]
        component = np.arange(3)
        start = 9 * pointers[:-1] + 3 * slot
        return (start[:, None] + component * (3 * counts[:, None] + 1)).ravel()

    def _ghost_scatter(self):
        """PETSc's scatter to the ghosts, the vector it fills and one to fill it from; None on one rank."""
        if self.comm.size == 1:
            return None
        numbers = self.model.ghost_numbers.astype(PETSc.IntType)
        ghosts = PETSc.Vec().createSeq(3 * len(numbers), bsize=3, comm=PETSc.COMM_SELF)
        source = PETSc.IS().createBlock(3, numbers, comm=PETSc.COMM_SELF)
        x = self.vector()
        scatter = PETSc.Scatter().create(x, source, ghosts, None)
        return scatter, ghosts, x


def _scalar_rows(pointers: NDArray, columns: NDArray) -> tuple[NDArray, NDArray]:
    """Pointers and columns of the scalar rows of a matrix of 3 x 3 blocks, in PETSc's integers."""
    counts = np.diff(pointers)
    scalar_pointers = np.concatenate(([0], np.cumsum(np.repeat(3 * counts, 3))))
    scalar = (3 * columns[:, None].astype(np.int64) + np.arange(3)).ravel()
    starts = np.repeat(3 * pointers[:-1], 3)
    lengths = np.repeat(3 * counts, 3)
    within = np.arange(scalar_pointers[-1]) - np.repeat(scalar_pointers[:-1], lengths)
    return scalar_pointers.astype(PETSc.IntType), scalar[np.repeat(starts, lengths) + within].astype(
        PETSc.IntType
    )
