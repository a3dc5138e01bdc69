"""Runs on several ranks that go on, and a full disk: restart_on_ranks.py FOLDER."""

from __future__ import annotations

import errno
import json
import os
import sys
from pathlib import Path

from motion_cases import pendulum
from mpi4py import MPI
from restart_cases import differences, followed, largest_difference, snapshots, with_checkpoints
from statics_cases import block

from ancf_petsc import EnvironmentProblem, run
from ancf_petsc.input.load import Case
from ancf_petsc.results.checkpoint_file import Writing

STATICS = with_checkpoints(block("pvc_block_234.msh", 0.02, steps=3), "2 steps")
CENTRAL = with_checkpoints(
    pendulum({"duration": 4e-3, "outputs": 2, "step": 5e-4, "integrator": "central_difference"}), "3 steps"
)


def restarted(case: Case, folder: Path) -> list[str]:
    """From the first checkpoint."""
    comm = MPI.COMM_WORLD
    with snapshots(folder) as kept:
        followed(case, folder / "whole")
    first = comm.bcast(kept[0] if kept else None)
    comm.Barrier()
    followed(case, first, restart=True)
    return differences(folder / "whole", first) if comm.rank == 0 else []


def full_disk(folder: Path) -> list[int]:
    """Exit codes of the ranks where the second checkpoint finds no space for its fields."""
    original = Writing.add

    def add(self: Writing, rows) -> None:
        if self.path.name.endswith("b.bin"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        original(self, rows)

    code = 0
    Writing.add = add  # type: ignore[method-assign]
    try:
        run(STATICS, folder)
    except EnvironmentProblem as error:
        code = error.exit_code
    finally:
        Writing.add = original  # type: ignore[method-assign]
    return MPI.COMM_WORLD.allgather(code)


def main() -> None:
    comm, folder = MPI.COMM_WORLD, Path(sys.argv[1])
    found: dict[str, list] = {"statics": restarted(STATICS, folder / "statics")}
    found["central"] = restarted(CENTRAL, folder / "central")
    found["full"] = full_disk(folder / "full")
    run(STATICS, folder / "full", restart=True)
    if comm.rank == 0:
        off = largest_difference(folder / "statics" / "whole", folder / "full")
        found["after"] = [] if off < 1e-9 else [off]
        sys.stdout.write("FOUND" + json.dumps(found))


if __name__ == "__main__":
    main()
