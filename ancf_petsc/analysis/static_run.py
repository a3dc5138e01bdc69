"""A quasi-static run: the load path with its log lines and outputs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.record import COUNTS, Record
from ancf_petsc.errors import Interrupted, NoEquilibrium
from ancf_petsc.log import STEPS
from ancf_petsc.model.measures import conjugates
from ancf_petsc.model.work import PathWork
from ancf_petsc.solve.load_path import LoadPath, PathStep
from ancf_petsc.solve.newton import Newton

log = logging.getLogger(STEPS)


class StaticRun:
    """Follows the load path and records it.

    times: pseudo-times of the outputs. watch: told the part of the path done, 0 to 1. stop: asked after each
    step whether to end.
    """

    def __init__(
        self,
        newton: Newton,
        record: Record,
        times: Sequence[float],
        smallest_step: float,
        clock: Clock,
        watch: Callable[[float], None],
        stop: Callable[[], bool],
    ) -> None:
        self.newton, self.record, self.clock, self.watch = newton, record, clock, watch
        self.assembly = newton.assembly
        self.times = set(times)
        self.totals = dict.fromkeys(COUNTS, 0)
        self._since = dict.fromkeys(COUNTS, 0)
        model = self.assembly.model
        ramps = [drive.ramp for drive in model.drives] + [load.ramp for load in model.loads]
        self.corners = {corner for ramp in ramps for corner in ramp.corners()}
        self.work = PathWork(model.drives, model.loads)
        self.path = LoadPath(newton, times, sorted(self.corners), smallest_step, self._on_step, stop)

    def go(self) -> None:
        """To s = 1. Raises NoEquilibrium or Interrupted, with the last good state saved."""
        start = np.zeros((self.assembly.model.owned, 3))
        self.work.start(0.0, *conjugates(self.assembly, self.path.x, start))
        self._write(0.0, self.path.x, start)
        try:
            self.path.run()
        except (NoEquilibrium, Interrupted):
            self._save_last_state()
            raise

    def _on_step(self, step: PathStep, x: PETSc.Vec) -> None:
        out_of_balance = self.newton.out_of_balance(x)
        scalars = conjugates(self.assembly, x, out_of_balance)
        self.work.add(step.s, *scalars)
        if step.s in self.corners:
            self.work.start(step.s, *scalars)
        for name, count in zip(COUNTS, (step.newton, step.linear, 1), strict=True):
            self.totals[name] += count
            self._since[name] += count
        if step.s in self.times:
            self._write(step.s, x, out_of_balance)
        self._tell(step, x, out_of_balance)
        self.watch(step.s)

    def _write(self, s: float, x: PETSc.Vec, out_of_balance: NDArray) -> None:
        with self.clock.part("output"):
            more = {"external_work": self.work.total, **self._since}
            self.record.write({"pseudo_time": s}, x, out_of_balance, more)
        self._since = dict.fromkeys(COUNTS, 0)
        self._written = s

    def _save_last_state(self) -> None:
        if self.path.s != self._written:
            self.newton.set_pseudo_time(self.path.s)
            self._write(self.path.s, self.path.x, self.newton.out_of_balance(self.path.x))

    def _tell(self, step: PathStep, x: PETSc.Vec, out_of_balance: NDArray) -> None:
        curve = self.record.curve(x, out_of_balance)
        shown = "".join(f"  {name} {value:12.6g}" for name, value in curve.items())
        log.info(
            "s %8.6f%s  newton %2d  linear %3d  min det F %6.4f  step %.4g",
            step.s,
            shown,
            step.newton,
            step.linear,
            self.record.row["min_det_F"] if step.s == self._written else self.assembly.smallest_det(x),
            step.size,
        )
