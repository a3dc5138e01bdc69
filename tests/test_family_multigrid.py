"""Multigrid on elements with slopes: few iterations at any size, and supports that stay where they are."""

import sys

import numpy as np
import pytest
from family import cantilever, mesh_of
from mpi4py import MPI
from petsc4py import PETSc

from ancf_petsc import case_from_dict, run
from ancf_petsc.analysis.build import build
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.solve.linear.solver import LinearSolver
from ancf_petsc.solve.petsc import petsc_options

MULTIGRID = {"ksp_type": "cg", "pc_type": "gamg"}


def iterations(code, divisions, folder):
    """Degrees of freedom, and conjugate gradients to 1e-8 with the tangent of the undeformed beam and its load."""
    case = case_from_dict(cantilever(mesh_of("cantilever", code, divisions, folder), code), folder)
    assembly = Assembly(build(case, MPI.COMM_SELF).model)
    matrix, ksp = assembly.create_matrix(), PETSc.KSP().create(MPI.COMM_SELF)
    with petsc_options(MULTIGRID):
        solver = LinearSolver(assembly, matrix, ksp)
        solver.read_options()
    solver.ask_for(1e-8)
    x, load, step = assembly.reference_vector(), assembly.vector(), assembly.vector()
    assembly.tangent(x, matrix)
    solver.renew_if_tired(x)
    load.array[:] = assembly.external_force(1.0).ravel()
    load.array[assembly.driven] = 0.0
    ksp.solve(load, step)
    assert ksp.getConvergedReason() > 0
    assert "gamg" in solver.describe()
    return assembly.model.dof, ksp.getIterationNumber()


@pytest.mark.parametrize(
    ("code", "divisions", "most"),
    [
        ("3843", (40, 4, 4), 50),
        ("3843", (60, 6, 6), 50),
        ("3443", (40, 4, 4), 50),
        ("3443", (60, 6, 6), 50),
        ("3443+4", (22, 3, 3), 80),
        ("3443+4", (40, 4, 4), 80),
    ],
)
def test_iterations_stay_few_with_12_000_and_36_000_degrees_of_freedom(code, divisions, most, tmp_path):
    """Multigrid knows the rigid motions with their slopes, and aggregates no nodes that are hardly coupled."""
    dof, found = iterations(code, divisions, tmp_path)
    sys.stderr.write(f"{code}: {found} iterations with {dof} degrees of freedom\n")
    assert 11_500 < dof < 13_000 or 35_000 < dof < 38_000
    assert found < most


@pytest.mark.parametrize("petsc", [MULTIGRID, {}], ids=["multigrid", "two_levels"])
def test_coarse_levels_leave_supports_in_place(petsc, monkeypatch, tmp_path):
    """Coarse levels that move clamped nodes turn the whole beam by a little that no residual shows."""
    monkeypatch.setattr("ancf_petsc.solve.linear.solver.CURVED_LIMIT", 0)
    data = cantilever(mesh_of("cantilever", "3443+4", (10, 1, 1), tmp_path), "3443+4") | {"petsc": petsc}
    results = run(case_from_dict(data, tmp_path), tmp_path / "run")
    assert results.curve["linear_iterations"][-1] > results.curve["newton_iterations"][-1]
    clamped = np.isclose(results.points[:, 0], 0.0)
    # Driven degrees of freedom are set, not solved for; fields are kept to the rounding of coordinates.
    assert abs(np.asarray(results.field("displacement"))[clamped]).max() < 1e-15
    # The factorised tangent gives the same end: -0.3479045 is known to the digits written.
    assert results.probes["end.uz"][-1] == pytest.approx(-0.3479045, abs=1e-7)
