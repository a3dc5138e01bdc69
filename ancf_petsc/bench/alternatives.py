"""Parts of this program beside what PETSc, SciPy and Gmsh offer in their place: the same work, the same answer."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from ancf_petsc.analysis.build import build
from ancf_petsc.bench.meshes import mesh_path
from ancf_petsc.bench.problems import pendulum
from ancf_petsc.input.load import case_from_dict
from ancf_petsc.mesh.assemble import assemble
from ancf_petsc.mesh.check import statistics
from ancf_petsc.mesh.gmsh_file import read_gmsh
from ancf_petsc.mesh.msh_text import read_ordinary
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.mass import Mass
from ancf_petsc.motion.mass_solver import MassSolver

CG: dict[str, object] = {"ksp_type": "cg"}
LINEAR_SOLVERS: dict[str, dict[str, object]] = {
    "two_level": {},
    "gamg": CG | {"pc_type": "gamg"},
    "gamg_tuned": CG
    | {
        "pc_type": "gamg",
        "pc_gamg_reuse_interpolation": True,
        "pc_gamg_threshold": 0.01,
        "pc_gamg_square_graph": 10,
        "mg_levels_ksp_type": "chebyshev",
        "mg_levels_ksp_max_it": 2,
        "mg_levels_pc_type": "jacobi",
    },
    "hypre": CG
    | {
        "pc_type": "hypre",
        "pc_hypre_type": "boomeramg",
        "pc_hypre_boomeramg_strong_threshold": 0.7,
        "pc_hypre_boomeramg_coarsen_type": "HMIS",
        "pc_hypre_boomeramg_interp_type": "ext+i",
        "pc_hypre_boomeramg_P_max": 4,
        "pc_hypre_boomeramg_agg_nl": 1,
    },
    "icc": CG | {"pc_type": "bjacobi", "sub_pc_type": "icc"},
    "eisenstat": CG | {"pc_type": "bjacobi", "sub_pc_type": "eisenstat"},
    "block_jacobi": CG | {"pc_type": "pbjacobi"},
    "mumps": {"ksp_type": "preonly", "pc_type": "cholesky", "pc_factor_mat_solver_type": "mumps"},
}
"""PETSc's preconditioners as one would set them for elasticity; the first is the default of this program."""

MASS_SOLVERS = ("envelope", "chebyshev", "petsc_cholesky", "superlu")
SOLVES = 100


def mass_solver(comm: MPI.Comm, *, mesh: str, solver: str, repetitions: int) -> dict[str, Any]:
    """Microseconds to solve for the accelerations of a body, its factor made before; checked: M a = b."""
    case = case_from_dict(pendulum(mesh, 1.0, 1, integrator="runge_kutta_4", step=2e-4), ".", "pendulum")
    mass = Mass(Assembly(build(case, comm).model))
    force = np.random.default_rng(1).uniform(-1.0, 1.0, (mass.assembly.model.owned, 3))
    force *= mass.assembly.model.drive[: len(force)] < 0
    begun = time.perf_counter()
    solve = _solve_with(solver, mass)
    made = time.perf_counter() - begun
    found, samples = solve(force), []
    for _ in range(repetitions):
        begun = time.perf_counter()
        for _ in range(SOLVES):
            found = solve(force)
        samples.append(1e6 * (time.perf_counter() - begun) / SOLVES)
    rest = (mass.times(found) - force) * (force != 0.0)
    error = float(np.abs(rest).max() / np.abs(force).max())
    return {"samples": samples, "error": error, "facts": {"made_seconds": made, "nodes": len(force)}}


def _solve_with(solver: str, mass: Mass) -> Callable[[NDArray], NDArray]:
    """A function from forces (n, 3) to accelerations (n, 3)."""
    if solver in ("envelope", "chebyshev"):
        return MassSolver(mass, "cholesky" if solver == "envelope" else solver).solve
    pointers, columns = mass.assembly.graph
    n = len(pointers) - 1
    driven = mass.assembly.model.drive[:n] >= 0
    matrix = csr_array((mass.values, columns, pointers), shape=(n, n))
    solvers: dict[bytes, Callable[[NDArray], NDArray]] = {}
    for axis in range(3):
        held = np.flatnonzero(driven[:, axis])
        key = held.tobytes()
        if key not in solvers:
            own = matrix.tolil(copy=True)
            own[held, :], own[:, held] = 0.0, 0.0
            own[held, held] = 1.0
            solvers[key] = (_superlu if solver == "superlu" else _cholesky)(own.tocsr())
    keys = [np.flatnonzero(driven[:, axis]).tobytes() for axis in range(3)]
    return lambda force: np.stack([solvers[keys[c]](force[:, c]) for c in range(3)], axis=1)


def _superlu(matrix: csr_array) -> Callable[[NDArray], NDArray]:
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve


def _cholesky(matrix: csr_array) -> Callable[[NDArray], NDArray]:
    rows = (matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data)
    shared = PETSc.Mat().createAIJ(matrix.shape, csr=rows, comm=PETSc.COMM_SELF)
    shared.setOption(PETSc.Mat.Option.SYMMETRIC, flag=True)
    ksp = PETSc.KSP().create(PETSc.COMM_SELF)
    ksp.setType("preonly")
    ksp.getPC().setType("cholesky")
    ksp.setOperators(shared)
    right, found = shared.createVecs()

    def solve(force: NDArray) -> NDArray:
        right.array[:] = force
        ksp.solve(right, found)
        return found.array_r.copy()

    return solve


def reader(comm: MPI.Comm, *, mesh: str, reader: str, repetitions: int) -> dict[str, Any]:
    """Seconds to read a text file of Gmsh, checks included; checked: the volume of the cube."""
    path, samples, volume = mesh_path(mesh), [], 0.0
    read = {"text": read_ordinary, "gmsh": read_gmsh}[reader]
    for _ in range(repetitions):
        begun = time.perf_counter()
        raw = read(path)
        assert raw is not None
        found = assemble(raw, path, ("tetra",), "error", "3413")
        samples.append(time.perf_counter() - begun)
        volume = statistics(found).volume
    return {"samples": samples, "error": abs(volume / (0.05**2 * 0.1) - 1.0), "facts": {}}
