"""The integrators there are, a line each: what a case may ask of one, and where it lives.

Nothing heavy is imported here: case files are checked against this table before PETSc starts.
"""

from __future__ import annotations

from typing import NamedTuple

HOME = "ancf_petsc.motion.integrators"


class Method(NamedTuple):
    """An integrator. home: module and class in motion/integrators. adaptive: it may choose its steps by a tolerance.

    option: the key of [dynamics] that is its own.
    """

    name: str
    home: str
    adaptive: bool = False
    option: str = ""


METHODS = {
    row.name: row
    for row in (
        Method("generalized_alpha", "generalized_alpha.GeneralizedAlpha", option="spectral_radius"),
        Method("energy_momentum", "energy_momentum.EnergyMomentum"),
        Method("central_difference", "central_difference.CentralDifference"),
        Method("runge_kutta_5dp", "runge_kutta.RungeKutta5dp", adaptive=True),
        Method("runge_kutta_4", "runge_kutta.RungeKutta4"),
        Method("rosenbrock", "rosenbrock.Rosenbrock", adaptive=True),
        Method("bdf", "bdf.Bdf", adaptive=True, option="order"),
        Method("theta", "theta.Theta", option="theta"),
    )
}
