"""A preconditioner of two levels for conjugate gradients: incomplete factors, and rigid parts of the body.

Incomplete factors see a node's neighbours and each rank its own nodes; what moves large pieces of the body against each
other they find only after many iterations. The parts do: their motions are solved for exactly, and added.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from ancf_petsc.algebra.blocks import factorise, solve_factors
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.matrix import Matrix
from ancf_petsc.solve.linear.half import HalfMatrix
from ancf_petsc.solve.linear.rigid_parts import RigidParts


class TwoLevel:
    """A matrix of an assembly as PETSc's Mat `operator`, and a context for a PC of type python."""

    def __init__(self, assembly: Assembly, matrix: Matrix) -> None:
        self.assembly = assembly
        self._half = HalfMatrix(assembly, matrix)
        self._parts = RigidParts(assembly)
        self._positions = assembly.model.reference.copy()
        columns, owned = self._half.half[1], assembly.model.owned
        self._factor, self._pivots = np.empty((len(columns), 9), np.float32), np.empty((owned, 9), np.float32)
        self._work = np.empty((owned, 3), np.float32)
        n, total = 3 * owned, assembly.comm.allreduce(3 * owned)
        self.operator = PETSc.Mat().createPython(((n, total), (n, total)), self._half, comm=assembly.comm)
        self.operator.setUp()

    def take(self, x: PETSc.Vec) -> None:
        """See the matrix as it is now, filled at x."""
        self._half.refresh()
        self.assembly.local(x, self._positions)

    def setUp(self, _: PETSc.PC) -> None:
        """Factors and stiffness of the parts, of the matrix taken last."""
        factorise(*self._half.half, self._factor, self._pivots)
        self._parts.fill(self._half, self._positions)

    def apply(self, _: PETSc.PC, r: PETSc.Vec, z: PETSc.Vec) -> None:
        """z = what r makes."""
        given, found = r.array_r.reshape(-1, 3), z.array_w.reshape(-1, 3)
        pointers, columns = self._half.half[:2]
        solve_factors(pointers, columns, self._factor, self._pivots, given, self._work, found)
        self._parts.add_correction(given, found)

    def free(self) -> None:
        """Free PETSc's objects. (`destroy` of a context is PETSc's to call.)"""
        self.operator.destroy()
