"""Which rank owns which node: PETSc's partitioners on the graph of nodes that share a cell."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.algebra.graph import neighbours
from ancf_petsc.parallel.exchange import exchange, first_of_each_rank
from ancf_petsc.parallel.slabs import slab_bounds


def partition_nodes(comm: MPI.Comm, cells: NDArray, total: int) -> NDArray[np.int64]:
    """The rank of each node of this rank's slab of nodes, from this rank's slab of cells (e, k). Collective.

    total: number of nodes, all of them used by cells.
    """
    bounds = slab_bounds(total, comm.size)
    rows = int(bounds[comm.rank + 1] - bounds[comm.rank])
    if comm.size == 1:
        return np.zeros(rows, np.int64)
    pointers, columns = _graph_of_slab(comm, cells, bounds)
    ones = np.ones(len(columns))
    graph = PETSc.Mat().createAIJ(((rows, total), (rows, total)), csr=(pointers, columns, ones), comm=comm)
    divider = PETSc.MatPartitioning().create(comm)
    divider.setAdjacency(graph)
    divider.setOptionsPrefix("partition_")
    divider.setFromOptions()
    parts = PETSc.IS().create(comm)
    divider.apply(parts)
    result = parts.getIndices().astype(np.int64)
    for item in (parts, divider, graph):
        item.destroy()
    return result


def _graph_of_slab(comm: MPI.Comm, cells: NDArray, bounds: NDArray) -> tuple[NDArray, NDArray]:
    """Rows of the node graph for this rank's slab, as pointers and global columns without the diagonal."""
    owner = np.searchsorted(bounds, cells, side="right") - 1
    e, a = first_of_each_rank(owner)
    (mine,) = exchange(comm, owner[e, a], cells[e])
    low, high = bounds[comm.rank], bounds[comm.rank + 1]
    own = np.arange(low, high)
    others = np.unique(mine[(mine < low) | (mine >= high)])
    numbers = np.concatenate((own, others))
    order = np.argsort(numbers)
    local = order[np.searchsorted(numbers[order], mine)].astype(np.int32)
    pointers, columns = neighbours(local, len(numbers), len(own))
    rows = np.repeat(np.arange(len(own)), np.diff(pointers))
    off = columns != rows
    counts = np.bincount(rows[off], minlength=len(own))
    pointers = np.concatenate(([0], np.cumsum(counts))).astype(PETSc.IntType)
    columns = numbers[columns[off]]
    by_column = np.lexsort((columns, rows[off]))
    return pointers, columns[by_column].astype(PETSc.IntType)
