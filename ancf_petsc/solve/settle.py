"""Damped motion from a state that is none of equilibrium to the equilibrium it comes to rest at, load and supports at rest.

The motion is M dq/dt = Q_e - Q(q), what M (q'' + a q') = Q_e - Q(q) becomes where damping outweighs inertia: the body sinks along
its potential energy and never swings past a state of rest. Only the path counts, so that the unit of t, and with it the size of
M, is free: M is the diagonal of the mass of unit density, or of the case's where every material has one. Steps are those of
Euler's implicit method, as short as the tangent plus M over the step stays positive definite, longer and longer towards the
end, where they become Newton's: pseudo-transient continuation, C. T. Kelley and D. E. Keyes, SIAM J. Numer. Anal. 35 (1998) 508.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.errors import Interrupted
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.mass import Mass
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.critical import CLOSE, Watch
from ancf_petsc.solve.events import signed
from ancf_petsc.solve.newton import Newton

MOST_STEPS, MOST_ITERATIONS = 2000, 6
LONGEST = 0.02
"""Of the body's size: no step moves a node farther."""
STIFF, SLOWEST = 0.1, 1e9
"""M over the first step, and over the shortest one, in parts of the tangent's diagonal."""
CLOSE_ENOUGH = 1e-2
"""Of the out-of-balance force a step begins with: a step is solved when it is as small."""
CALM = 1e-3
"""Out-of-balance force over the force scale: Newton's method is tried from there on."""
PUSH = 1e-4
"""Of the body's size: how far a state of rest that is not stable is left along its mode."""
GROWTH = 3.0


@dataclass(frozen=True)
class Settled:
    """steps: how many the motion took. lowest: the lowest eigenvalue where it rests."""

    steps: int
    lowest: float


def settle(
    newton: Newton, watch: Watch, s: float, x: PETSc.Vec, interrupted: Callable[[], bool] = lambda: False
) -> Settled | None:
    """Bring x, whose driven degrees of freedom are those of s, to rest. None where it does not come to rest; x is garbage then.
    Raises Interrupted. Collective.
    """
    newton.set_pseudo_time(s)
    return _Motion(newton, watch, s).to_rest(x, interrupted)


class _Motion:
    def __init__(self, newton: Newton, watch: Watch, s: float) -> None:
        self.newton, self.watch, self.s = newton, watch, s
        self.assembly, self.comm = newton.assembly, newton.comm
        self.mass = np.repeat(_mass(newton.assembly), 3)
        self.mass[newton.assembly.driven] = 0.0

    def to_rest(self, x: PETSc.Vec, interrupted: Callable[[], bool]) -> Settled | None:
        stiffness = self._stiffness(x)
        rate, fastest = (
            STIFF * stiffness,
            SLOWEST * stiffness,
        )  # M times it is added to the tangent: 1 over the step
        for step in range(1, MOST_STEPS + 1):
            if interrupted():
                raise Interrupted(
                    f"stopped while the body settles at pseudo-time {self.s:.6g}; all before is saved"
                )
            iterations = self._step(x, rate)
            while iterations is None:
                rate *= 4.0
                if rate > fastest:
                    return None
                iterations = self._step(x, rate)
            rate /= GROWTH if iterations <= 2 else 1.5 if iterations <= 4 else 1.0
            _, relative = self.newton.residual_at(x)
            if relative < CALM and (lowest := self._rests(x)) is not None:
                if lowest > 0.0:
                    return Settled(step, lowest)
                rate = STIFF * stiffness
        return None

    def _step(self, x: PETSc.Vec, rate: float) -> int | None:
        """One step with M times `rate`: iterations it took; None where it is too long, and x is as before."""
        newton = self.newton
        start = x.array_r.copy()
        first = np.inf
        for iteration in range(MOST_ITERATIONS + 1):
            residual, _ = newton.residual_at(x)
            residual = residual + rate * self.mass * (x.array_r - start)
            norm = self._norm(residual)
            if not np.isfinite(norm) or norm > 10.0 * first:
                break
            if iteration == 0:
                first = norm
            elif norm <= CLOSE_ENOUGH * first or self._is_at_rest(norm):
                return iteration
            if iteration == MOST_ITERATIONS or not self._correct(x, residual, rate):
                break
            if self._largest(x.array_r - start) > LONGEST * self.assembly.model.size:
                break
        x.array[:] = start
        return None

    def _correct(self, x: PETSc.Vec, residual: NDArray, rate: float) -> bool:
        """Newton's step; False where the tangent plus M times the rate is not positive definite."""
        newton, linear = self.newton, self.newton.linear
        newton.tangent_at(x, rate * self.mass)
        rhs, change = self.assembly.vector(), self.assembly.vector()
        rhs.array[:] = -residual
        linear.ask_for(1e-3)
        linear.ksp.solve(rhs, change)
        good = not linear.gave_up() and not linear.negative_pivots()
        if good:
            x.axpy(1.0, change)
        elif linear.gave_up() and linear.is_cheap_to_factor:
            newton.factor_from_now_on(self.s)
        rhs.destroy()
        change.destroy()
        return good

    def _rests(self, x: PETSc.Vec) -> float | None:
        """The lowest eigenvalue where Newton's method finds equilibrium beside x, which it becomes; 0 where that is not stable, and
        x is pushed along its mode; None where there is none.
        """
        trial = x.copy()
        found = self.newton.solve(self.s, trial).converged
        moved = self._largest(trial.array_r - x.array_r)
        if not found or moved > LONGEST * self.assembly.model.size:
            trial.destroy()
            return None
        self.newton.tangent_at(trial)
        lowest = self.watch.lowest.look(CLOSE)
        trial.copy(x)
        trial.destroy()
        if self.watch.count(lowest) != 0:
            mode = signed(self.assembly, self.watch.lowest.mode).ravel()
            x.array[:] += PUSH * self.assembly.model.size / self._largest(mode) * mode
            return 0.0
        return max(float(lowest), float(np.finfo(float).tiny))

    def _stiffness(self, x: PETSc.Vec) -> float:
        """The mean of the tangent's diagonal over that of M."""
        self.newton.tangent_at(x)
        diagonal = np.abs(self.newton.matrix.mat.getDiagonal().array_r)
        free = self.mass > 0.0
        above, below = combined(self.comm, np.array([diagonal[free].sum(), self.mass[free].sum()]))
        return float(above / below)

    def _is_at_rest(self, norm: float) -> bool:
        return norm <= 0.1 * self.newton.tolerance * self.newton.force_scale()

    def _norm(self, values: NDArray) -> float:
        return float(np.sqrt(combined(self.comm, float(values @ values))))

    def _largest(self, values: NDArray) -> float:
        return max(self.comm.allgather(float(np.abs(values).max(initial=0.0))))


def _mass(assembly: Assembly) -> NDArray[np.float64]:
    """Diagonal of the mass (n,) of owned nodal vectors. Collective."""
    model = assembly.model
    if any(region.density is None for region in model.regions):
        model = replace(model, regions=tuple(replace(region, density=1.0) for region in model.regions))
        assembly = Assembly(model)
    return Mass(assembly).diagonal
