"""Damped motion of a body from its undeformed state to rest under 0.6 of its loads: settling_on_ranks.py CASE.json, on three ranks.

The first rank alone, the two others together, then all three: steps, and energy and mean displacement at rest.
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
from ancf_petsc.solve.critical import Watch
from ancf_petsc.solve.newton import Newton
from ancf_petsc.solve.settle import settle


def follow(data: dict[str, Any], comm: MPI.Comm) -> dict[str, Any]:
    assembly = Assembly(build(case_from_dict(data, Path(".")), comm).model)
    newton = Newton(assembly, 1e-10)
    watch, x = Watch(newton), assembly.reference_vector()
    newton.tangent_at(x)
    watch.begin(0.0)
    rest = settle(newton, watch, 0.6, x)
    energy, place = assembly.strain_energy(x), mean_position(assembly, x, STROKE)[1]
    found = {"steps": rest and rest.steps, "energy": energy, "at": place.tolist()}
    watch.destroy()
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
