"""Checkpoints of a run: when one is due, and what is in it.

A run that goes on from one does what the uninterrupted run does, to the last bit on as many ranks: everything that one step leaves
to the next is part of `state()` of what carries it. Writing one changes nothing of the run, so it may come at any time.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.host.signals import StopRequest
from ancf_petsc.analysis.identity import values_of
from ancf_petsc.analysis.packing import FIELD, Packing, kind_of, unpacked
from ancf_petsc.analysis.provenance import Provenance
from ancf_petsc.analysis.record import Record
from ancf_petsc.errors import cannot_write
from ancf_petsc.input.interval import Interval
from ancf_petsc.parallel.exchange import on_root
from ancf_petsc.parallel.fields import Places
from ancf_petsc.plan.plan import Plan
from ancf_petsc.results.checkpoint_file import Saved, Writing, all_in, next_path
from ancf_petsc.results.rollback import GoesOn, take_back

log = logging.getLogger("ancf")


class Run(Protocol):
    """What is saved between two steps: StaticRun, MotionRun. is_ready: whether its state says all."""

    record: Record
    totals: dict[str, int]

    @property
    def is_ready(self) -> bool: ...
    @property
    def place(self) -> str: ...
    def state(self) -> dict[str, Any]: ...


@dataclass
class History:
    """Of a run in pieces: number and file of the last checkpoint, steps done by it, and where it went on before."""

    number: int = 0
    last: Path | None = None
    steps: int = 0
    restarts: tuple[dict[str, Any], ...] = ()


class Checkpoints:
    """Saves a run. about: on the root rank. All methods but `facts` are collective."""

    def __init__(
        self,
        folder: Path,
        interval: Interval,
        places: Places,
        stop: StopRequest,
        clock: Clock,
        about: Provenance | None,
        history: History,
    ) -> None:
        self.folder, self.interval, self.places = folder, interval, places
        self.stop, self.clock, self.about, self.history = stop, clock, about, history
        self.comm = places.comm
        self._last_time = time.monotonic()

    @property
    def is_on(self) -> bool:
        """Whether any are asked for."""
        return self.interval != Interval()

    def between_steps(self, run: Run) -> bool:
        """Save the run if it is time, or if it is asked to stop; returns whether it is."""
        asked = self.stop.asked()
        if not self.is_on:
            return asked
        if run.is_ready and run.totals["steps"] > self.history.steps and (asked or self._is_due(run)):
            self.save(run)
        return asked and (run.is_ready or not run.totals["steps"])

    def at_end(self, run: Run) -> None:
        """Save the end of a motion that lasted: it may be gone on with."""
        lasted = self.history.last is not None or self.interval.steps
        if self.is_on and lasted and run.is_ready and run.totals["steps"] > self.history.steps:
            self.save(run)

    def _is_due(self, run: Run) -> bool:
        if self.interval.steps:
            return run.totals["steps"] - self.history.steps >= self.interval.steps
        return self.comm.bcast(time.monotonic() - self._last_time >= self.interval.seconds)

    def save(self, run: Run) -> None:
        """Write a checkpoint. Raises EnvironmentProblem; the one before stays as it is."""
        with self.clock.part("output"):
            packing = Packing()
            state = packing.plain(run.state())
            owners = packing.plain(self.places.owners())
            files = packing.plain(run.record.position())
            path, number = next_path(self.folder, self.history.last), self.history.number + 1
            tree = {"state": state, "owners": owners, "files": files, "fields": len(packing.fields)}
            self._write(path, number, {**self._about(), **tree}, packing)
        self.history.number, self.history.last = number, path
        self.history.steps, self._last_time = run.totals["steps"], time.monotonic()
        log.info("  checkpoint %d at %s", number, run.place)

    def _about(self) -> dict[str, Any]:
        if self.about is None:
            return {}
        return {
            "run": self.about.summary(),
            "title": self.about.case.spec.title,
            "values": values_of(self.about.case),
            "identity": [self.about.identity.case, self.about.identity.mesh],
            "ranks": self.comm.size,
            "restarts": list(self.history.restarts),
            "seconds": self.clock.report(),
        }

    def _write(self, path: Path, number: int, about: dict[str, Any], packing: Packing) -> None:
        """Field after field, slab after slab: no rank holds a whole table."""
        shapes = [("f8", self.places.shape(field)) for field in packing.fields]
        shapes += [(kind_of(array), array.shape) for array in packing.arrays]
        file = on_root(self.comm, lambda: self._try(path, lambda: Writing(path, number, about, shapes)))
        problem: Exception | None = None
        for field in packing.fields:
            for slab in self.places.slabs(field):
                with suppress(StopIteration):
                    problem = problem or self._problem_of(file, slab)
        on_root(self.comm, lambda: self._try(path, lambda: self._finish(file, packing.arrays, problem)))

    @staticmethod
    def _problem_of(file: Writing | None, rows: NDArray) -> Exception | None:
        assert file is not None
        try:
            file.add(rows)
        except OSError as error:  # the others still send: take it all, then tell
            return error
        return None

    @staticmethod
    def _finish(file: Writing | None, arrays: list[NDArray], problem: Exception | None) -> None:
        assert file is not None
        try:
            if problem is not None:
                raise problem
            for array in arrays:
                file.add(array)
        except BaseException:
            file.drop()
            raise
        file.finish()

    @staticmethod
    def _try(path: Path, work: Callable[[], Any]) -> Any:
        try:
            return work()
        except OSError as error:
            raise cannot_write(error, path) from error

    def facts(self) -> dict[str, Any]:
        """For the summary."""
        return {"restarts": list(self.history.restarts)} if self.history.restarts else {}


class Resumed:
    """A checkpoint that a run goes on from. saved: on the root rank, None on the others. Methods are collective."""

    def __init__(self, comm: MPI.Comm, saved: Saved | None) -> None:
        self.comm, self._saved = comm, saved
        about = None if saved is None else saved.about
        self.about: dict[str, Any] = comm.bcast(
            about and {name: about[name] for name in ("state", "fields", "seconds", "restarts", "ranks")}
        )
        self._places = comm.bcast(None if saved is None else saved.arrays)
        self._fields: int = self.about["fields"]

    @property
    def owners(self) -> Callable[[Plan], NDArray] | None:
        """The ranks of a plan's nodes; None on another number of ranks."""

        def rank_of(plan: Plan) -> NDArray:
            assert self._saved is not None
            rows = self._saved.rows(self._saved.about["owners"][FIELD])
            return rows[plan.space.first[:-1], 0].astype(np.int64)

        return rank_of if self.about["ranks"] == self.comm.size else None

    def take_files_back(self, folder: Path) -> GoesOn:
        """Bring the run's files to where they stood."""

        def work() -> GoesOn:
            assert self._saved is not None
            saved = self._saved
            files = unpacked(
                saved.about["files"], lambda *_: np.empty(0), lambda i: saved.rows(self._fields + i)
            )
            for other in all_in(folder)[0]:
                if other.number > saved.number:  # what the run writes now would make it seem good again
                    other.path.unlink()
            take_back(folder, files)
            return GoesOn(files["steps"], files["spans"])

        found = on_root(self.comm, work)
        return self.comm.bcast(found)

    def state(self, places: Places) -> dict[str, Any]:
        """This rank's part of the run's state."""

        def field(index: int, of: str) -> NDArray:
            bounds = places.bounds(of)
            slabs = (
                self._saved.rows(index, bounds[rank], bounds[rank + 1])
                for rank in range(self.comm.size)
                if self._saved is not None
            )
            return places.rows(of, self._places[index].shape, slabs)

        def array(index: int) -> NDArray:
            return self.comm.bcast(None if self._saved is None else self._saved.rows(self._fields + index))

        return unpacked(self.about["state"], field, array)

    def history(self) -> History:
        """What the checkpoints to come go on from."""
        number, path = self.comm.bcast(
            None if self._saved is None else (self._saved.number, self._saved.path)
        )
        now = {
            "date": datetime.now().astimezone().isoformat("T", "seconds"),
            "checkpoint": number,
            "steps": self.about["state"]["totals"]["steps"],
            "ranks": self.comm.size,
        }
        before = self.about["restarts"]
        return History(number, path, now["steps"], (*before, now))
