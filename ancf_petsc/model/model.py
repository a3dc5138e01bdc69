"""The discrete body on this rank: nodal vectors, cells, laws, supports and loads."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.kernel.mean import MeanKernels
from ancf_petsc.kernel.tables import turn_functions
from ancf_petsc.kernel.tet3413 import Kernels
from ancf_petsc.material import Law
from ancf_petsc.model.constraint import Drive
from ancf_petsc.model.load import Load
from ancf_petsc.parallel.exchange import combined, lookup, scatter_rows
from ancf_petsc.parallel.numbering import Numbering
from ancf_petsc.parallel.slabs import slab_bounds


@dataclass(frozen=True)
class Region:
    """Cells first:last of one material; those before own_last are owned by this rank.

    kernels, mean_kernels: compiled loops for the element and the law; the latter keep energy, where there are such.
    """

    law: Law
    kernels: Kernels
    mean_kernels: MeanKernels | None
    parameters: NDArray[np.float64]
    density: float | None
    first: int
    own_last: int
    last: int


@dataclass
class Model:
    """What a solver needs to know of the body. v local nodal vectors (owned first), e local cells.

    reference (v, 3): nodal vectors of the undeformed body. slots (v,): 0 for a position, j for the j-th slope of its node, which
    follows the position j places behind. Slopes are multiplied by lengths.
    tables: arrays of the cells that every kernel takes; the first is cells (e, a), the third volumes (e,).
    drive (v, 3): index into drives of driven degrees of freedom, -1 where free.
    size: diagonal of the box around the body.
    cell_numbers: (e,) number of each cell in the mesh file.
    groups: name -> owned nodal vectors of its nodes (positions).
    means: name -> (owned nodal vectors, weights): weighted means of positions over all ranks.
    """

    comm: MPI.Comm
    element: Element
    numbering: Numbering
    owned: int
    start: int
    ghost_numbers: NDArray[np.int64]
    reference: NDArray[np.float64]
    slots: NDArray[np.int8]
    tables: tuple
    regions: list[Region]
    drive: NDArray[np.int32]
    drives: list[Drive]
    size: float
    cell_numbers: NDArray[np.int64]
    loads: list[Load] = field(default_factory=list)
    groups: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    means: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]] = field(default_factory=dict)

    @property
    def cells(self) -> NDArray[np.int32]:
        """(e, a) local nodal vectors of each cell."""
        return self.tables[0]

    @property
    def volumes(self) -> NDArray[np.float64]:
        """(e,) undeformed volumes."""
        return self.tables[2]

    @property
    def dof(self) -> int:
        """Degrees of freedom over all ranks, driven ones included."""
        return combined(self.comm, self.element.components * self.owned)

    @property
    def own_positions(self) -> NDArray[np.int64]:
        """The owned nodal vectors that are positions."""
        return np.flatnonzero(self.slots[: self.owned] == 0)

    def turned(self, values: NDArray) -> NDArray[np.float64]:
        """Functions (e, a) of the nodal vectors of all cells from those of the reference cell (a,)."""
        return turn_functions(values, self.slope_maps, self.element)

    @property
    def slope_maps(self) -> NDArray[np.float64]:
        """(e, s, 3, 3) from the slopes of the nodes of each cell to those along xi; no s without slopes."""
        return self.tables[1].jacobians if self.element.has_slopes else np.empty((len(self.cells), 0, 3, 3))

    def position_cells(self) -> NDArray[np.int32]:
        """(e, k) the positions of the nodes of each cell."""
        return self.cells[:, self.element.slot == 0]

    def driven_bits(self) -> NDArray[np.uint8]:
        """(v,) bit i is set where component i of the nodal vector is driven, bit 3 where another rank owns it."""
        bits = ((self.drive >= 0) << np.arange(3)).sum(axis=1).astype(np.uint8)
        bits[self.owned :] |= 8
        return bits


def local_rows(numbering: Numbering, table: NDArray | None, total: int) -> NDArray:
    """Rows of a table over all nodes, which the root rank holds, for the local nodes of this rank. Collective."""
    slab = scatter_rows(numbering.comm, table)
    bounds = slab_bounds(total, numbering.comm.size)
    return lookup(numbering.comm, bounds, slab, numbering.file_nodes)
