"""What is said of a state where a path ends: ends_on_ranks.py CASES.json, on three ranks.

CASES: name -> case, and "state" -> F (3, 3) with an amplitude of waves, which make the state F X + waves. The first rank alone,
the two others together, then all three: the line, and the weakest cell.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.build import build
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.solve.critical import Watch
from ancf_petsc.solve.newton import Newton
from ancf_petsc.solve.stability import Last, why_it_ends
from ancf_petsc.solve.weakest import weakest_cell

WAVES = np.array(
    [[31.0, 7.0, -19.0], [11.0, -37.0, 23.0], [-13.0, 29.0, 41.0]]
)  # no two cells of a cube of 0.1 alike


def placed(points: np.ndarray, F: Any, waves: float) -> np.ndarray:
    """Positions (n, 3) at the state."""
    return points @ np.array(F).T + waves * np.sin(points @ WAVES)


def describe(data: dict[str, Any], state: dict[str, Any], comm: MPI.Comm) -> dict[str, Any]:
    """The line at s = 0.25, the weakest cell, and the negative pivots of the tangent where one rank holds all of it."""
    assembly = Assembly(build(case_from_dict(data, Path(".")), comm).model)
    newton = Newton(assembly, 1e-8)
    x = assembly.reference_vector()
    x.array[:] = placed(assembly.model.reference[: assembly.model.owned], **state).ravel()
    weakest = weakest_cell(assembly, x)
    watch = Watch(newton)
    start = assembly.reference_vector()
    newton.tangent_at(start)
    watch.begin(0.0)
    error = why_it_ends(newton, watch, Last(0.25, x, "no convergence", 1e-4, 0.3, (0.25, x)))
    watch.destroy()
    found = {
        "line": str(error),
        "facts": error.facts,
        "weakest": [weakest.cell, weakest.stretch, weakest.det, weakest.place.tolist(), weakest.law],
    }
    if comm.size == 1:
        rows, n = newton.matrix.mat, newton.matrix.mat.getSize()[0]
        tangent = np.array([[rows.getValue(i, j) for j in range(n)] for i in range(n)])
        found["negative"] = int((np.linalg.eigvalsh(tangent) < 0.0).sum())
    newton.destroy()
    return found


def main() -> None:
    world = MPI.COMM_WORLD
    cases = json.loads(Path(sys.argv[1]).read_text())
    part = world.Split(min(world.rank, 1), world.rank)
    found = {}
    for name, (data, state) in cases.items():
        found[name] = [describe(data, state, part), describe(data, state, world)]
    every = world.gather(found)
    if world.rank == 0:
        told = {
            name: [every[0][name][0], every[1][name][0], every[2][name][0], *(one[name][1] for one in every)]
            for name in cases
        }
        sys.stdout.write("FOUND" + json.dumps(told))


if __name__ == "__main__":
    main()
