"""A shallow arch under a force carried past its limit point by damped motion: jumps_on_ranks.py CASE.json, on three ranks.

The first rank alone, the two others together, then all three: the jump, the energy after it, and the last displacement.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from mpi4py import MPI

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.build import build
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.measures import mean_position
from ancf_petsc.plan.curve import STROKE
from ancf_petsc.solve.load_path import LoadPath
from ancf_petsc.solve.marks import Marks
from ancf_petsc.solve.newton import Newton


def follow(data: dict[str, Any], comm: MPI.Comm) -> dict[str, Any]:
    assembly = Assembly(build(case_from_dict(data, Path(".")), comm).model)
    newton, jumps = Newton(assembly, 1e-10), []
    path = LoadPath(
        newton,
        Marks.of([0.6], ()),
        1e-2,
        on_jump=lambda jump, before, x: jumps.append([jump.before, jump.s, assembly.strain_energy(x)]),
    )
    path.run()
    found = {"jumps": jumps, "at": mean_position(assembly, path.x, STROKE)[1].tolist()}
    newton.destroy()
    return found


def main() -> None:
    world = MPI.COMM_WORLD
    data = json.loads(Path(sys.argv[1]).read_text())
    part = world.Split(min(world.rank, 1), world.rank)
    every = world.gather([follow(data, part), follow(data, world)])
    if world.rank == 0:
        told = [*(one[0] for one in every), *(one[1] for one in every)]
        sys.stdout.write("FOUND" + json.dumps(told))


if __name__ == "__main__":
    main()
