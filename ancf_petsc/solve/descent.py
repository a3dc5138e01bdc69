"""The stable equilibrium beside an unstable one: down the potential energy, first along the mode that falls.

Directions are Newton's with the tangent made positive definite by a multiple of D (`lowest`); a step is taken where the
potential energy falls, or, where its change is lost in rounding, the out-of-balance force.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.critical import CLOSE, Watch
from ancf_petsc.solve.newton import Newton

FIRST_PUSH = 1e-3
"""Of the body's size: how far the mode is followed at first."""
MOST_ITERATIONS, LONGEST = 400, 0.05
FLAT = 1e-7
"""Out-of-balance force over the force scale: a saddle is reached, and left along its mode."""


def stable_neighbour(newton: Newton, watch: Watch, s: float, x: PETSc.Vec, mode: NDArray) -> float | None:
    """Bring x from near an unstable equilibrium at s to a stable one. Returns its lowest eigenvalue; None if there is
    none within reach, and x is garbage then. mode (n, 3): with the sign to go. Collective.
    """
    potential = _Potential(newton, s)
    potential.follow_mode(x, mode)
    for _ in range(MOST_ITERATIONS):
        residual, relative = newton.residual_at(x)
        newton.tangent_at(x)
        value = watch.lowest.look(CLOSE)
        definite = not newton.linear.negative_pivots()
        if watch.count(value) == 0 and relative <= newton.tolerance:
            return value
        if not definite and relative < FLAT:
            potential.follow_mode(x, watch.lowest.mode)
            continue
        if not definite and not _make_definite(newton, watch, x, value):
            return None
        if not potential.step(x, residual):
            return None
    return None


def _make_definite(newton: Newton, watch: Watch, x: PETSc.Vec, value: float) -> bool:
    """Make the linear solver ready for the tangent at x plus as much of D as it takes."""
    shift = 1.5 * abs(value)
    for _ in range(12):
        newton.tangent_at(x, shift * watch.lowest.scale)
        if not newton.linear.negative_pivots():
            return True
        shift *= 3.0
    return False


class _Potential:
    """The potential energy at pseudo-time s."""

    def __init__(self, newton: Newton, s: float) -> None:
        self.newton, self.assembly = newton, newton.assembly
        newton.set_pseudo_time(s)
        self._load = self.assembly.external_force(s)

    def energy(self, x: PETSc.Vec) -> float:
        """inf where a cell is inside out."""
        comm = self.assembly.comm
        if not self.assembly.smallest_det(x) > 0.0:
            return np.inf
        moved = x.array_r.reshape(-1, 3) - self.assembly.start
        return self.assembly.strain_energy(x) - combined(comm, float(np.vdot(self._load, moved)))

    def follow_mode(self, x: PETSc.Vec, mode: NDArray) -> None:
        """Move x along the mode (n, 3) as far as the energy falls, in steps that double."""
        comm, model = self.assembly.comm, self.assembly.model
        largest = max(comm.allgather(float(np.abs(mode).max(initial=0.0))))
        unit = FIRST_PUSH * model.size / largest * mode.ravel()
        start, energy, length = x.array_r.copy(), self.energy(x), 1.0
        x.array[:] = start + unit
        while length * FIRST_PUSH < LONGEST:
            x.array[:] = start + 2 * length * unit
            found = self.energy(x)
            if not found < energy:
                x.array[:] = start + length * unit
                return
            energy, length = found, 2 * length

    def step(self, x: PETSc.Vec, residual: NDArray) -> bool:
        """One step with what the linear solver holds, cut back until the energy or the residual falls enough."""
        assembly, comm = self.assembly, self.assembly.comm
        rhs, direction = assembly.vector(), assembly.vector()
        rhs.array[:] = -residual
        self.newton.linear.ksp.solve(rhs, direction)
        longest = max(comm.allgather(float(np.abs(direction.array_r).max(initial=0.0))))
        slope = combined(comm, float(residual @ direction.array_r))
        norm = combined(comm, float(residual @ residual))
        start, before = x.array_r.copy(), self.energy(x)
        part = min(1.0, LONGEST * assembly.model.size / longest) if longest else 1.0
        taken = False
        while part > 1e-6 and not taken:
            x.array[:] = start + part * direction.array_r
            after = self.energy(x)
            taken = after <= before + 1e-4 * part * slope
            if not taken and abs(after - before) <= 1e-13 * abs(before):
                now, _ = self.newton.residual_at(x)
                taken = combined(comm, float(now @ now)) < norm
            part /= 2
        rhs.destroy()
        direction.destroy()
        return taken
