"""One rank fails within a run: one_rank_fails.py WHERE RANK CASE OUT. It notes when, in OUT.failed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

PLACES = {  # what fails on the rank, at which call
    "reading": ("ancf_petsc.analysis.run", "_compile", 1),
    "set-up": ("ancf_petsc.analysis.build", "kernel_set", 1),
    "kernel": ("ancf_petsc.model.assembly.Assembly", "internal_force", 9),
    "solver": ("ancf_petsc.solve.linear.solver.LinearSolver", "renew_if_tired", 3),
    "output": ("ancf_petsc.analysis.output_points.OutputPoints", "__call__", 2),
    "an error of the program": ("ancf_petsc.analysis.record.Record", "curve", 3),
}


def failing(original: Callable[..., Any], at: int, stamp: Path, error: Exception) -> Callable[..., Any]:
    """The same until call number `at`."""
    calls = 0

    def call(*arguments: Any, **more: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == at:
            stamp.write_text(repr(time.time()))
            raise error
        return original(*arguments, **more)

    return call


def main() -> int:
    where, number, case, out = sys.argv[1:]
    from mpi4py import MPI

    from ancf_petsc import cli
    from ancf_petsc.errors import CaseError

    home, name, at = PLACES[where]
    module, _, kind = home.rpartition(".")
    owner = getattr(import_module(module), kind) if kind[0].isupper() else import_module(home)
    if MPI.COMM_WORLD.rank == int(number):
        ours = where == "an error of the program"
        error = CaseError("of one rank alone") if ours else ZeroDivisionError(f"no {where}")
        setattr(owner, name, failing(getattr(owner, name), at, Path(f"{out}.failed"), error))
    return cli.main(["run", case, "--out", out, "--quiet"])


if __name__ == "__main__":
    sys.exit(main())
