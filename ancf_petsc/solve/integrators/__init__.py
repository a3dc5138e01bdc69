"""Integrators, one file each; `solve/methods.py` has a line for each."""

from __future__ import annotations

from importlib import import_module

from ancf_petsc.solve.integrators.base import Integrator, Settings, Step
from ancf_petsc.solve.methods import HOME, METHODS


def integrator(name: str) -> type[Integrator]:
    """The class of an integrator."""
    module, _, kind = METHODS[name].home.partition(".")
    return getattr(import_module(f"{HOME}.{module}"), kind)


__all__ = ["Integrator", "Settings", "Step", "integrator"]
