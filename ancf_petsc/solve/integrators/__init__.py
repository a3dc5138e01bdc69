"""The integrators there are: one file and one line each."""

from __future__ import annotations

from importlib import import_module

from ancf_petsc.solve.integrators.base import Integrator, Settings, Step

INTEGRATORS = {
    "generalized_alpha": "generalized_alpha.GeneralizedAlpha",
    "energy_momentum": "energy_momentum.EnergyMomentum",
    "runge_kutta_5dp": "runge_kutta.RungeKutta5dp",
    "runge_kutta_4": "runge_kutta.RungeKutta4",
    "rosenbrock": "rosenbrock.Rosenbrock",
    "bdf": "bdf.Bdf",
    "theta": "theta.Theta",
}


def integrator(name: str) -> type[Integrator]:
    """The class of an integrator."""
    module, _, kind = INTEGRATORS[name].partition(".")
    return getattr(import_module(f"{__name__}.{module}"), kind)


__all__ = ["INTEGRATORS", "Integrator", "Settings", "Step", "integrator"]
