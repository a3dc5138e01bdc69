"""What the machine can do: copying memory, and gathering from nodes and scattering to them over a mesh."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.jit import kernel

COPIED = 2**24  # doubles in an array to copy, 128 MB: no cache holds it


@kernel
def copy(source, into):
    """Copy an array (n,)."""
    for i in range(source.shape[0]):
        into[i] = source[i]


@kernel
def gather_scatter(positions, cells, force):
    """Read positions (v, 3) of a cell's nodes, add their sum to force (v, 3): a residual unreckoned."""
    for e in range(cells.shape[0]):
        x = y = z = 0.0
        for a in range(cells.shape[1]):
            n = cells[e, a]
            x += positions[n, 0]
            y += positions[n, 1]
            z += positions[n, 2]
        for a in range(cells.shape[1]):
            n = cells[e, a]
            force[n, 0] += x
            force[n, 1] += y
            force[n, 2] += z


def timed(comm: MPI.Comm, work: Callable[[], object], repetitions: int) -> list[float]:
    """Seconds of the slowest rank, each repetition begun together, after one for warming up."""
    work()
    seconds = []
    for _ in range(repetitions):
        comm.Barrier()
        begun = time.perf_counter()
        work()
        seconds.append(comm.allreduce(time.perf_counter() - begun, MPI.MAX))
    return seconds


def copy_rate(comm: MPI.Comm, repetitions: int) -> list[float]:
    """GB/s read and written by all ranks together, each with arrays of its own."""
    source, into = np.ones(COPIED), np.zeros(COPIED)
    gigabytes = 2 * source.nbytes * comm.size / 1e9
    return [gigabytes / seconds for seconds in timed(comm, lambda: copy(source, into), repetitions)]


def gather_time(comm: MPI.Comm, cells: NDArray, nodes: int, repetitions: int) -> list[float]:
    """ns an element, each rank over a mesh (e, a) of its own: all ranks' elements over the slowest's time."""
    positions, force = np.ones((nodes, 3)), np.zeros((nodes, 3))
    rounds = max(1, 2_000_000 // len(cells))

    def work() -> None:
        for _ in range(rounds):
            gather_scatter(positions, cells, force)

    count = rounds * len(cells) * comm.size
    return [1e9 * seconds / count for seconds in timed(comm, work, repetitions)]
