"""What a benchmark's process does: `python -m ancf_petsc.bench.worker TASK.json RESULT.json`, on any ranks.

The task is a measurement's name and its arguments, the result what it returns or the problem it met.
"""

from __future__ import annotations

import json
import logging
import sys
from pathlib import Path
from typing import Any

from mpi4py import MPI

from ancf_petsc.bench.measure import MEASUREMENTS
from ancf_petsc.errors import AncfError


def main(task_file: str, result_file: str) -> None:
    """Measure, and write the result on the root rank."""
    comm = MPI.COMM_WORLD
    task = json.loads(Path(task_file).read_text())
    logging.getLogger("ancf").setLevel(logging.ERROR)
    result = _measured(comm, task)
    if comm.rank == 0:
        Path(result_file).write_text(json.dumps(result))


def _measured(comm: MPI.Comm, task: dict[str, Any]) -> dict[str, Any]:
    measurement = MEASUREMENTS[task.pop("measure")]
    try:
        return measurement(comm, **task)
    except AncfError as error:
        return {"problem": str(error)}


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Exception:
        sys.excepthook(*sys.exc_info())
        sys.stderr.flush()
        MPI.COMM_WORLD.Abort(1)
