"""Equilibrium at one pseudo-time: PETSc's SNES on the free degrees of freedom.

A trial state with det F <= 0 or a non-finite force gives NaN, which ends a solve by whole steps; a line search answers with a
shorter one. Such a state is never accepted. Convergence: |R| <= tolerance x max(|reactions|, |loads|, rounding floor).
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.forcing import Forcing
from ancf_petsc.solve.linear.solver import LinearSolver
from ancf_petsc.solve.petsc import NOT_FINITE, default_options, is_given, keep_preconditioner
from ancf_petsc.solve.step_control import StepControl

log = logging.getLogger("ancf")
MOST_ITERATIONS = 25
QUICK, CAREFUL = "basic", "bt"
"""PETSc's line searches: whole steps of Newton's method; those cut back to where the out-of-balance force falls."""
PREDICTOR_TERM = 1e-8  # the path's slope is made of it, and extrapolated from
Reason = PETSc.SNES.ConvergedReason
WORDS = {
    NOT_FINITE: "a state with det F <= 0 or forces that are not finite was met",
    Reason.DIVERGED_MAX_IT: f"no convergence in {MOST_ITERATIONS} iterations",
    Reason.DIVERGED_LINE_SEARCH: "no step along Newton's direction lowers the out-of-balance force",
    Reason.DIVERGED_LINEAR_SOLVE: "the linear solver failed",
}


@dataclass(frozen=True)
class Outcome:
    """What one Newton solve did, with its predictor. residuals: out-of-balance force over the force scale, one an iteration."""

    converged: bool
    reason: str
    newton: int
    linear: int
    residuals: tuple[float, ...]


class Newton:
    """Solves Q(x) = Q_e(s) for the free degrees of freedom, the driven ones being in place. control: what was changed on the
    way.
    """

    def __init__(self, assembly: Assembly, tolerance: float) -> None:
        self.assembly = assembly
        self.comm = assembly.comm
        self.tolerance = tolerance
        self.control = StepControl()
        self.matrix = assembly.create_matrix()
        self._external = assembly.external_force(0.0)
        self._residuals: list[float] = []
        self._shift: NDArray | None = None
        self._supported = (0.0, 0.0)
        self.can_be_careful = not is_given("snes_linesearch_type") and not is_given("snes_type")
        self._snes, self._careful = self._create(), self._create()
        self._careful.setKSP(self._snes.getKSP())
        self.linear = LinearSolver(assembly, self.matrix, self._snes.getKSP())
        # Preconditioners are renewed by hand, after each tangent, never by SNES.
        for snes, search in ((self._careful, CAREFUL), (self._snes, QUICK)):
            snes.setJacobian(self._tangent, self.linear.operator, self.matrix.mat)
            with default_options({"snes_linesearch_type": search}):
                snes.setFromOptions()
            keep_preconditioner(snes)
        self.linear.read_options()
        self._predicting = 0
        self._forcing = Forcing(tolerance)
        self._term = PREDICTOR_TERM

    def _create(self) -> PETSc.SNES:
        snes = PETSc.SNES().create(self.comm)
        snes.setType(PETSc.SNES.Type.NEWTONLS)
        snes.setFunction(self._residual, self.assembly.vector())
        snes.setConvergenceTest(self._test)
        snes.setTolerances(max_it=MOST_ITERATIONS)
        return snes

    def destroy(self) -> None:
        """Free PETSc's objects."""
        self.linear.destroy()
        self._careful.destroy()
        self._snes.destroy()
        self.matrix.destroy()

    def prepare(self) -> None:
        """Set the linear solver up on the undeformed body, so that every option has been asked for."""
        x = self.assembly.reference_vector()
        self.tangent_at(x)
        self._snes.setUp()
        self.linear.ksp.setUp()
        x.destroy()

    def factor_from_now_on(self, s: float, why: str = "the tangent is not positive definite") -> None:
        """Leave iterative linear solvers, at pseudo-time s."""
        if not self.linear.direct:
            log.info("  %s: factoring from now on", why)
            self.control.note("factored", why, s)
        self.linear.fall_back_to_direct()

    def set_pseudo_time(self, s: float) -> None:
        """Loads as they are at s."""
        self._external = self.assembly.external_force(s)

    def solve(self, s: float, x: PETSc.Vec, *, careful: bool = False) -> Outcome:
        """Bring x, whose driven degrees of freedom are those of s, to equilibrium. x is garbage if it fails.

        careful: with a line search that only takes steps which lower the out-of-balance force. Slender bodies have to pass
        states of a larger one: what bends stretches first.
        """
        snes = self._careful if careful else self._snes
        self.set_pseudo_time(s)
        self._residuals = []
        self._forcing.start()
        snes.solve(None, x)
        reason = snes.getConvergedReason()
        before, self._predicting = self._predicting, 0
        return Outcome(
            converged=reason > 0,
            reason=WORDS.get(reason, f"PETSc's reason {reason}"),
            newton=snes.getIterationNumber(),
            linear=before + snes.getLinearSolveIterations(),
            residuals=tuple(self._residuals),
        )

    def state(self) -> dict[str, Any]:
        """What is carried from one solve to the next."""
        return {
            "curvature": self._forcing.curvature,
            "term": self._term,
            "largest_diagonal": self.matrix.largest_diagonal,
            "linear": self.linear.state(),
            "control": self.control.state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state. Collective."""
        x = self.assembly.vector()

        def make(at: NDArray, shift: NDArray) -> None:
            x.array[:] = at.ravel()
            self.tangent_at(x, shift.ravel())

        self.linear.restore(state["linear"], make)
        x.destroy()
        self.control.restore(state["control"])
        self._forcing.curvature, self._term = state["curvature"], state["term"]
        self.matrix.largest_diagonal = state["largest_diagonal"]

    def predict(self, x: PETSc.Vec, s: float, target: float) -> bool:
        """Move x from equilibrium at s by the tangent to `target`. Returns whether the linear solve succeeded."""
        assembly = self.assembly
        rhs, increment = self.push(x, s, target)
        self._term = PREDICTOR_TERM
        self.tangent_at(x)
        ksp = self.linear.ksp
        step = assembly.vector()
        ksp.solve(rhs, step)
        good = ksp.getConvergedReason() > 0
        self._predicting += ksp.getIterationNumber()
        self.linear.note_effort(ksp.getIterationNumber(), self._term)
        x.axpy(1.0, step)
        x.axpy(1.0, increment)
        assembly.set_driven(x, target)
        for vector in (increment, rhs, step):
            vector.destroy()
        return good

    def push(self, x: PETSc.Vec, s: float, target: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        """What drives the free degrees of freedom on from s, by the tangent at x, and the increment of the driven ones."""
        assembly = self.assembly
        increment, rhs = assembly.vector(), assembly.vector()
        before = x.array_r.copy()
        assembly.set_driven(x, target)
        increment.array[:] = x.array_r - before
        x.array[:] = before
        load = assembly.external_force(target) - assembly.external_force(s)
        rhs.array[:] = (load - assembly.tangent_product(x, increment)).ravel()
        rhs.array[assembly.driven] = 0.0
        return rhs, increment

    def tangent_at(self, x: PETSc.Vec, shift: NDArray | None = None) -> None:
        """Make the linear solver ready for the tangent at x, a diagonal (3 n,) added to it. Collective."""
        self._shift = shift
        self._tangent(self._snes, x, self.linear.operator, self.matrix.mat)
        self._shift = None

    def residual_at(self, x: PETSc.Vec) -> tuple[NDArray, float]:
        """Out-of-balance force (3 n,) of the free degrees of freedom, nan for a state that cannot be, and over the force
        scale. Collective.
        """
        values = self.assembly.vector()
        self._residual(self._snes, x, values)
        scale, norm = self.force_scale(), values.norm()
        found = values.array_r.copy()
        values.destroy()
        return found, norm / scale if scale else 0.0

    def out_of_balance(self, x: PETSc.Vec):
        """Q - Q_e (n, 3) on owned nodal vectors at the present pseudo-time: reactions where driven."""
        force, _ = self.assembly.internal_force(x)
        return force - self._external

    # --- SNES's callbacks

    def _residual(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        force, smallest = self.assembly.internal_force(x)
        values = (force - self._external).ravel()
        driven = self.assembly.driven
        reactions, loads = values[driven], self._external.ravel()
        self._supported = (float(reactions @ reactions), float(loads @ loads))
        values[driven] = 0.0
        f.array[:] = values if smallest > 0.0 else np.nan

    def _tangent(self, snes: PETSc.SNES, x: PETSc.Vec, J: PETSc.Mat, P: PETSc.Mat) -> None:
        self.matrix.clear()
        if self._shift is not None:
            self.matrix.add_diagonal(self._shift)
        self.assembly.add_tangent(x, self.matrix)
        self.matrix.finish()
        self.linear.renew_if_tired(x, self._shift)
        self.linear.ask_for(self._term)

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        residual = norms[2]
        if not np.isfinite(residual):
            return NOT_FINITE
        scale = self.force_scale()
        relative = residual / scale if scale else 0.0
        if iteration:
            self.linear.note_effort(self.linear.ksp.getIterationNumber(), self._term)
            self._forcing.learn(relative)
        self._residuals.append(relative)
        if relative <= self.tolerance:
            return Reason.CONVERGED_FNORM_RELATIVE
        self._term = self._forcing.term(relative)
        return Reason.ITERATING

    def force_scale(self) -> float:
        """The largest of the norms of reactions and loads, and what rounding leaves of the tangent times the size; of the state
        that forces were taken at last. Collective.
        """
        reactions, loads = np.sqrt(combined(self.comm, np.array(self._supported)))
        floor = 1e-14 * self.matrix.largest_diagonal * self.assembly.model.size
        return max(reactions, loads, floor / self.tolerance)
