"""The undeformed body on this rank: nodal vectors, cells, laws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.kernel.interface import Kernels, Span
from ancf_petsc.kernel.revolution import Revolution
from ancf_petsc.kernel.tables import map_functions
from ancf_petsc.material import Law
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.parallel.numbering import Numbering

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Region:
    """Cells first:last of one material; those before own_last are owned by this rank.

    kernels: compiled loops for the element and the law.
    """

    law: Law
    kernels: Kernels
    parameters: Floats
    density: float | None
    first: int
    own_last: int
    last: int

    @property
    def cells(self) -> Span:
        """All of them."""
        return Span(self.first, self.last)

    @property
    def own_cells(self) -> Span:
        """Those owned by this rank."""
        return Span(self.first, self.own_last)


@dataclass(frozen=True)
class Body:
    """v local nodal vectors (owned first), e local cells, those of one region together and its own ones first.

    origin (3,): in the file's coordinates, where the body has its own: one far away would lose digits.
    reference (v, 3): nodal vectors of the undeformed body, positions from `origin`. slots (v,): 0 for a position, j for the
    j-th slope of its node, which follows the position j places behind. Slopes are multiplied by lengths.
    tables: the cells as every kernel takes them, see `kernel/choice`; they have nodes (e, a) and volumes (e,).
    size: diagonal of the box around the body. cell_numbers: (e,) number of each cell in the mesh file. lumped: whether mass, and
    what gravity pulls at, are those of a diagonal matrix. revolution: of a body of revolution.
    """

    comm: MPI.Comm
    element: Element
    numbering: Numbering
    origin: Floats
    reference: Floats
    slots: NDArray[np.int8]
    tables: Any
    regions: tuple[Region, ...]
    size: float
    cell_numbers: NDArray[np.int64]
    lumped: bool
    revolution: Revolution | None

    @property
    def owned(self) -> int:
        """How many nodal vectors this rank owns."""
        return self.numbering.owned

    @property
    def ghost_numbers(self) -> NDArray[np.int64]:
        """Global numbers of the nodal vectors that other ranks own."""
        return self.numbering.numbers[self.owned :]

    @property
    def cells(self) -> NDArray[np.int32]:
        """(e, a) local nodal vectors of each cell."""
        return self.tables.nodes

    @property
    def volumes(self) -> Floats:
        """(e,) undeformed volumes."""
        return self.tables.volumes

    @property
    def measures(self) -> Floats:
        """(e, m) coefficients of the undeformed volume per volume of the reference cell: of 1, and of xi where cells are rings."""
        return self.volumes[:, None] if self.revolution is None else self.tables.measures

    @property
    def dof(self) -> int:
        """Degrees of freedom over all ranks, driven ones included."""
        return combined(self.comm, self.element.components * self.owned)

    @property
    def own_positions(self) -> NDArray[np.int64]:
        """The owned nodal vectors that are positions."""
        return np.flatnonzero(self.slots[: self.owned] == 0)

    def mapped(self, values: NDArray, cells: NDArray | slice = slice(None)) -> Floats:
        """Functions (e, a) of the nodal vectors of cells, all by default, from those of the reference cell (a,)."""
        return map_functions(values, self.slope_maps[cells], self.element)

    @property
    def slope_maps(self) -> Floats:
        """(e, s, 3, 3) from the slopes of the nodes of each cell to those along xi; no s without slopes."""
        return self.tables.jacobians if self.element.has_slopes else np.empty((len(self.cells), 0, 3, 3))

    def position_cells(self) -> NDArray[np.int32]:
        """(e, k) the positions of the nodes of each cell."""
        return self.cells[:, self.element.slot == 0]
