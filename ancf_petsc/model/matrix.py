"""Sparse matrices over the nodal vectors, filled where PETSc keeps their numbers.

A `Layout` says where the numbers lie, for all matrices of a body. A `Matrix` has the numbers and PETSc's matrix on them, from the
moment it is made: it is cleared, kernels and masses are added, then it is finished. Rows and columns of driven degrees of
freedom are left out by what is added; `finish` puts one number on their diagonal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.algebra.graph import block_starts
from ancf_petsc.kernel.constant import add_mass_blocks
from ancf_petsc.kernel.interface import Target
from ancf_petsc.model.frames import TurnedBlocks
from ancf_petsc.model.model import Model
from ancf_petsc.parallel.exchange import combined

Integers = NDArray[np.int64]


class Rows(NamedTuple):
    """Where the values lie: by scalar rows, own columns first, from `split` on those of ghosts.

    pointers (n + 1,) and columns of 3 x 3 blocks in the rows of the n owned nodal vectors; columns are local.
    """

    own_pointers: Integers
    own_columns: NDArray[np.int32]
    other_pointers: Integers
    other_columns: NDArray[np.int32]
    split: int


class Layout:
    """Places of 3 x 3 blocks for the pairs of a graph, which holds at least all pairs of nodal vectors of a cell.

    graph: pointers (n + 1,) and columns of the n owned rows, owned columns before those of ghosts in every row. starts: first
    place of each pair of each cell, strides (v, 2): length of the scalar rows of each nodal vector, as kernels take them. driven:
    owned degrees of freedom, flat. diagonal (3 n,): place of the diagonal of each owned degree of freedom.
    """

    def __init__(self, model: Model, graph: tuple[NDArray, NDArray]) -> None:
        self.model, self.graph = model, graph
        n, (pointers, columns) = model.owned, graph
        rows, own = np.repeat(np.arange(n), np.diff(pointers)), columns < n
        parts = []
        for inside in (own, ~own):
            counts = np.bincount(rows[inside], minlength=n)
            parts.append((np.concatenate(([0], np.cumsum(counts))), columns[inside]))
        self.rows = Rows(*parts[0], *parts[1], split=9 * int(own.sum()))
        self.size = 9 * len(columns)
        self.starts = block_starts(model.cells, n, *self.rows[:4], 3)
        self.strides = np.zeros((len(model.reference), 2), np.int32)
        self.strides[:n, 0] = 3 * np.diff(self.rows.own_pointers)
        self.strides[:n, 1] = 3 * np.diff(self.rows.other_pointers)
        self.driven_bits = model.driven_bits()
        self.driven = np.flatnonzero(model.drive[:n] >= 0)
        self.diagonal = self._diagonal()
        self.turned = TurnedBlocks(model.frames, self._blocks(), model.drive >= 0) if model.frames else None

    def _blocks(self) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Rows, columns, first places and strides (b,) of all blocks, columns of local nodal vectors."""
        parts = []
        for side, (pointers, columns) in enumerate((self.rows[:2], self.rows[2:4])):
            counts = np.diff(pointers)
            rows = np.repeat(np.arange(len(counts)), counts)
            within = np.arange(len(columns)) - pointers[rows]
            starts = side * self.rows.split + 9 * pointers[rows] + 3 * within
            parts.append((rows, columns, starts, 3 * counts[rows]))
        rows, columns, starts, strides = (np.concatenate(both) for both in zip(*parts, strict=True))
        return rows, columns, starts, strides

    def _diagonal(self) -> Integers:
        pointers, columns = self.rows.own_pointers, self.rows.own_columns
        counts = np.diff(pointers)
        rows = np.repeat(np.arange(len(counts)), counts)
        slot = np.flatnonzero(columns == rows) - pointers[:-1]
        start: Integers = 9 * pointers[:-1] + 3 * slot
        return (start[:, None] + np.arange(3) * (3 * counts[:, None] + 1)).ravel()


class Matrix:
    """Numbers in a layout. values: all of this rank's. mat: PETSc's matrix, which shares them.

    largest_diagonal: over all ranks, when it was last finished; 0 before.
    """

    def __init__(self, layout: Layout, *, symmetric: bool = True) -> None:
        self.layout, self.symmetric = layout, symmetric
        self.comm = layout.model.comm
        self.values = np.zeros(layout.size)
        self.largest_diagonal = 0.0
        self._added: NDArray | None = None
        self.mat = self._share()
        self.mat.setBlockSize(3)  # petsc4py leaves it out where arrays are shared
        if symmetric:
            self.mat.setOption(PETSc.Mat.Option.SYMMETRIC, flag=True)
            self.mat.setOption(PETSc.Mat.Option.SYMMETRY_ETERNAL, flag=True)

    @property
    def target(self) -> Target:
        """What a kernel takes to add to the matrix."""
        layout = self.layout
        return Target(layout.starts, layout.strides, layout.rows.split, layout.driven_bits, self.values)

    def clear(self) -> None:
        """Begin anew: all numbers are zero."""
        self.values[:] = 0.0
        self._added = None

    def add_mass(self, mass: NDArray, factor: float) -> None:
        """Add factor times a mass, one number per entry of the layout's graph; driven degrees of freedom get none."""
        rows = self.layout.rows
        places = (rows.own_pointers, rows.other_pointers, rows.split, self.layout.driven_bits)
        add_mass_blocks(self.layout.graph, mass, factor, places, self.values)

    def add_diagonal(self, diagonal: NDArray) -> None:
        """Add numbers (3 n,) to the diagonal of the owned degrees of freedom, when the matrix is finished."""
        self._added = diagonal if self._added is None else self._added + diagonal

    def finish(self) -> None:
        """Put one number on the diagonal of all driven degrees of freedom, the mean of the others. Collective."""
        places, driven = self.layout.diagonal, self.layout.driven
        self._turn()
        diagonal = self.values[places]
        free = np.ones(len(diagonal), bool)
        free[driven] = False
        total, count, largest = diagonal[free].sum(), free.sum(), np.abs(diagonal[free]).max(initial=0.0)
        total, count = combined(self.comm, np.array([total, count]))
        self.largest_diagonal = combined(self.comm, largest, MPI.MAX)
        mean = total / count if count and total > 0.0 else self.largest_diagonal or 1.0
        self.values[places[driven]] = mean
        self._show()

    def close(self) -> None:
        """Finish, but leave the diagonal of driven degrees of freedom empty. Collective."""
        self._turn()
        self._show()

    def _turn(self) -> None:
        """Blocks along the axes become those of degrees of freedom."""
        if self.layout.turned is not None:
            self.layout.turned.turn(self.values)
        if self._added is not None:
            self.values[self.layout.diagonal] += self._added
            self._added = None

    def _show(self) -> None:
        """Let PETSc see the numbers. Collective."""
        self.mat.stateIncrease()
        self.mat.assemble()

    def destroy(self) -> None:
        """Free PETSc's matrix."""
        self.mat.destroy()

    def _share(self) -> PETSc.Mat:
        """PETSc's matrix on this object's array of values."""
        rows, model = self.layout.rows, self.layout.model
        n, total = 3 * model.owned, combined(self.comm, 3 * model.owned)
        own = (*_scalar_rows(rows.own_pointers, rows.own_columns), self.values[: rows.split])
        sizes = ((n, total), (n, total))
        if self.comm.size == 1:
            return PETSc.Mat().createAIJWithArrays(sizes, own, comm=self.comm)
        numbers = model.ghost_numbers[rows.other_columns - model.owned]
        other = (*_scalar_rows(rows.other_pointers, numbers), self.values[rows.split :])
        return PETSc.Mat().createAIJWithArrays(sizes, (own, other), comm=self.comm)


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
