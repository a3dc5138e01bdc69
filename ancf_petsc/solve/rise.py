"""Loads and moves brought up in proportion: the state of rest that a path begins with, or that a body vibrates about."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from petsc4py import PETSc

from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.model import Model
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.solve.load_path import LoadPath
from ancf_petsc.solve.marks import Marks, PathStep
from ancf_petsc.solve.newton import Newton


def begins_loaded(model: Model) -> bool:
    """Whether loads or moves are not zero where pseudo-time begins."""
    return any(drive.value(0.0) for drive in model.drives) or any(
        load.ramp.value(0.0) for load in model.loads
    )


def rising(model: Model, s: float) -> Model:
    """The same body, its loads and moves growing in proportion to what they are at pseudo-time s."""
    linear = Ramp("linear")
    loads = [replace(load, pattern=load.ramp.value(s) * load.pattern, ramp=linear) for load in model.loads]
    drives = [
        replace(drive, amplitude=drive.value(s), ramp=linear) if drive.amplitude else drive
        for drive in model.drives
    ]
    return replace(model, loads=loads, drives=drives)


class Rise:
    """The path of a body of `rising`, from the undeformed state; arguments of `run` as those of LoadPath."""

    def __init__(self, model: Model, tolerance: float) -> None:
        self.newton = Newton(Assembly(model), tolerance)

    def run(
        self,
        outputs: Sequence[float],
        smallest_step: float,
        on_step: Callable[[PathStep, PETSc.Vec], None] = lambda step, x: None,
        begin: Callable[[LoadPath], None] = lambda path: None,
        **more,
    ) -> PETSc.Vec:
        """The state at its end. begin: sees the path before its first step. Raises NoEquilibrium. Collective."""
        path = LoadPath(self.newton, Marks.of(outputs, ()), smallest_step, on_step, **more)
        try:
            begin(path)
            path.run()
        finally:
            self.newton.destroy()
        return path.x
