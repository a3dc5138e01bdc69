"""The quarter block in dolfinx: /usr/bin/python3 peer_dolfinx.py TASK.json RESULT.json, on any ranks.

With `helped` in the task, steps start from states extrapolated through up to six before, and the
preconditioner is kept as long as it does its work: what ancf_petsc does as well.

Runs in the Python that has dolfinx (0.5 and later), not in this project's. Newton's iteration stops where
this project's does: at an out-of-balance force of 1e-8 of the reactions. Imports and code generation are not
timed.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import dolfinx
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem import petsc as assembling
from mpi4py import MPI
from petsc4py import PETSc

TOLERANCE = 1e-8
COMM = MPI.COMM_WORLD
PAST = 6  # states that the predictor looks back to
TIRED = 1.5  # times the iterations of a preconditioner just made: it is made anew
SOLVERS = {
    "mumps": {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"},
    "gamg": {"ksp_type": "cg", "ksp_rtol": 1e-5, "pc_type": "gamg", "pc_gamg_agg_nsmooths": 1},
}


def main(task_file: str, result_file: str) -> None:
    task = json.loads(Path(task_file).read_text())
    compiled = Block(task, _cube())
    del compiled
    COMM.Barrier()
    begun = time.perf_counter()
    held = (
        np.load(task["arrays"]) if COMM.rank == 0 else {"points": np.empty((0, 3)), "cells": np.empty((0, 4))}
    )
    block = Block(task, _mesh(held["points"], held["cells"].astype(np.int64)))
    ready = time.perf_counter()
    iterations = block.press()
    seconds = {"setup": ready - begun, "solve": time.perf_counter() - ready}
    force = block.force()
    if COMM.rank == 0:
        found = {"seconds": seconds, "force": force, "iterations": iterations, "version": dolfinx.__version__}
        Path(result_file).write_text(json.dumps(found))


def _mesh(points, cells):
    """A mesh from points (n, 3) and tetrahedra (e, 4) on the root rank."""
    try:
        import basix.ufl

        kind = basix.ufl.element("Lagrange", "tetrahedron", 1, shape=(3,))
    except ImportError:
        kind = ufl.VectorElement("Lagrange", ufl.Cell("tetrahedron", geometric_dimension=3), 1)
    return mesh.create_mesh(COMM, cells, points, ufl.Mesh(kind))


def _cube():
    """A small block, for generating code ahead."""
    corners = [np.zeros(3), np.array([0.05, 0.05, 0.1])]
    return mesh.create_box(COMM, corners, [2, 2, 4], mesh.CellType.tetrahedron)


class Block:
    """The quarter block with its forms, supports, matrix and linear solver."""

    def __init__(self, task: dict, body) -> None:
        self.task = task
        space = getattr(fem, "functionspace", None)
        self.space = (
            space(body, ("Lagrange", 1, (3,))) if space else fem.VectorFunctionSpace(body, ("Lagrange", 1))
        )
        self.u = fem.Function(self.space)
        self.stroke = fem.Constant(body, PETSc.ScalarType(0.0))
        force = self._force_form(body)
        self.force_form = fem.form(force)
        self.tangent_form = fem.form(ufl.derivative(force, self.u, ufl.TrialFunction(self.space)))
        self.supports = self._supports(body)
        self.matrix = assembling.create_matrix(self.tangent_form)
        self.force_vector = assembling.create_vector(self.force_form)
        self.matrix.setNearNullSpace(self._rigid())
        self.solver = self._solver()
        self.past: list = []
        self.fresh = 0

    def _force_form(self, body):
        young, poisson = self.task["young"], self.task["poisson"]
        mu, lame = young / 2 / (1 + poisson), young * poisson / (1 + poisson) / (1 - 2 * poisson)
        F = ufl.Identity(3) + ufl.grad(self.u)
        E = (F.T * F - ufl.Identity(3)) / 2
        energy = (lame / 2 * ufl.tr(E) ** 2 + mu * ufl.inner(E, E)) * ufl.dx(body)
        return ufl.derivative(energy, self.u, ufl.TestFunction(self.space))

    def _supports(self, body) -> list:
        height = COMM.allreduce(body.geometry.x[:, 2].max(initial=0.0), MPI.MAX)
        planes = [(2, 0.0, (0, 1, 2)), (2, height, (0, 1)), (0, 0.0, (0,)), (1, 0.0, (1,))]
        zero = fem.Constant(body, PETSc.ScalarType(0.0))
        found = [self._support(body, axis, level, i, zero) for axis, level, parts in planes for i in parts]
        self.top = self._rows(body, 2, height, 2)
        return [*found, fem.dirichletbc(self.stroke, self.top, self.space.sub(2))]

    def _support(self, body, axis: int, level: float, component: int, value):
        return fem.dirichletbc(value, self._rows(body, axis, level, component), self.space.sub(component))

    def _rows(self, body, axis: int, level: float, component: int):
        faces = mesh.locate_entities_boundary(body, 2, lambda x: np.isclose(x[axis], level, atol=1e-9))
        return fem.locate_dofs_topological(self.space.sub(component), 2, faces)

    def _solver(self):
        solver = PETSc.KSP().create(COMM)
        solver.setOptionsPrefix("peer_")
        options = PETSc.Options()
        for name, value in SOLVERS[self.task["solver"]].items():
            options[f"peer_{name}"] = value
        solver.setOperators(self.matrix)
        solver.setFromOptions()
        return solver

    def press(self) -> dict[str, int]:
        """All steps."""
        counts = {"newton": 0, "linear": 0}
        for step in range(1, self.task["steps"] + 1):
            self.stroke.value = -self.task["stroke"] * step / self.task["steps"]
            if self.task.get("helped"):
                self._predict(step)
            while not self._balanced():
                self._improve(counts)
            self.past.append((step, self.u.vector.array_r.copy()))
        return counts

    def _predict(self, step: int) -> None:
        """The polynomial through the states before, the undeformed one among them, at this step."""
        states = [(0, 0.0 * self.u.vector.array_r), *self.past][-PAST:]
        values = np.zeros_like(states[0][1])
        for i, state in states:
            values += np.prod([(step - j) / (i - j) for j, _ in states if j != i]) * state
        self.u.vector.array[:] = values
        self.u.x.scatter_forward()

    def _balanced(self) -> bool:
        """Assemble the forces; whether supports are in place and what is out of balance is small."""
        raw = self._raw_force()
        reactions = raw.norm()
        assembling.apply_lifting(raw, [self.tangent_form], [self.supports], [self.u.vector], -1.0)
        raw.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        assembling.set_bc(raw, self.supports, self.u.vector, -1.0)
        return raw.norm() <= TOLERANCE * reactions

    def _raw_force(self):
        with self.force_vector.localForm() as local:
            local.set(0.0)
        assembling.assemble_vector(self.force_vector, self.force_form)
        return self.force_vector

    def _improve(self, counts: dict[str, int]) -> None:
        self.matrix.zeroEntries()
        assembling.assemble_matrix(self.matrix, self.tangent_form, bcs=self.supports)
        self.matrix.assemble()
        step = self.u.vector.copy()
        self.solver.solve(self.force_vector, step)
        self.u.vector.axpy(-1.0, step)
        self.u.x.scatter_forward()
        spent = self.solver.getIterationNumber()
        counts["newton"] += 1
        counts["linear"] += spent
        if self.task.get("helped"):
            self.fresh = self.fresh or spent
            tired = spent > TIRED * self.fresh
            self.solver.getPC().setReusePreconditioner(not tired)
            self.fresh = 0 if tired else self.fresh

    def _rigid(self):
        coordinates = self.u.vector.copy()
        points = self.space.tabulate_dof_coordinates()
        coordinates.array[:] = points[: coordinates.getLocalSize() // 3].ravel()
        return PETSc.NullSpace().createRigidBody(coordinates)

    def force(self) -> float:
        """What the top exerts on the body along z."""
        raw = self._raw_force()
        raw.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        owned = self.top[self.top < raw.getLocalSize()]
        return COMM.allreduce(float(raw.array_r[owned].sum()))


if __name__ == "__main__":
    main(*sys.argv[1:])
