"""Newton of small implicit steps in compiled loops: the factor of the tangent that `kernel/implicit` goes on with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.algebra.envelope import envelope, factorise
from ancf_petsc.kernel.implicit import DONE, WANTS_FACTOR, Progress, Scheme, Test
from ancf_petsc.motion.compiled import CompiledMotion
from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.increment import MOST_ITERATIONS, ROUNDING, SLOW, IncrementSolver
from ancf_petsc.solve.petsc import begins_a_given_option

MOST_ENTRIES = 200_000
"""Of a factor: beyond, sparse factors are quicker, and their callers' time counts little."""


class CompiledNewton:
    """Steps of generalised alpha for a body that `fits`, with the matrix and the tolerance of its IncrementSolver.

    aged: whether the factor is to be made anew.
    """

    def __init__(self, compiled: CompiledMotion, equations: Equations, solver: IncrementSolver) -> None:
        self.compiled, self.equations, self.solver = compiled, equations, solver
        self.aged = True
        self._pointers, self._columns = solver.matrix.mat.getRowIJ()
        self._starts = envelope(self._pointers, self._columns)
        self._factor = np.zeros(self._starts[-1])
        self._free = equations.solver.free.ravel().copy()

    @staticmethod
    def fits(solver: IncrementSolver) -> bool:
        """A small body, and no option that speaks of PETSc's solvers."""
        if begins_a_given_option("ts_", "snes_", "ksp_", "pc_", "mat_"):
            return False
        return envelope(*solver.matrix.mat.getRowIJ())[-1] <= MOST_ENTRIES

    def steps(
        self, state: tuple[NDArray, NDArray, NDArray], times: NDArray, scheme: Scheme
    ) -> tuple[int, int, bool]:
        """As many steps as `times` has entries, at which their loads are taken: x, v, a (n, 3) move on.

        Returns steps done, iterations, and whether all went well; a step that failed leaves its start behind.
        """
        d = self.solver.d.array.reshape(-1, 3)
        progress = Progress(0, 0, 0, np.inf, self.aged, False)
        while True:
            rounding = ROUNDING * self.solver.matrix.largest_diagonal
            test = Test(self.solver.relative, 0.0, rounding, SLOW, MOST_ITERATIONS)
            factor = (self._starts, self._factor)
            status, progress = self.compiled.implicit((*state, d), progress, times, scheme, test, factor)
            self.aged = bool(progress.aged)
            if status != WANTS_FACTOR or not self._renew():
                break
            progress = progress._replace(aged=False)
        self.aged = self.aged or status != DONE
        return progress.step, progress.newton, status == DONE

    def restore(self, *, aged: bool) -> None:
        """Go on with the matrix that the solver has."""
        self.aged = not (self.solver.matrix.largest_diagonal and self._factorised()) or aged

    def _renew(self) -> bool:
        """Factor at d; False where the matrix is not positive definite."""
        self.solver.fill(self.solver.d)
        return self._factorised()

    def _factorised(self) -> bool:
        values = self.solver.matrix.values
        return factorise(self._starts, self._pointers, self._columns, values, self._free, self._factor)
