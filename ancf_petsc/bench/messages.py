"""What travels between ranks: counted on any number of them, timed between two."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI

from ancf_petsc.analysis.build import build_from
from ancf_petsc.bench.problems import block
from ancf_petsc.bench.yardstick import timed
from ancf_petsc.input.load import case_from_dict
from ancf_petsc.parallel.exchange import on_root
from ancf_petsc.plan.plan import make_plan

SMALL, LARGE, ROUNDS = 8, 2**23, 200


def messages(comm: MPI.Comm, *, mesh: str, repetitions: int) -> dict[str, Any]:
    """The most ghosts, neighbours and elements over its share that a rank has of a divided mesh."""
    case = comm.bcast(on_root(comm, lambda: case_from_dict(block(mesh, 0.001, 1), ".", "block")))
    built = build_from(case, on_root(comm, lambda: make_plan(case)), comm)
    model = built.model
    starts = np.cumsum([0, *comm.allgather(model.owned)])[:-1]
    neighbours = len(np.unique(np.searchsorted(starts, model.ghost_numbers, side="right")))
    ghosts = comm.allreduce(len(model.ghost_numbers), MPI.MAX)
    cells = comm.allreduce(len(model.cells), MPI.MAX)
    facts = {
        "elements": built.order.total_cells,
        "nodes": built.order.total_nodes,
        "ghosts": ghosts,
        "neighbours": comm.allreduce(neighbours, MPI.MAX),
        "elements_over_share": cells * comm.size / built.order.total_cells,
    }
    return {"samples": [ghosts], "error": None, "facts": facts}


def exchange_cost(comm: MPI.Comm, *, repetitions: int) -> dict[str, Any]:
    """Microseconds of small messages exchanged, GB/s of large ones, microseconds of a sum over both ranks."""
    other, kinds = 1 - comm.rank, {}
    for size in (SMALL, LARGE):
        out, back = np.zeros(size, np.uint8), np.empty(size, np.uint8)
        rounds = ROUNDS if size == SMALL else 4

        def swap(out=out, back=back, rounds=rounds) -> None:
            for _ in range(rounds):
                comm.Sendrecv(out, other, recvbuf=back, source=other)

        kinds[size] = [seconds / rounds for seconds in timed(comm, swap, repetitions)]
    one, total = np.ones(1), np.empty(1)

    def reduce() -> None:
        for _ in range(ROUNDS):
            comm.Allreduce(one, total)

    sums = [1e6 * seconds / ROUNDS for seconds in timed(comm, reduce, repetitions)]
    facts = {"bandwidth_gb_s": [LARGE / seconds / 1e9 for seconds in kinds[LARGE]], "sum_us": sums}
    return {
        "samples": [1e6 * seconds for seconds in kinds[SMALL]],
        "error": abs(total[0] - 2),
        "facts": facts,
    }
