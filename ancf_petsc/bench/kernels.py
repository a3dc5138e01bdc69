"""Timing the two inner loops on a body under uniaxial strain, where force and tangent are known."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ancf_petsc.analysis.build import build_from
from ancf_petsc.bench.problems import HEIGHT, block, stretched_force
from ancf_petsc.bench.yardstick import timed
from ancf_petsc.input.load import case_from_dict
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.matrix import Matrix
from ancf_petsc.model.measures import reaction
from ancf_petsc.parallel.exchange import on_root
from ancf_petsc.plan.plan import make_plan

STRETCH = 0.9


def residual(comm: MPI.Comm, *, mesh: str, repetitions: int, rounds: int = 20) -> dict[str, Any]:
    """ns an element of the internal force; checked: the force of uniaxial strain on the top."""
    assembly, cells = _body(comm, mesh)
    x = _stretched(assembly)

    def work() -> None:
        for _ in range(rounds):
            assembly.internal_force(x)

    seconds = timed(comm, work, repetitions)
    found = reaction(assembly, assembly.internal_force(x)[0], "top")[2]
    error = abs(found / stretched_force(STRETCH)[0] - 1)
    return _result(seconds, rounds, cells, error)


def tangent(comm: MPI.Comm, *, mesh: str, repetitions: int, rounds: int = 5) -> dict[str, Any]:
    """ns an element of the tangent in PETSc's matrix, supports included.

    Checked: the derivative of uniaxial strain's force, and the matrix times a field against the elements'
    directional derivative.
    """
    assembly, cells = _body(comm, mesh)
    x, matrix = _stretched(assembly), assembly.create_matrix()

    def work() -> None:
        for _ in range(rounds):
            assembly.tangent(x, matrix)

    seconds = timed(comm, work, repetitions)
    error = max(_derivative_error(assembly, x), _product_error(assembly, x, matrix))
    return _result(seconds, rounds, cells, error)


def _result(seconds: list[float], rounds: int, cells: int, error: float) -> dict[str, Any]:
    samples = [1e9 * spent / rounds / cells for spent in seconds]
    return {"samples": samples, "error": error, "facts": {"elements": cells}}


def _body(comm: MPI.Comm, mesh: str) -> tuple[Assembly, int]:
    """The block, ready to be assembled, and its number of elements."""
    case = comm.bcast(on_root(comm, lambda: case_from_dict(block(mesh, 0.001, 1), ".", "block")))
    built = build_from(case, on_root(comm, lambda: make_plan(case)), comm)
    return Assembly(built.model), built.order.total_cells


def _stretched(assembly: Assembly) -> PETSc.Vec:
    x = assembly.reference_vector()
    x.array[2::3] *= STRETCH
    return x


def _derivative_error(assembly: Assembly, x: PETSc.Vec) -> float:
    direction = assembly.reference_vector()
    direction.array.reshape(-1, 3)[:, :2] = 0.0
    grown = reaction(assembly, assembly.tangent_product(x, direction), "top")[2]
    return abs(grown / stretched_force(STRETCH)[1] - 1)


def _product_error(assembly: Assembly, x: PETSc.Vec, matrix: Matrix) -> float:
    direction, product = assembly.reference_vector(), assembly.vector()
    direction.array[:] = np.sin(direction.array_r * (40 / HEIGHT))
    direction.array[assembly.driven] = 0.0
    assembly.tangent(x, matrix)
    matrix.mat.mult(direction, product)
    expected = assembly.vector()
    expected.array[:] = assembly.tangent_product(x, direction).ravel()
    expected.array[assembly.driven] = 0.0
    scale = expected.norm()
    product.axpy(-1.0, expected)
    return product.norm() / scale
