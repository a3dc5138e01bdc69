"""Distributed nodes and cells: owned first, ghosts after, renumbered for locality."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.algebra.graph import neighbours
from ancf_petsc.parallel.exchange import exchange, first_of_each_rank, lookup
from ancf_petsc.parallel.partition import partition_nodes
from ancf_petsc.parallel.slabs import slab_bounds


@dataclass(frozen=True)
class Numbering:
    """The nodes and cells of one rank.

    file_nodes: (n,) number, in the table on the root rank, of each local node: owned first, ghosts after.
    owned: how many are owned.
    numbers: (n,) global number of each local node; owned ones are contiguous, ghosts ascend.
    cells: (e, k) local nodes of the cells that touch an owned node, sorted by lowest node.
    file_cells: (e,) number, in the table on the root rank, of each cell.
    own_cells: (e,) whether this rank owns the cell: it owns the node with the lowest global number.
    """

    comm: MPI.Comm
    file_nodes: NDArray[np.int64]
    owned: int
    numbers: NDArray[np.int64]
    cells: NDArray[np.int32]
    file_cells: NDArray[np.int64]
    own_cells: NDArray[np.bool_]

    def with_cell_order(self, order: NDArray) -> Numbering:
        """The same with the cells in another order."""
        return replace(
            self,
            cells=np.ascontiguousarray(self.cells[order]),
            file_cells=self.file_cells[order],
            own_cells=self.own_cells[order],
        )


def with_vectors(nodes: Numbering, first: NDArray, node: NDArray, slot: NDArray) -> Numbering:
    """The numbering of the nodal vectors of distributed nodes, several a node. Collective.

    first: (n, 2) first vector and number of vectors of each local node, in the table on the root rank. node, slot (a,): of each
    vector of a cell. The vectors of a node follow each other; those of owned nodes come first.
    """
    comm = nodes.comm
    starts, counts = first.T
    owned = int(counts[: nodes.owned].sum())
    begin = int(comm.scan(owned) - owned)
    local = np.concatenate(([0], np.cumsum(counts)))
    own_numbers = begin + local[: nodes.owned]
    bounds = np.concatenate(([0], np.cumsum(comm.allgather(nodes.owned))))
    numbers = lookup(comm, bounds, own_numbers, nodes.numbers)
    within = np.arange(local[-1]) - np.repeat(local[:-1], counts)
    return replace(
        nodes,
        file_nodes=np.repeat(starts, counts) + within,
        owned=owned,
        numbers=np.repeat(numbers, counts) + within,
        cells=np.ascontiguousarray(local[nodes.cells[:, node]] + slot, dtype=np.int32),
    )


def distribute(comm: MPI.Comm, cells: NDArray, total: int, parts: NDArray | None = None) -> Numbering:
    """Divide `total` nodes between the ranks, given this rank's slab of the cells (e, k). Collective.

    parts: this rank's slab of the ranks of the nodes, where they are known.
    """
    bounds = slab_bounds(total, comm.size)
    parts = partition_nodes(comm, cells, total) if parts is None else parts
    cells, file_cells = _send_cells(
        comm, cells, lookup(comm, bounds, parts, cells.ravel()).reshape(cells.shape)
    )
    own_nodes, _ = exchange(comm, parts, np.arange(bounds[comm.rank], bounds[comm.rank + 1]), parts)
    own_nodes = own_nodes[_locality_order(own_nodes, cells)]
    return _number(comm, own_nodes, cells, file_cells, bounds)


def _send_cells(comm: MPI.Comm, cells: NDArray, parts: NDArray) -> tuple[NDArray, NDArray]:
    """Every cell to each rank that owns one of its nodes. parts: (e, k) rank of each node."""
    count = np.array(len(cells))
    start = int(comm.scan(int(count)) - count)
    e, a = first_of_each_rank(parts)
    received = exchange(comm, parts[e, a], cells[e], e + start)
    return received[0], received[1]


def _locality_order(own_nodes: NDArray, cells: NDArray) -> NDArray:
    """Reverse Cuthill-McKee order of own nodes, by PETSc, on the graph within this rank."""
    n = len(own_nodes)
    if n == 0:
        return np.empty(0, np.int64)
    sorter = np.argsort(own_nodes)
    place = np.searchsorted(own_nodes, cells, sorter=sorter)
    local = sorter[np.minimum(place, n - 1)]
    foreign = own_nodes[local] != cells
    local[foreign] = n
    pointers, columns = neighbours(local.astype(np.int32), n + 1, n)
    inside = columns < n
    rows = np.repeat(np.arange(n), np.diff(pointers))[inside]
    pointers = np.concatenate(([0], np.cumsum(np.bincount(rows, minlength=n)))).astype(PETSc.IntType)
    columns = columns[inside].astype(PETSc.IntType)
    graph = PETSc.Mat().createAIJ(
        (n, n), csr=(pointers, columns, np.ones(len(columns))), comm=PETSc.COMM_SELF
    )
    row_order, column_order = graph.getOrdering("rcm")
    order = row_order.getIndices().astype(np.int64)
    for item in (row_order, column_order, graph):
        item.destroy()
    return order


def _number(
    comm: MPI.Comm, own_nodes: NDArray, cells: NDArray, file_cells: NDArray, bounds: NDArray
) -> Numbering:
    """Number own nodes in the order given, ghosts by ascending global number, cells by lowest node."""
    owned = len(own_nodes)
    start = int(comm.scan(owned) - owned)
    new_numbers = _answer_slabs(comm, own_nodes, np.arange(start, start + owned), bounds)
    numbers_of_cells = lookup(comm, bounds, new_numbers, cells.ravel()).reshape(cells.shape)
    is_own = (numbers_of_cells >= start) & (numbers_of_cells < start + owned)
    ghosts, where = np.unique(numbers_of_cells[~is_own], return_index=True)
    ghost_nodes = cells[~is_own][where]
    local = np.empty(cells.shape, np.int32)
    local[is_own] = numbers_of_cells[is_own] - start
    local[~is_own] = owned + np.searchsorted(ghosts, numbers_of_cells[~is_own])
    order = np.lexsort((file_cells, local.min(axis=1))) if len(local) else np.empty(0, np.int64)
    lowest = numbers_of_cells.min(axis=1)[order] if len(local) else np.empty(0, np.int64)
    return Numbering(
        comm=comm,
        file_nodes=np.concatenate((own_nodes, ghost_nodes)),
        owned=owned,
        numbers=np.concatenate((np.arange(start, start + owned), ghosts)),
        cells=np.ascontiguousarray(local[order]),
        file_cells=file_cells[order],
        own_cells=(lowest >= start) & (lowest < start + owned),
    )


def _answer_slabs(comm: MPI.Comm, rows: NDArray, values: NDArray, bounds: NDArray) -> NDArray:
    """This rank's slab of a table whose rows are given by the ranks that know them."""
    owner = np.searchsorted(bounds, rows, side="right") - 1
    got_rows, got_values = exchange(comm, owner, rows, values)
    slab = np.empty(bounds[comm.rank + 1] - bounds[comm.rank], values.dtype)
    slab[got_rows - bounds[comm.rank]] = got_values
    return slab
