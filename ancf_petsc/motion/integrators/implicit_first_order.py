"""Implicit methods of PETSc on y = (x, v): F = (x' - v, M (v' + alpha v) + Q(x) - Q_e(t)) = 0.

PETSc asks for the solution of [shift, -1; K, (shift + alpha) M] (dx, dv) = (r, s). Eliminating dv leaves a
system of the size of statics, K + shift (shift + alpha) M, which the linear solver of the tangent handles.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.motion.equations import Equations
from ancf_petsc.motion.increment import MOST_ITERATIONS, ForceTest
from ancf_petsc.motion.integrators.base import Settings
from ancf_petsc.motion.integrators.first_order import FirstOrder
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.parallel.fields import field
from ancf_petsc.solve.linear.solver import LinearSolver
from ancf_petsc.solve.petsc import default_options

SAME_SHIFT = 1e-9  # relative: equal steps differ by rounding


class ImplicitFirstOrder(FirstOrder):
    """A subclass names PETSc's type and its options. keeps_matrix: whether Newton mends what an old matrix
    does badly. solves: False while steps are to leave the solution as it is.
    """

    type_name: str
    keeps_matrix = True
    solves = True
    relative = 1e-9

    def __init__(self, equations: Equations, settings: Settings, x: PETSc.Vec, v: PETSc.Vec) -> None:
        super().__init__(equations, settings, x, v)
        self.matrix = equations.assembly.create_matrix()
        self._made: NDArray | None = None  # positions that the matrix was made at
        self._eliminated = _Eliminated(self)
        self.jacobian = PETSc.Mat().createPython(
            (self.y.getSizes(),) * 2, self._eliminated, comm=equations.comm
        )
        self.jacobian.setUp()
        self.test = ForceTest(self.matrix, x)
        self.ts.setType(self.type_name)
        self.ts.setIFunction(self._function, self.y.duplicate())
        self.ts.setIJacobian(self._derivative, self.jacobian)
        self.ts.setMaxSNESFailures(-1 if self.adaptive else 1)
        snes = self.ts.getSNES()
        snes.setTolerances(rtol=self.relative, atol=0.0, max_it=MOST_ITERATIONS)
        snes.setConvergenceTest(self._converged)
        outer = snes.getKSP()
        outer.setOptionsPrefix("system_")
        outer.setType(PETSc.KSP.Type.PREONLY)
        outer.getPC().setType(PETSc.PC.Type.PYTHON)
        outer.getPC().setPythonContext(self._eliminated)
        adapt = {"ts_adapt_type": "basic" if self.adaptive else "none", "snes_linesearch_type": "basic"}
        with default_options({**adapt, **self.options()}):
            self.ts.setFromOptions()
        self.begin(0.01 * equations.duration if self.adaptive else settings.step)

    def options(self) -> Mapping[str, object]:
        """Options of the type that have no binding."""
        return {}

    def set_solver_up(self) -> None:
        self._fill(self.y, 0.0, 1.0 / self.ts.getTimeStep())
        self._eliminated.linear.set_operators()
        self._eliminated.ksp.setUp()
        self.ts.setUp()
        self.test.aged = True

    def describe(self) -> str:
        return f"{super().describe()}, {self._eliminated.linear.describe()}"

    def destroy(self) -> None:
        super().destroy()
        for item in (self._eliminated.linear, self.jacobian, self._eliminated.ksp, self.matrix):
            item.destroy()

    def state(self) -> dict[str, Any]:
        made = None if self._made is None else field(self._made)
        return {**super().state(), "aged": self.test.aged, "shift": self._eliminated.shift, "made": made}

    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state)
        if state["made"] is not None and self.keeps_matrix:
            x = self.equations.assembly.vector()
            x.array[:] = state["made"].ravel()
            self._fill_at(x, state["shift"])
            x.destroy()
        self.test.aged = state["aged"]

    def _function(self, ts: PETSc.TS, t: float, y: PETSc.Vec, rate: PETSc.Vec, f: PETSc.Vec) -> None:
        if not self.solves:
            f.set(0.0)
            return
        equations, n = self.equations, self._own
        x, v = self.stage(y, t)
        given = rate.array_r[n:].reshape(-1, 3) + equations.damping * v
        driven = equations.assembly.driven
        if equations.is_driven:
            given.ravel()[driven] = equations.driven_accelerations(t) + equations.damping * v.ravel()[driven]
        inertia, loads = equations.mass.times(given), equations.loads(t)
        internal, _ = equations.assembly.internal_force(x)
        values = f.array
        values[:n] = rate.array_r[:n] - v.ravel()
        values[n:] = (inertia + internal - loads).ravel()
        self.test.note_scale(float(sum(np.vdot(force, force) for force in (inertia, internal, loads))))
        values[driven] = rate.array_r[driven]
        values[n + driven] = rate.array_r[n + driven]

    def _derivative(self, ts, t, y, rate, shift, J: PETSc.Mat, P: PETSc.Mat) -> None:
        same = abs(shift - self._eliminated.shift) <= SAME_SHIFT * shift
        if not same or self.test.aged or not self.keeps_matrix:
            self._fill(y, t, shift)
        P.stateIncrease()

    def _fill(self, y: PETSc.Vec, t: float, shift: float) -> None:
        self._fill_at(self.stage(y, t)[0], shift)

    def _fill_at(self, x: PETSc.Vec, shift: float) -> None:
        self._made = x.array_r.copy()
        self._eliminated.shift = shift
        self.matrix.clear()
        self.equations.assembly.add_tangent(x, self.matrix)
        self.equations.mass.add_to(self.matrix, shift * (shift + self.equations.damping))
        self.matrix.finish()
        self._eliminated.linear.take(x)
        self.test.aged = False

    def _converged(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        """By the forces alone: after the first iteration x' = v holds to rounding."""
        if not self.solves:
            return PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE
        values = snes.getFunction()[0].array_r[self._own :]
        if iteration == 0:
            self.test.begin()
            return PETSc.SNES.ConvergedReason.ITERATING
        norm = float(np.sqrt(combined(self.equations.comm, float(values @ values))))
        return self.test(snes, iteration, (norms[0], norms[1], norm))


class _Eliminated:
    """The matrix of the system and its exact preconditioner."""

    def __init__(self, owner: ImplicitFirstOrder) -> None:
        self.owner = owner
        self.shift = 0.0
        assembly = owner.equations.assembly
        self.ksp = PETSc.KSP().create(assembly.comm)
        self.linear = LinearSolver(assembly, owner.matrix, self.ksp, with_mass=True)
        self.ksp.setFromOptions()
        self._right, self._answer = assembly.vector(), assembly.vector()

    def mult(self, A: PETSc.Mat, y: PETSc.Vec, f: PETSc.Vec) -> None:
        """The product, for Krylov methods an option may ask for."""
        n, dy = self.owner._own, y.array_r
        f.array[:n] = self.shift * dy[:n] - dy[n:]
        self._right.array[:] = dy[:n]
        self.owner.matrix.mat.mult(self._right, self._answer)
        rest = (self.shift + self.owner.equations.damping) * (dy[n:] - self.shift * dy[:n])
        f.array[n:] = self._answer.array_r + self._free(self._mass(rest))
        rows = self._driven_rows()
        f.array[rows] = self.shift * dy[rows]

    def apply(self, pc: PETSc.PC, f: PETSc.Vec, y: PETSc.Vec) -> None:
        n, given = self.owner._own, f.array_r
        equations = self.owner.equations
        r, s = given[:n].copy(), given[n:]
        r[equations.assembly.driven] = 0.0
        right = s + (self.shift + equations.damping) * self._mass(r)
        self._right.array[:] = self._free(right)
        self.linear.set_operators()
        self.ksp.solve(self._right, self._answer)
        dx = self._answer.array_r
        y.array[:n], y.array[n:] = dx, self.shift * dx - r
        # Left out, driven entries keep what a method extrapolates, and its rounding grows from step to step.
        rows = self._driven_rows()
        y.array[rows] = given[rows] / self.shift

    def _driven_rows(self) -> NDArray:
        """Of y: their equation is y' = 0."""
        driven = self.owner.equations.assembly.driven
        return np.concatenate((driven, self.owner._own + driven))

    def _mass(self, values: NDArray) -> NDArray:
        return self.owner.equations.mass.times(values.reshape(-1, 3)).ravel()

    def _free(self, values: NDArray) -> NDArray:
        """The same with zeros at driven degrees of freedom."""
        result = values.copy()
        result[self.owner.equations.assembly.driven] = 0.0
        return result
