"""A symmetric matrix of an assembly, read from one half of its numbers."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from ancf_petsc.algebra.blocks import add_ghost_product, copy_half, symmetric_product, upper_pattern
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.matrix import Matrix


class HalfMatrix:
    """What a symmetric matrix of an assembly is at the last `refresh`; its products equal the matrix's.

    half: pointers, columns, blocks, diagonal of `algebra/blocks`, of owned columns. ghosts: values, split, pointers,
    columns of the others, in the matrix's own memory.
    """

    def __init__(self, assembly: Assembly, matrix: Matrix) -> None:
        self.assembly, self.matrix = assembly, matrix
        rows = matrix.layout.rows
        pointers, columns = upper_pattern(rows.own_pointers, rows.own_columns)
        self.half = (pointers, columns, np.empty((len(columns), 9)), np.empty((assembly.model.owned, 9)))
        self.ghosts = (matrix.values, rows.split, rows.other_pointers, rows.other_columns)
        self._x = np.empty_like(assembly.model.reference)

    def refresh(self) -> None:
        """Take the numbers the matrix has now."""
        pointers, _, blocks, diagonal = self.half
        copy_half(self.matrix.values, self.matrix.layout.rows.own_pointers, pointers, blocks, diagonal)

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = the matrix times x, as PETSc asks for it. Collective."""
        into = y.array_w.reshape(-1, 3)
        if self.assembly.comm.size == 1:
            symmetric_product(*self.half, x.array_r.reshape(-1, 3), into)
            return
        local = self.assembly.spread(x, self._x)
        symmetric_product(*self.half, local, into)
        add_ghost_product(*self.ghosts, local, into)
