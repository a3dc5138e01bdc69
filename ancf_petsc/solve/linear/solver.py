"""Linear solvers for the tangent, chosen by size; the options have the last word.

Up to DIRECT_LIMIT degrees of freedom MUMPS factors the symmetric tangent, up to CURVED_LIMIT where elements have
slopes or mid-nodes, whose rows are long. Above, conjugate gradients with the preconditioner of two levels
(`two_level`); beyond TWO_LEVEL_LIMIT or MOST_RANKS, and for tangents that are not symmetric, algebraic multigrid that
knows the rigid motions of the current configuration. Where conjugate gradients meet a tangent that is not positive
definite, MUMPS factors from there on (LDLᵀ). The preconditioner is kept from one tangent to the next while it pays.
In motion the mass keeps the matrix definite: PETSc's own factorisation, which has less to set up, serves small
bodies.
"""

from __future__ import annotations

from collections.abc import Callable
from math import log10
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.matrix import Matrix
from ancf_petsc.parallel.fields import field
from ancf_petsc.solve.linear.rigid import rigid_motions
from ancf_petsc.solve.linear.two_level import TwoLevel
from ancf_petsc.solve.petsc import default_options, direct_package, is_given

DIRECT_LIMIT, CURVED_LIMIT = 300, 5_000  # measured by `ancf bench alternatives/direct alternatives/iterative`
TWO_LEVEL_LIMIT, MOST_RANKS = (
    3_000_000,
    64,
)  # the coarse matrix is dense and on every rank; the largest body tried has 0.3 million
SMALL = 3_000
CHEAP_TO_FACTOR = 30_000
TIRED = 1.5  # times the iterations of a preconditioner just made: it is made anew
GAMG_THRESHOLD = 0.01  # drops weak couplings from the aggregates: fewer iterations with slopes and mid-nodes


class LinearSolver:
    """Sets up a KSP for one matrix of an assembly. with_mass: in motion."""

    def __init__(
        self, assembly: Assembly, matrix: Matrix, ksp: PETSc.KSP, *, with_mass: bool = False
    ) -> None:
        self.assembly, self.matrix = assembly, matrix
        self.ksp = ksp
        self.dof = assembly.model.dof
        self.small = with_mass and assembly.comm.size == 1 and self.dof <= SMALL
        chosen = is_given("ksp_type") or is_given("pc_type")
        limit = CURVED_LIMIT if assembly.model.element.is_curved else SMALL if with_mass else DIRECT_LIMIT
        self.direct = self.dof <= limit and not chosen
        self._fresh_rate: float | None = None
        self._rate: float | None = None
        self._fell_back = False
        self._made: tuple[NDArray, NDArray] | None = None  # state and diagonal added, of the preconditioner
        few = self.dof <= TWO_LEVEL_LIMIT and assembly.comm.size <= MOST_RANKS
        self._two_level = None
        if matrix.symmetric and few and not (chosen or self.direct):
            self._two_level = TwoLevel(assembly, matrix)
        self._configure()

    @property
    def operator(self) -> PETSc.Mat:
        """What vectors are multiplied with: the two levels' own copy of the matrix as long as they see it."""
        return self.matrix.mat if self._two_level is None or self.direct else self._two_level.operator

    def destroy(self) -> None:
        """Free PETSc's objects; one with Python in it that is left to Python's end can crash it."""
        if self._two_level is not None:
            self.ksp.reset()
            self.ksp.getPC().setType(PETSc.PC.Type.NONE)
            self._two_level.free()

    def _configure(self) -> None:
        pc = self.ksp.getPC()
        if self.direct:
            self.ksp.setType(PETSc.KSP.Type.PREONLY)
            pc.setType(PETSc.PC.Type.CHOLESKY if self.matrix.symmetric else PETSc.PC.Type.LU)
            pc.setFactorSolverType("petsc" if self.small else direct_package())
            if self.small:
                pc.setFactorOrdering("qmd")
            return
        self.ksp.setType(PETSc.KSP.Type.CG if self.matrix.symmetric else PETSc.KSP.Type.BCGS)
        self.ksp.setTolerances(rtol=1e-8, max_it=1000)
        if self.matrix.symmetric:
            self.ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        if self._two_level is not None:
            pc.setType(PETSc.PC.Type.PYTHON)
            pc.setPythonContext(self._two_level)
        else:
            pc.setType(PETSc.PC.Type.GAMG)
            pc.setGAMGType("agg")
            pc.setGAMGSmooths(1)

    def read_options(self) -> None:
        """Let the options speak, and see what they made of the solver."""
        with default_options({"pc_gamg_threshold": GAMG_THRESHOLD}):
            self.ksp.setFromOptions()
        self.direct = self.ksp.getType() == PETSc.KSP.Type.PREONLY

    def fall_back_to_direct(self) -> None:
        """Factor from now on: for tangents that conjugate gradients cannot solve."""
        self.ksp.reset()
        self.direct = self._fell_back = True
        self._configure()
        self.ksp.getPC().setReusePreconditioner(False)
        self.ksp.setFromOptions()

    def ask_for(self, reduction: float) -> None:
        """How far an iterative solve has to reduce the residual, unless an option says so."""
        if not self.direct and not is_given("ksp_rtol"):
            self.ksp.setTolerances(rtol=reduction)

    def set_operators(self) -> None:
        """Give the KSP its operator and the matrix that the preconditioner is made of."""
        self.ksp.setOperators(self.operator, self.matrix.mat)

    def renew_if_tired(self, x: PETSc.Vec, shift: NDArray | None = None) -> None:
        """Before a solve with a new tangent at x, a diagonal (3 n,) added to it: factor it, or keep the preconditioner if its
        last solve was about as quick as its first.
        """
        self.set_operators()
        self.take(x)
        pc = self.ksp.getPC()
        tired = self._fresh_rate is None or self._rate is None or self._rate > TIRED * self._fresh_rate
        pc.setReusePreconditioner(not (tired or self.direct))
        if tired or self.direct:
            self._fresh_rate = None
            self.ksp.setUp()
            pc.setReusePreconditioner(True)
        if tired and not self.direct:
            self._made = x.array_r.copy(), np.zeros_like(x.array_r) if shift is None else shift.copy()

    def note_effort(self, iterations: int, reduction: float) -> None:
        """After a solve: iterations it took for a decade of residual."""
        if self.direct or iterations == 0:
            return
        self._rate = iterations / max(-log10(reduction), 0.5)
        if self._fresh_rate is None:
            self._fresh_rate = self._rate

    def state(self) -> dict[str, Any]:
        """What it keeps from one tangent to the next: a preconditioner, as the state it was made at."""
        kept = None if self.direct or self._made is None else [field(values) for values in self._made]
        return {"fell_back": self._fell_back, "rates": [self._fresh_rate, self._rate], "made": kept}

    def restore(self, state: dict[str, Any], make: Callable[[NDArray, NDArray], None]) -> None:
        """Go on from a state. make(x, shift) has to call `renew_if_tired` with the tangent there, (n, 3) both."""
        if state["fell_back"] and not self.direct:
            self.fall_back_to_direct()
        if state["made"] is not None and not self.direct:
            self._fresh_rate = None
            make(*state["made"])
            self.ksp.setUpOnBlocks()
            self._fresh_rate, self._rate = state["rates"]

    def describe(self) -> str:
        """The solver in words, as it is after the options were read."""
        pc = self.ksp.getPC()
        package = pc.getFactorSolverType() if pc.getType() in ("cholesky", "lu") else None
        kind = "two levels" if pc.getType() == "python" else pc.getType()
        names = [self.ksp.getType(), kind] + ([package] if package else [])
        return f"{' + '.join(names)}, {self.dof} degrees of freedom"

    def take(self, x: PETSc.Vec) -> None:
        """See the matrix, which was filled at x. Collective."""
        if self._two_level is not None and not self.direct:
            self._two_level.take(x)
        if self.ksp.getPC().getType() in ("gamg", "hypre", "ml", "bddc"):
            self._set_rigid_motions(x)

    def _set_rigid_motions(self, x: PETSc.Vec) -> None:
        """Give multigrid the rigid motions of the state x."""
        vectors = []
        for mode in rigid_motions(self.assembly.model, self.assembly.along_axes(x.array_r.reshape(-1, 3))):
            vectors.append(self.assembly.vector())
            vectors[-1].array[:] = mode.ravel()
        rigid = PETSc.NullSpace().create(vectors=vectors, comm=self.assembly.comm)
        self.matrix.mat.setNearNullSpace(rigid)
        for item in (rigid, *vectors):
            item.destroy()

    @property
    def is_cheap_to_factor(self) -> bool:
        """Whether factoring is tried at once where an iterative method fails; else shorter steps are tried first."""
        return self.dof <= CHEAP_TO_FACTOR

    def negative_pivots(self) -> int | None:
        """Of the last factorisation, counted on the way; None where nothing was factored or nobody counted."""
        pc = self.ksp.getPC()
        if not self.direct or pc.getType() != "cholesky" or pc.getFactorSolverType() != "mumps":
            return None
        return int(pc.getFactorMatrix().getMumpsInfog(12))

    def gave_up(self) -> bool:
        """Whether an iterative method failed where a factorisation would go on."""
        return not self.direct and self.ksp.getConvergedReason() < 0


def negative_pivots_of(matrix: PETSc.Mat) -> int | None:
    """Negative pivots of a symmetric matrix by a factorisation made for this answer; None if it fails."""
    ksp = PETSc.KSP().create(matrix.comm)
    ksp.setOperators(matrix)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    pc = ksp.getPC()
    pc.setType(PETSc.PC.Type.CHOLESKY)
    pc.setFactorSolverType("mumps")
    try:
        pc.setUp()
        factor = pc.getFactorMatrix()
        return int(factor.getMumpsInfog(12)) if factor.getMumpsInfog(1) >= 0 else None
    except PETSc.Error:
        return None
    finally:
        ksp.destroy()
