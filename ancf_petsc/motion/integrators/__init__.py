"""Integrators, one file each; `input/methods.py` has a line for each."""

from __future__ import annotations

from importlib import import_module

from ancf_petsc.input.methods import HOME, METHODS
from ancf_petsc.motion.integrators.base import Integrator, Settings, Step, steps_in


def integrator(name: str) -> type[Integrator]:
    """The class of an integrator."""
    module, _, kind = METHODS[name].home.partition(".")
    return getattr(import_module(f"{HOME}.{module}"), kind)


__all__ = ["Integrator", "Settings", "Step", "integrator", "steps_in"]
