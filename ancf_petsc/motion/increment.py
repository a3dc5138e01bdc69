"""Newton for the increment d = x1 - x0 of one implicit step: free of the rounding a position as unknown
would bring.

A factored matrix is kept from iteration to iteration and from step to step as long as it does its work.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.model.matrix import Matrix
from ancf_petsc.motion.equations import Equations
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.parallel.fields import field
from ancf_petsc.solve.linear.solver import LinearSolver
from ancf_petsc.solve.newton import MOST_ITERATIONS
from ancf_petsc.solve.petsc import NOT_FINITE, default_options

Reason = PETSc.SNES.ConvergedReason
SLOW = 0.1  # a residual that falls by less asks for a new matrix: factoring costs some five iterations
ROUNDING = 4e-16  # of a position: what it leaves of forces is this times stiffness and position
WORDS = {
    NOT_FINITE: "forces are not finite",
    Reason.DIVERGED_MAX_IT: f"no convergence in {MOST_ITERATIONS} Newton iterations",
    Reason.DIVERGED_LINE_SEARCH: "no step along Newton's direction lowers the out-of-balance force",
    Reason.DIVERGED_LINEAR_SOLVE: "the linear solver failed",
    Reason.DIVERGED_DTOL: "Newton runs away",
}


@dataclass(frozen=True)
class Forces:
    """Out-of-balance force (n, 3) with the values on driven nodal vectors left in, and the squared force
    scale here.
    """

    values: NDArray[np.float64]
    scale: float


class ForceTest:
    """Convergence: out-of-balance force against the forces at work. Tells whether the matrix has aged."""

    def __init__(self, matrix: Matrix, x: PETSc.Vec) -> None:
        self.matrix, self.x = matrix, x
        self.scale = 0.0
        self.aged = True
        self._before = np.inf

    def begin(self) -> None:
        """A new solve begins with a residual that nothing compares with."""
        self._before = np.inf

    def note_scale(self, squared: float) -> None:
        """The squared norm of the forces on this rank, of the residual computed last."""
        self.scale = squared

    def __call__(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        residual = norms[2]
        if not isfinite(residual):
            return NOT_FINITE
        forces = sqrt(combined(self.matrix.comm, self.scale))
        relative, absolute = snes.getTolerances()[:2]
        if iteration:
            self.aged = self.aged or residual > SLOW * self._before
        self._before = residual
        if residual <= max(relative * forces, absolute) or residual <= self._rounding():
            return Reason.CONVERGED_FNORM_RELATIVE
        return Reason.ITERATING

    def _rounding(self) -> float:
        """What the rounding of positions leaves of forces. Collective."""
        return ROUNDING * self.matrix.largest_diagonal * self.x.norm()


class IncrementSolver:
    """Solves forces(d) = 0 on the free degrees of freedom; d carries the increments of the driven ones.

    x: the state. forces(d) -> Forces. tangent(d, matrix) adds the derivative to a matrix. relative: the
    tolerance.
    """

    def __init__(
        self,
        equations: Equations,
        x: PETSc.Vec,
        forces: Callable[[PETSc.Vec], Forces],
        tangent: Callable[[PETSc.Vec, Matrix], None],
        *,
        symmetric: bool,
        relative: float,
    ) -> None:
        self.equations, self.x = equations, x
        self.assembly = equations.assembly
        self.forces, self.tangent, self.relative = forces, tangent, relative
        self.matrix = self.assembly.create_matrix(symmetric=symmetric)
        self.d = self.assembly.vector()
        self.test = ForceTest(self.matrix, x)
        self.newton = self.linear_iterations = 0
        self._always_new = False
        self._made: tuple[NDArray, NDArray] | None = None  # state and increment, of the matrix
        self._residual = self.assembly.vector()
        self._quick = self._create("basic")
        self.linear = LinearSolver(self.assembly, self.matrix, self._quick.getKSP(), with_mass=True)
        with default_options({"snes_linesearch_type": "basic"}):
            self._quick.setFromOptions()
        self._careful = self._create("bt")
        self._careful.setKSP(self._quick.getKSP())
        for snes in (self._quick, self._careful):
            snes.setJacobian(self._jacobian, self.linear.operator, self.matrix.mat)
        with default_options({"snes_linesearch_type": "bt"}):
            self._careful.setFromOptions()

    def _create(self, search: str) -> PETSc.SNES:
        snes = PETSc.SNES().create(self.equations.comm)
        snes.setType(PETSc.SNES.Type.NEWTONLS)
        snes.setFunction(self._function, self._residual)
        snes.setConvergenceTest(self.test)
        snes.setTolerances(rtol=self.relative, atol=0.0, max_it=MOST_ITERATIONS)
        return snes

    def solve(self, guess: NDArray) -> str | None:
        """Start from guess (n, 3); the answer is in `d`. Returns None, or in words why there is none.
        Collective.
        """
        self.newton = self.linear_iterations = 0
        self.d.array[:] = guess.ravel()
        reason = self._run(self._quick)
        if reason <= 0:
            self.test.aged = self._always_new = True
            driven = self.assembly.driven
            self.d.array[:] = 0.0
            self.d.array[driven] = guess.ravel()[driven]
            reason = self._run(self._careful)
            self._always_new = False
        return None if reason > 0 else WORDS.get(reason, f"PETSc's reason {reason}")

    def state(self) -> dict[str, Any]:
        """The matrix that is kept from step to step, as what it was made of."""
        made = None if self._made is None else [field(values) for values in self._made]
        return {"aged": self.test.aged, "made": made, "largest_diagonal": self.matrix.largest_diagonal}

    def restore(self, state: dict[str, Any]) -> None:
        """Make the matrix of a state anew; the state x stays. Collective."""
        if state["made"] is not None:
            x = self.x.array_r.copy()
            made_at, d = (values.ravel() for values in state["made"])
            self.x.array[:], self.d.array[:] = made_at, d
            self.fill(self.d)
            self.linear.take(self.x)
            self.x.array[:] = x
        self.test.aged, self.matrix.largest_diagonal = state["aged"], state["largest_diagonal"]

    def fill(self, d: PETSc.Vec) -> None:
        """Make the matrix the derivative of the forces at d."""
        self._made = self.x.array_r.copy(), d.array_r.copy()
        self.matrix.clear()
        self.tangent(d, self.matrix)
        self.matrix.finish()

    def set_up(self) -> None:
        """Fill the matrix at d and set the linear solver up."""
        self._jacobian(self._quick, self.d, self.linear.operator, self.matrix.mat)
        self.linear.set_operators()
        self._quick.setUp()
        self.linear.ksp.setUp()

    def destroy(self) -> None:
        """Free PETSc's objects."""
        for item in (self.linear, self._careful, self._quick, self.matrix, self.d, self._residual):
            item.destroy()

    def _run(self, snes: PETSc.SNES) -> int:
        snes.solve(None, self.d)
        self.newton += snes.getIterationNumber()
        self.linear_iterations += snes.getLinearSolveIterations()
        return snes.getConvergedReason()

    def _function(self, snes: PETSc.SNES, d: PETSc.Vec, f: PETSc.Vec) -> None:
        forces = self.forces(d)
        values = f.array_w
        values[:] = forces.values.ravel()
        values[self.assembly.driven] = 0.0
        self.test.note_scale(forces.scale)

    def _jacobian(self, snes: PETSc.SNES, d: PETSc.Vec, J: PETSc.Mat, P: PETSc.Mat) -> None:
        if self.test.aged or self._always_new:
            self.fill(d)
            self.linear.take(self.x)
            self.test.aged = False
