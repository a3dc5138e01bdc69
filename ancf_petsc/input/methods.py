"""The integrators there are, a line each: what a case may ask of one, and where it lives.

Nothing heavy is imported here: case files are checked against this table before PETSc starts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

HOME = "ancf_petsc.motion.integrators"


class Option(NamedTuple):
    """A key of [dynamics] that one integrator reads. expected, default, least, most: as in input/schema."""

    name: str
    expected: str
    default: float
    least: float
    most: float


class Method(NamedTuple):
    """An integrator. home: module and class in motion/integrators. adaptive: it may choose its steps by a tolerance.

    option: the key of [dynamics] that is its own. tolerance: what it takes where the case says neither step nor tolerance.
    conserves: it keeps the energy to the tolerance of Newton, by the laws' kernels between two states. order: of its error in
    the step, from the value of its own key; None where it is not known.
    """

    name: str
    home: str
    adaptive: bool = False
    option: Option | None = None
    tolerance: float | None = None
    conserves: bool = False
    order: Callable[[float], int | None] = lambda option: None


RADIUS = Option("spectral_radius", "a number in [0, 1]; such as 0.8", 0.8, 0, 1)
THETA = Option("theta", "a number in [0.5, 1]; 0.5 is the trapezoidal rule", 0.5, 0.5, 1)
ORDER = Option("order", "1 or 2; orders above 2 are unstable for undamped structures", 2, 1, 2)


def _second(option: float) -> int:
    return 2


METHODS = {
    row.name: row
    for row in (
        Method("generalized_alpha", "generalized_alpha.GeneralizedAlpha", option=RADIUS, order=_second),
        Method("energy_momentum", "energy_momentum.EnergyMomentum", conserves=True, order=_second),
        Method("central_difference", "central_difference.CentralDifference", order=_second),
        Method(
            "runge_kutta_5dp", "runge_kutta.RungeKutta5dp", adaptive=True, tolerance=1e-7, order=lambda _: 5
        ),
        Method("runge_kutta_4", "runge_kutta.RungeKutta4", order=lambda _: 4),
        Method("rosenbrock", "rosenbrock.Rosenbrock", adaptive=True, order=lambda _: 3),
        Method("bdf", "bdf.Bdf", adaptive=True, option=ORDER, order=int),
        Method("theta", "theta.Theta", option=THETA, order=lambda theta: 2 if theta == 0.5 else 1),
    )
}
