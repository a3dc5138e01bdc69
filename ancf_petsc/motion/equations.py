"""The equations of motion M (q'' + alpha q') + Q(q) = Q_e(t), Olshevskiy et al. (2017), Eqs. (13) and (16).

Driven degrees of freedom follow their ramps; s = t / duration. Where a ramp has a corner their velocity
jumps, and with the consistent mass the free nodes beside them get their share of the impulse.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.mass import Mass
from ancf_petsc.motion.mass_solver import MassSolver
from ancf_petsc.parallel.exchange import combined


class Equations:
    """Forces and accelerations of a body in motion. damping: alpha in 1 / unit of time.

    outputs: times that a ramp's corner at the same s is passed at. corners: times of all corners, ascending.
    """

    def __init__(
        self, assembly: Assembly, mass: Mass, damping: float, duration: float, outputs: Sequence[float] = ()
    ) -> None:
        self.assembly = assembly
        self.comm = assembly.comm
        self.mass = mass
        self.damping = damping
        self.duration = duration
        self.solver = MassSolver(mass)
        model = assembly.model
        self.is_driven = any(drive.amplitude for drive in model.drives)
        ramps = [drive.ramp for drive in model.drives if drive.amplitude]
        ramps += [load.ramp for load in model.loads]
        # Times and pseudo-times side by side: t / duration may be an ulp before a corner's s, where the rate is another.
        self._knots = [0.0, *sorted({s for ramp in ramps for s in ramp.corners()}), 1.0]
        times = {time / duration: time for time in outputs}
        self.corners = [times.get(s, s * duration) for s in self._knots[1:-1]]
        self._piece = 0
        self._steady = all(load.ramp.kind == "constant" for load in model.loads)
        self._loads = assembly.external_force(0.0)

    @property
    def piece(self) -> int:
        """Of the smooth pieces between corners the one that was entered last, from 0."""
        return self._piece

    @piece.setter
    def piece(self, number: int) -> None:
        self._piece = number

    # --- what is prescribed

    def loads(self, t: float) -> NDArray[np.float64]:
        """Dead loads (n, 3) on the owned nodal vectors."""
        return self._loads if self._steady else self.assembly.external_force(t / self.duration)

    def driven_positions(self, t: float) -> NDArray[np.float64]:
        """Of the driven degrees of freedom (c,), in the order of `assembly.driven`."""
        values = [drive.value(t / self.duration) for drive in self.assembly.model.drives]
        start = self.assembly.start.ravel()[self.assembly.driven]
        return start + np.array(values or [0.0])[self.assembly.driven_by]

    def driven_velocities(self, t: float) -> NDArray[np.float64]:
        """Of the driven degrees of freedom (c,); at the end of a smooth piece those it ends with."""
        s = self._within_piece(t)
        rates = [drive.amplitude * drive.ramp.rate(s) / self.duration for drive in self.assembly.model.drives]
        return np.array(rates or [0.0])[self.assembly.driven_by]

    def driven_accelerations(self, t: float) -> NDArray[np.float64]:
        """Of the driven degrees of freedom (c,)."""
        s = self._within_piece(t)
        rates = [
            drive.amplitude * drive.ramp.curvature(s) / self.duration**2
            for drive in self.assembly.model.drives
        ]
        return np.array(rates or [0.0])[self.assembly.driven_by]

    def place(self, x: PETSc.Vec, v: PETSc.Vec, t: float) -> None:
        """Put the driven degrees of freedom of a state where they belong."""
        driven = self.assembly.driven
        if len(driven):
            x.array[driven] = self.driven_positions(t)
            v.array[driven] = self.driven_velocities(t)

    def pass_corner(self, t: float, v: PETSc.Vec) -> None:
        """Enter the smooth piece after t. Velocities of driven nodes may jump: v then holds those after the
        impulse.
        """
        before = self.driven_velocities(t)
        self._piece = bisect(self.corners, t)
        if not self.is_driven:
            return
        driven = self.assembly.driven
        jump = np.zeros((self.assembly.model.owned, 3))
        jump.ravel()[driven] = self.driven_velocities(t) - before
        if not combined(self.comm, float(np.abs(jump).max(initial=0.0))):
            return
        change = jump - self.solver.solve(self.mass.times(jump))
        v.array[:] += change.ravel()

    def _within_piece(self, t: float) -> float:
        """The s of a time, from the corner passed last to just before the next."""
        begin, end = self._knots[self._piece : self._piece + 2]
        return min(max(t / self.duration, begin), float(np.nextafter(end, 0.0)))

    # --- what follows

    def acceleration(self, t: float, x: PETSc.Vec, v: NDArray) -> NDArray[np.float64]:
        """q'' (n, 3) of a state whose driven degrees of freedom are in place; v (n, 3). Collective."""
        force = self.loads(t) - self.assembly.internal_force(x)[0]
        driven = self.assembly.driven
        if not self.is_driven:
            result = self.solver.solve(force)
            if self.damping:
                result -= self.damping * v
                result.ravel()[driven] = 0.0
            return result
        given = np.zeros_like(force)
        accelerations = self.driven_accelerations(t)
        given.ravel()[driven] = accelerations + self.damping * v.ravel()[driven]
        result = self.solver.solve(force - self.mass.times(given)) - self.damping * v
        result.ravel()[driven] = accelerations
        return result

    def out_of_balance(self, t: float, x: PETSc.Vec, v: NDArray, a: NDArray) -> NDArray[np.float64]:
        """M (q'' + alpha q') + Q - Q_e (n, 3): reactions where driven. Collective."""
        inertia = self.mass.times(a + self.damping * v)
        return inertia + self.assembly.internal_force(x)[0] - self.loads(t)

    def highest_frequency(self, x: PETSc.Vec, iterations: int = 30) -> float:
        """Estimate of the largest omega of M^-1 K at x in rad / unit of time, some percent on the safe
        side. Collective.

        Power iteration approaches it from below, to 3 % on the meshes tried: 5 % are added.
        """
        model, n = self.assembly.model, self.assembly.model.owned
        seed = model.numbering.file_nodes[:n, None] * 3.0 + np.arange(3)
        field = self.solver.free * np.sin(12.9898 * seed + 1.0)
        direction, omega = self.assembly.vector(), 0.0
        for _ in range(iterations):
            carried = self.mass.times(field)
            length = np.sqrt(combined(self.comm, float(np.vdot(field, carried))))
            if length == 0.0:
                break
            direction.array[:] = (field / length).ravel()
            field = self.solver.solve(self.assembly.tangent_product(x, direction))
            along = combined(self.comm, float(np.vdot(field, carried))) / length
            omega = float(np.sqrt(max(along, 0.0)))
        direction.destroy()
        return 1.05 * omega
