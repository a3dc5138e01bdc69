"""Iterations of conjugate gradients on beams bent far, for every kind of element."""

from __future__ import annotations

import time
from typing import Any

from mpi4py import MPI

from ancf_petsc.analysis.build import build
from ancf_petsc.bench.problems import beam
from ancf_petsc.input.load import case_from_dict
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import on_root
from ancf_petsc.solve.load_path import LoadPath, Marks
from ancf_petsc.solve.newton import Newton
from ancf_petsc.solve.petsc import petsc_options

REDUCTION = 1e-8
SOLVERS: dict[str, dict[str, object]] = {
    "two_level": {},
    "gamg": {"ksp_type": "cg", "pc_type": "gamg"},
}


def iterations(comm: MPI.Comm, *, mesh: str, element: str, solver: str, repetitions: int) -> dict[str, Any]:
    """Iterations to eight digits with the tangent of a bent beam; checked: the residual of the solution."""
    case = comm.bcast(on_root(comm, lambda: case_from_dict(beam(mesh, element), ".", "beam")))
    assembly = Assembly(build(case, comm).model)
    bending = Newton(assembly, 1e-6)
    path = LoadPath(bending, Marks.of([1.0], ()), 1e-3)
    path.run()
    bending.destroy()
    with petsc_options(SOLVERS[solver]):
        newton = Newton(assembly, 1e-8)
    ksp, (rhs, found) = newton.linear.ksp, (assembly.vector() for _ in range(2))
    rhs.array[:] = assembly.external_force(1.0).ravel()
    rhs.array[assembly.driven] = 0.0
    counts, seconds = [], []
    for _ in range(repetitions):
        begun = time.perf_counter()
        newton.tangent_at(path.x)
        ksp.setTolerances(rtol=REDUCTION)
        ksp.solve(rhs, found)
        seconds.append(time.perf_counter() - begun)
        counts.append(ksp.getIterationNumber())
    rest = rhs.duplicate()
    newton.matrix.mat.mult(found, rest)
    rest.axpy(-1.0, rhs)
    facts = {"dof": assembly.model.dof, "seconds": seconds, "solver": newton.linear.describe()}
    error = rest.norm() / rhs.norm()
    newton.destroy()
    return {"samples": counts, "error": error, "facts": facts}
