"""Rows that travel between ranks. All functions are collective."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.parallel.slabs import slab_bounds

T = TypeVar("T")
PATIENCE = 3.0
"""Seconds that other ranks have to meet the error of one."""


def combined(comm: MPI.Comm, value: T, op: MPI.Op = MPI.SUM) -> T:
    """The sum (or what `op` says) of the values of all ranks: numbers or arrays. One rank's costs nothing."""
    if comm.size == 1:
        return value
    given = np.array(value)
    if given.dtype != float:
        return comm.allreduce(value, op)
    total = np.empty_like(given)
    comm.Allreduce(given, total, op)
    return total if given.ndim else type(value)(total)  # type: ignore[call-arg, return-value]


def on_root(comm: MPI.Comm, work: Callable[[], T]) -> T | None:
    """Do `work` on the root rank; an exception there is raised on every rank. Others get None."""
    result, failure = None, None
    if comm.rank == 0:
        try:
            result = work()
        except Exception as error:  # every rank has to hear of it, whatever it is
            failure = _portable(error)
            failure.__traceback__ = error.__traceback__
    known = comm.bcast(failure, root=0) if comm.size > 1 else failure
    if known is not None:
        raise failure or known
    return result


def agree(comm: MPI.Comm, work: Callable[[], T]) -> T:
    """Do `work` on every rank; if it fails on one, the first failing rank's exception is raised on all."""
    result, failure = None, None
    try:
        result = work()
    except Exception as error:  # every rank has to hear of it, whatever it is
        failure = _portable(error)
    first = next((f for f in comm.allgather(failure) if f is not None), None)
    if first is not None:
        raise failure or first
    return result  # type: ignore[return-value]


def all_meet(comm: MPI.Comm) -> bool:
    """Whether all ranks come here within PATIENCE: errors of this program are raised on all of them, and one that is not leaves
    the others waiting elsewhere.
    """
    if comm.size == 1:
        return True
    request, end = comm.Ibarrier(), time.monotonic() + PATIENCE
    while not request.Test():
        if time.monotonic() > end:
            return False
        time.sleep(0.001)
    return True


def _portable(error: Exception) -> Exception:
    """The error itself if it can travel, else one that says the same."""
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301  made in this line; mpi4py sends it the same way
    except Exception:  # pickling fails in many ways
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


def exchange(comm: MPI.Comm, destination: NDArray, *columns: NDArray) -> tuple[NDArray, ...]:
    """Send row k of every column to rank destination[k].

    Returns the rows received, one array a column, ordered by sender and, for one sender, as sent.
    """
    if comm.size == 1:
        return columns
    order = np.argsort(destination, kind="stable")
    sent = np.bincount(destination, minlength=comm.size).astype(np.int64)
    received = np.empty_like(sent)
    comm.Alltoall(sent, received)
    return tuple(_alltoall(comm, column[order], sent, received) for column in columns)


def _alltoall(comm: MPI.Comm, rows: NDArray, sent: NDArray, received: NDArray) -> NDArray:
    """Rows, ordered by destination, with `sent` rows for each rank and `received` rows from each."""
    rows = np.ascontiguousarray(rows)
    result = np.empty((int(received.sum()), *rows.shape[1:]), rows.dtype)
    width = int(np.prod(rows.shape[1:], dtype=np.int64)) * rows.itemsize
    row_type = MPI.BYTE.Create_contiguous(max(width, 1)).Commit()
    starts = [np.concatenate(([0], np.cumsum(counts)[:-1])) for counts in (sent, received)]
    comm.Alltoallv([rows, (sent, starts[0]), row_type], [result, (received, starts[1]), row_type])
    row_type.Free()
    return result


def scatter_rows(comm: MPI.Comm, table: NDArray | None) -> NDArray:
    """The slab of this rank of a table that only the root rank has."""
    shape, dtype = comm.bcast((table.shape, table.dtype) if table is not None else None, root=0)
    if comm.size == 1:
        return table  # type: ignore[return-value]
    bounds = slab_bounds(shape[0], comm.size)
    destination = (
        np.repeat(np.arange(comm.size), np.diff(bounds)) if comm.rank == 0 else np.empty(0, np.int64)
    )
    rows = np.empty((0, *shape[1:]), dtype) if table is None else table
    return exchange(comm, destination, rows)[0]


def lookup(comm: MPI.Comm, bounds: NDArray, slab: NDArray, rows: NDArray) -> NDArray:
    """Rows `rows` (global numbers) of a table of which every rank holds the slab bounds[rank]:bounds[rank + 1]."""
    if comm.size == 1:
        return slab[rows]
    owner = np.searchsorted(bounds, rows, side="right") - 1
    order = np.argsort(owner, kind="stable")
    asked = np.bincount(owner, minlength=comm.size).astype(np.int64)
    wanted = np.empty_like(asked)
    comm.Alltoall(asked, wanted)
    questions = _alltoall(comm, rows[order].astype(np.int64), asked, wanted)
    answers = _alltoall(comm, slab[questions - bounds[comm.rank]], wanted, asked)
    result = np.empty_like(answers)
    result[order] = answers
    return result


def first_of_each_rank(ranks: NDArray) -> tuple[NDArray, NDArray]:
    """Rows and columns of ranks (e, k) where a rank stands for the first time in its row: where to send each row."""
    first = np.ones(ranks.shape, bool)
    for column in range(1, ranks.shape[1]):
        first[:, column] = (ranks[:, column : column + 1] != ranks[:, :column]).all(axis=1)
    return np.nonzero(first)  # type: ignore[return-value]


class ToSlabs:
    """Carries rows of this rank to the slabs of a global table, by a plan made once.

    rows: (k,) global row each local row goes to; every global row is given by at most one rank.
    total: rows of the global table. of: (k,) the local rows that travel where they are not all.
    """

    def __init__(self, comm: MPI.Comm, rows: NDArray, total: int, of: NDArray | None = None) -> None:
        self.comm = comm
        self.bounds = slab_bounds(total, comm.size)
        owner = np.searchsorted(self.bounds, rows, side="right") - 1
        self._order = np.argsort(owner, kind="stable")
        self._sent = np.bincount(owner, minlength=comm.size).astype(np.int64)
        self._received = np.empty_like(self._sent)
        comm.Alltoall(self._sent, self._received)
        targets = _alltoall(comm, rows[self._order].astype(np.int64), self._sent, self._received)
        self._targets = targets - self.bounds[comm.rank]
        if of is not None:
            self._order = of[self._order]

    def __call__(self, values: NDArray, into: NDArray) -> NDArray:
        """Put local `values` (k or more, ...) into the slab `into` (rows of the slab, ...), which is returned."""
        if self.comm.size == 1:
            into[self._targets] = values[self._order]
            return into
        into[self._targets] = _alltoall(self.comm, values[self._order], self._sent, self._received)
        return into
