"""What is found of a body's surface: surface_on_ranks.py CASE.json, on three ranks: one alone, two together, all three."""

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
from ancf_petsc.model.surface import surface_of


def found_in(assembly: Assembly) -> dict[str, Any]:
    """Of all ranks: numbers of faces, the area of free ones, places of singular nodes. Faces that several ranks see are shared."""
    model, comm = assembly.model, assembly.comm
    surface = surface_of(assembly)
    own = (surface.corners < model.owned).sum(axis=1) / surface.corners.shape[1]
    points = model.reference[surface.corners]
    edges = points[:, 1:] - points[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, -1]), axis=1) / (2 if points.shape[1] == 3 else 1)
    places = model.origin + model.reference[: model.owned][surface.singular[: model.owned]]
    every = [place for part in comm.allgather(places.round(9).tolist()) for place in part]
    return {
        "faces": round(comm.allreduce(float(own.sum()))),
        "free": round(comm.allreduce(float(own[surface.free].sum()))),
        "area": comm.allreduce(float((own * area)[surface.free].sum())),
        "singular": sorted(every),
    }


def main() -> None:
    world = MPI.COMM_WORLD
    data = json.loads(Path(sys.argv[1]).read_text())
    part = world.Split(min(world.rank, 1), world.rank)
    found = [found_in(Assembly(build(case_from_dict(data, Path(".")), comm).model)) for comm in (part, world)]
    every = world.gather(found)
    if world.rank == 0:
        sys.stdout.write("FOUND" + json.dumps([every[0][0], every[1][0], every[0][1]]))


if __name__ == "__main__":
    main()
