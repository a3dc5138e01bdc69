"""A quasi-static run: the load path with its log lines and outputs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.record import COUNTS, Record
from ancf_petsc.errors import Interrupted, NoEquilibrium
from ancf_petsc.input.analysis import StaticsSpec
from ancf_petsc.log import STEPS
from ancf_petsc.model.measures import conjugates
from ancf_petsc.model.work import PathWork
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.arc_length import ArcLength
from ancf_petsc.solve.events import CriticalPoint
from ancf_petsc.solve.load_path import LoadPath
from ancf_petsc.solve.marks import Jump, Marks, PathStep
from ancf_petsc.solve.newton import Newton
from ancf_petsc.solve.rise import Rise, begins_loaded, rising
from ancf_petsc.solve.stability import beyond_the_law
from ancf_petsc.solve.weakest import weakest_cell

log = logging.getLogger(STEPS)
RISE = tuple(k / 10 for k in range(1, 11))
"""States at which the work is summed up while loads that do not begin at 0 come up."""
IMBALANCE = 0.02
"""Of work and energy: the shipped cases in one step each have less than 0.001."""


class StaticRun:
    """Follows the load path and records it.

    times: pseudo-times of the outputs. watch(part): called with the part of the path done, 0 to 1. stop: asked after each
    step whether to end.
    """

    def __init__(
        self,
        newton: Newton,
        record: Record,
        times: Sequence[float],
        spec: StaticsSpec,
        clock: Clock,
        watch: Callable[[float], None],
        stop: Callable[[], bool],
    ) -> None:
        self.newton, self.record, self.clock, self.watch = newton, record, clock, watch
        self.spec, self.stop = spec, stop
        self.assembly = newton.assembly
        self.totals = dict.fromkeys(COUNTS, 0)
        self.events: list[dict] = []
        self.jumps: list[dict] = []
        self._goes_on = spec.after_limit == "dynamics"
        self._lost, self._jumped = 0.0, 0
        self.doubts: str | None = None
        self.control = newton.control
        self.end: dict[str, Any] = {}
        self._since = dict.fromkeys(COUNTS, 0)
        model = self.assembly.model
        ramps = [drive.ramp for drive in model.drives] + [load.ramp for load in model.loads]
        self.marks = Marks.of(times, [corner for ramp in ramps for corner in ramp.corners()])
        self.work = PathWork(model.drives, model.loads)
        self._x, self._written = self.assembly.reference_vector(), 0.0
        self._path: LoadPath | ArcLength | None = None
        self._rising: tuple[LoadPath, PathWork] | None = None
        self._restored: dict[str, Any] = {}

    is_ready = True

    @property
    def place(self) -> str:
        """Where it is, in words."""
        if self._path is not None:
            return f"pseudo-time {self._path.s:.6g}"
        if "path" in self._restored:
            return f"pseudo-time {self._restored['path']['s']:.6g}"
        return "the way to pseudo-time 0"

    def state(self) -> dict[str, Any]:
        """All that the rest of the run hangs on, between two steps. Collective."""
        state = {
            "totals": self.totals,
            "since": self._since,
            "events": self.events,
            "doubts": self.doubts,
            "jumps": [self.jumps, self._lost, self._jumped],
            "written": self._written,
            "row": self.record.row,
            "work": self.work.state(),
        }
        if self._path is not None:
            return {**state, "path": self._path.state()}
        assert self._rising is not None
        path, work = self._rising
        return {**state, "rise": {"path": path.state(), "work": work.state()}}

    def restore(self, state: dict[str, Any]) -> None:
        """Let `go` go on from a state."""
        self.totals, self._since = dict(state["totals"]), dict(state["since"])
        self.events[:], self.doubts = state["events"], state["doubts"]
        self.jumps[:], self._lost, self._jumped = state["jumps"]
        self._written, self.record.row = state["written"], dict(state["row"])
        self.work.restore(state["work"])
        self._restored = state

    def go(self) -> None:
        """To s = 1. Raises NoEquilibrium or Interrupted, with the last good state saved."""
        nothing = np.zeros((self.assembly.model.owned, 3))
        if not self._restored:
            self._write(0.0, self._x, nothing)
        rises = begins_loaded(self.assembly.model) and "path" not in self._restored
        x = self._rise() if rises else self._x.copy()
        length = 0.0 if self.spec.control == "arc_length" else None
        if "path" not in self._restored:
            self.newton.set_pseudo_time(0.0)
            self.work.start(0.0, *conjugates(self.assembly, x, self.newton.out_of_balance(x)), length)
        common = (self.newton, self.marks, self.spec.smallest_step, self._on_step, self.stop)
        more: dict[str, Any] = {"on_bifurcation": self.spec.on_bifurcation, "on_event": self._on_event}
        path: LoadPath | ArcLength
        if self.spec.control == "arc_length":
            path = ArcLength(*common, start=x, **more)
        else:
            path = LoadPath(*common, start=x, on_jump=self._on_jump if self._goes_on else None, **more)
        self._path = path
        if "path" in self._restored:
            path.restore(self._restored["path"])
        try:
            path.run()
        except (NoEquilibrium, Interrupted):
            self._save_last_state(path)
            self._note_end(path)
            raise
        self._note_end(path)
        self._note_doubts(path.s, path.x)
        self._note_imbalance()

    def _rise(self) -> PETSc.Vec:
        """The state at s = 0 where ramps do not begin at 0: loads and moves come up to it in proportion."""
        log.info("loads or moves are not zero at pseudo-time 0: they come up to there first, in proportion")
        model = rising(self.assembly.model, 0.0)
        rise = Rise(model, self.newton.tolerance)
        work, assembly = PathWork(model.drives, model.loads), rise.newton.assembly
        work.start(0.0, *conjugates(assembly, self._x, np.zeros((model.owned, 3))))

        def begin(path: LoadPath) -> None:
            self._rising = path, work
            if "rise" in self._restored:
                work.restore(self._restored["rise"]["work"])
                path.restore(self._restored["rise"]["path"])

        def add(step: PathStep, x: PETSc.Vec) -> None:
            work.add(step.s, *conjugates(assembly, x, rise.newton.out_of_balance(x)))
            self._count(step)

        try:
            return rise.run(
                RISE,
                self.spec.smallest_step,
                add,
                begin,
                interrupted=self.stop,
                on_bifurcation=self.spec.on_bifurcation,
                on_event=lambda event, x: self._on_event(
                    event, x, "before pseudo-time 0, on the way to it: "
                ),
            )
        except NoEquilibrium as error:
            raise NoEquilibrium(
                f"before pseudo-time 0, where loads and moves come up: {error}", error.facts
            ) from error
        finally:
            self.work.total = work.total
            self.control.add(rise.newton.control, "before pseudo-time 0: ")

    def _count(self, step: PathStep) -> None:
        for name, count in zip(COUNTS, (step.newton, step.linear, 1), strict=True):
            self.totals[name] += count
            self._since[name] += count

    def _on_step(self, step: PathStep, x: PETSc.Vec) -> None:
        out_of_balance = self.newton.out_of_balance(x)
        scalars = conjugates(self.assembly, x, out_of_balance)
        self.work.add(step.s, *scalars, step.length)
        if step.s in self.marks.corners:
            self.work.start(step.s, *scalars)
            self._note_doubts(step.s, x)
        self._count(step)
        if step.output:
            self._write(step.s, x, out_of_balance)
        self._log_step(step, x, out_of_balance)
        self.watch(step.s)

    def _on_event(self, event: CriticalPoint, x: PETSc.Vec, where: str = "") -> None:
        """Say it at once; the summary has it too, with stroke and force where the case asks for a curve."""
        curve = self.record.curve(x, self.newton.out_of_balance(x))
        load = self._load_at(event.pseudo_time)
        shown = "".join(f", {name} {value:.6g}" for name, value in curve.items())
        shown += f", loads ({', '.join(f'{c:.4g}' for c in load)})" if any(load) else ""
        log.warning("%s%s%s", where, event.words(), shown)
        self.events.append({**event.facts(), **curve, "load": load})

    def _on_jump(self, jump: Jump, before: PETSc.Vec, x: PETSc.Vec) -> None:
        """Rows of the states before and after damped motion; the energy it lost is what the work leaves."""
        if jump.before != self._written:
            self.newton.set_pseudo_time(jump.before)
            self._write(jump.before, before, self.newton.out_of_balance(before))
        was = dict(self.record.row)
        self.newton.set_pseudo_time(jump.s)
        balance = self.newton.out_of_balance(x)
        work = self.work.jump(jump.s, *conjugates(self.assembly, x, balance))
        lost = work - (self.assembly.strain_energy(x) - self.assembly.strain_energy(before))
        self._lost += lost
        self._jumped += 1
        self._write(jump.s, x, balance)
        self._log_jump(jump, was, self.record.spec.output.symmetry * lost)

    def _log_jump(self, jump: Jump, was: Mapping[str, float], lost: float) -> None:
        now = self.record.row
        fact = {
            "pseudo_time": jump.s,
            "from": jump.before,
            "cause": jump.why.facts.get("kind"),
            "energy_lost": lost,
        }
        for name in ("stroke", "force"):
            if name in now:
                fact |= {name: now[name], f"{name}_before": was[name]}
        self.jumps.append({**fact, "steps": jump.steps, "message": str(jump.why)})
        shown = "".join(f", {n} {was[n]:.6g} to {now[n]:.6g}" for n in ("stroke", "force") if n in now)
        log.warning(
            "%s: damped dynamics at pseudo-time %.6g led to another equilibrium%s, energy lost %.6g",
            jump.why,
            jump.s,
            shown,
            lost,
        )

    def _note_doubts(self, s: float, x: PETSc.Vec) -> None:
        """Warn once where the law is beyond its limit, at the end of the path and where loads turn; the summary has it."""
        if self.doubts is None and (found := beyond_the_law(self.assembly, x)) is not None:
            self.doubts = f"at pseudo-time {s:.6g}: {found}"
            log.warning("%s", self.doubts)

    def _note_imbalance(self) -> None:
        """Warn where the work does not balance the energy: along a smooth path it does to far less than IMBALANCE."""
        work, energy = self.record.row["external_work"], self.record.row["strain_energy"]
        lost = self.record.row.get("dissipated_energy", 0.0)
        off = abs(work - energy - lost) / max(abs(work), abs(energy), 1e-300)
        if self.doubts is None and off > IMBALANCE:
            self.doubts = (
                f"external work {work:.6g} and strain energy {energy:.6g} differ by {100 * off:.1f} %: the path has jumped to "
                "another branch, or its steps are too long; see with more statics.steps, or, for loads, "
                'statics.control = "arc_length"'
            )
            log.warning("%s", self.doubts)

    def _note_end(self, path: LoadPath | ArcLength) -> None:
        self.end = {"pseudo_time": path.s, **weakest_cell(self.assembly, path.x).facts()}

    def _load_at(self, s: float) -> list[float]:
        """The sum of the loads at s."""
        total = self.assembly.external_force(s)[self.assembly.model.own_positions].sum(axis=0)
        return list(map(float, combined(self.assembly.comm, total)))

    def _write(self, s: float, x: PETSc.Vec, out_of_balance: NDArray) -> None:
        with self.clock.part("output"):
            more: dict[str, float] = {"external_work": self.work.total, **self._since}
            if self._goes_on:
                more |= {"dissipated_energy": self._lost, "jumps": self._jumped}
            self.record.write({"pseudo_time": s}, x, out_of_balance, more)
        self._since, self._jumped = dict.fromkeys(COUNTS, 0), 0
        self._written = s

    def _save_last_state(self, path: LoadPath | ArcLength) -> None:
        if path.s != self._written:
            self.newton.set_pseudo_time(path.s)
            self._write(path.s, path.x, self.newton.out_of_balance(path.x))

    def _log_step(self, step: PathStep, x: PETSc.Vec, out_of_balance: NDArray) -> None:
        curve = self.record.curve(x, out_of_balance)
        shown = "".join(f"  {name} {value:12.6g}" for name, value in curve.items())
        log.info(
            "s %8.6f%s  newton %2d  linear %3d  min det F %6.4f  step %.4g",
            step.s,
            shown,
            step.newton,
            step.linear,
            self.record.row["min_det_F"] if step.s == self._written else self._min_det(x),
            step.size,
        )
        residuals = " ".join(f"{value:.2e}" for value in step.residuals)
        log.debug("    out of balance, of the largest force, after each iteration: %s", residuals)

    def _min_det(self, x: PETSc.Vec) -> float:
        """What the column min_det_F would hold: the smallest of the elements' means, not of their points."""
        return combined(self.assembly.comm, self.assembly.fields(x)[2].min(initial=np.inf), MPI.MIN)
