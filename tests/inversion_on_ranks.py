"""Newton's method from a state with inverted cells at one node: inversion_on_ranks.py CASE.json, on several ranks."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from mpi4py import MPI

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.build import build
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.solve.newton import Newton


def pushed(assembly: Assembly) -> Any:
    """The undeformed quarter cube, the lowest node on its free vertical edge moved through the cells at it."""
    x = assembly.reference_vector()
    place = assembly.model.reference[: assembly.model.owned]
    at_edge = (abs(place - [0.05, 0.05, 0.0125]) < 1e-9).all(axis=1)
    x.array.reshape(-1, 3)[at_edge] = [-0.1, -0.1, 0.0125]
    return x


def main() -> None:
    comm = MPI.COMM_WORLD
    data = json.loads(Path(sys.argv[1]).read_text())
    assembly = Assembly(build(case_from_dict(data, Path(".")), comm).model)
    newton = Newton(assembly, 1e-8)
    x = pushed(assembly)
    own, smallest = assembly.internal_force(x)[1], assembly.smallest_det(x)
    outcome = newton.solve(0.0, x)
    found = comm.gather({"own": own, "smallest": smallest, "outcome": [outcome.converged, outcome.reason]})
    if comm.rank == 0:
        sys.stdout.write("FOUND" + json.dumps(found))
    newton.destroy()


if __name__ == "__main__":
    main()
