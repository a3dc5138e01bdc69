"""Values that ranks have of their part of the body, as tables that hang on no number of ranks: in the order of the mesh file.

What a run needs to go on is made of them: `state()` of whatever carries something from step to step gives a tree of plain
values, arrays that are the same on all ranks, and Fields; `restore(state)` takes it back, on any number of ranks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.parallel.exchange import ToSlabs, combined, lookup
from ancf_petsc.parallel.numbering import Numbering
from ancf_petsc.parallel.slabs import slab_bounds

VECTORS, CELLS = "vectors", "cells"


@dataclass(frozen=True)
class Field:
    """One row for each owned nodal vector (n, ...), or for each local cell (e, ...), those of other ranks included."""

    rows: NDArray[np.float64]
    of: str = VECTORS


def field(x: PETSc.Vec | NDArray) -> Field:
    """A copy of a vector of the owned nodal vectors, (n, 3)."""
    values = x if isinstance(x, np.ndarray) else x.array_r
    return Field(values.reshape(-1, 3).copy())


class Places:
    """Where this rank's rows stand in tables of all nodal vectors and cells in the file's order. Calls are collective."""

    def __init__(self, comm: MPI.Comm, numbering: Numbering) -> None:
        self.comm = comm
        own = np.flatnonzero(numbering.own_cells)
        self._rows = {VECTORS: numbering.file_nodes[: numbering.owned], CELLS: numbering.file_cells}
        self.totals = {
            VECTORS: int(combined(comm, numbering.owned)),
            CELLS: int(combined(comm, len(own))),
        }
        self._to_slabs = {
            VECTORS: ToSlabs(comm, self._rows[VECTORS], self.totals[VECTORS]),
            CELLS: ToSlabs(comm, numbering.file_cells[own], self.totals[CELLS], of=own),
        }

    def owners(self) -> Field:
        """The rank that owns each nodal vector, (n, 1): dividing a mesh again need not give the same parts."""
        return Field(np.full((len(self._rows[VECTORS]), 1), float(self.comm.rank)))

    def shape(self, field: Field) -> tuple[int, ...]:
        """Of the whole table."""
        return self.totals[field.of], *field.rows.shape[1:]

    def slabs(self, field: Field) -> Iterator[NDArray]:
        """The table, slab after slab on the root rank; the others send theirs and get none."""
        bounds = slab_bounds(self.totals[field.of], self.comm.size)
        mine = np.zeros((bounds[self.comm.rank + 1] - bounds[self.comm.rank], *field.rows.shape[1:]))
        slab = self._to_slabs[field.of](field.rows, mine)
        if self.comm.rank:
            self.comm.Send(slab, 0)
            return
        yield slab
        for rank in range(1, self.comm.size):
            rows = np.empty((bounds[rank + 1] - bounds[rank], *slab.shape[1:]))
            self.comm.Recv(rows, rank)
            yield rows

    def rows(self, of: str, shape: tuple[int, ...], slabs: Iterator[NDArray]) -> NDArray:
        """This rank's rows of a table of `shape`, which the root rank has slab after slab, as `bounds` divides it."""
        bounds = self.bounds(of)
        if self.comm.rank == 0:
            mine = next(slabs)
            for rank in range(1, self.comm.size):
                self.comm.Send(np.ascontiguousarray(next(slabs)), rank)
        else:
            mine = np.empty((bounds[self.comm.rank + 1] - bounds[self.comm.rank], *shape[1:]))
            self.comm.Recv(mine, 0)
        return lookup(self.comm, bounds, mine, self._rows[of])

    def bounds(self, of: str) -> NDArray[np.int64]:
        """Of the slabs."""
        return slab_bounds(self.totals[of], self.comm.size)
