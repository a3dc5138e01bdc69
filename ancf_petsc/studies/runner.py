"""Starting the runs of a study, several beside each other, and noting how they end."""

from __future__ import annotations

import logging
import os
import resource
import shutil
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from ancf_petsc.errors import CaseError, Interrupted
from ancf_petsc.results.mark import refuse_live_run
from ancf_petsc.studies.ending import RunEnd, one_line, read_end, summary_of
from ancf_petsc.studies.process import PATIENCE, OtherLoad, Process
from ancf_petsc.studies.record import Busy, add_to_record, held, read_record, record_file
from ancf_petsc.studies.runs import StudyRun, described, version

log = logging.getLogger("ancf")
POLL = 0.05
"""Seconds between looks at the runs that go on."""
LOOK_AGAIN = 1.0
"""Seconds until a run that another study has is looked at again."""
TIMED_OUT = 124
ANOTHER = "another run is writing into this folder"


@dataclass(frozen=True)
class StudyProgress:
    """Counts of runs, and seconds left, None while nothing has been measured."""

    total: int
    done: int
    running: int
    failed: int
    left: float | None


@dataclass
class _Started:
    process: Process
    lock: ExitStack
    load: OtherLoad
    used: float
    alone: bool = True


class Runner:
    """Runs of a study in a folder. changed: called when a run has ended; progress: whenever something changes."""

    def __init__(
        self,
        case_file: Path,
        folder: Path,
        *,
        jobs: int,
        ranks: int,
        timeout: float | None = None,
        changed: Callable[[], None] = lambda: None,
        progress: Callable[[StudyProgress], None] = lambda now: None,
    ) -> None:
        self.case_file, self.folder, self.jobs, self.ranks = case_file, folder, jobs, ranks
        self.timeout, self.changed, self.progress = timeout, changed, progress
        self.started = 0
        self._active: list[_Started] = []
        self._ended: dict[str, RunEnd | None] = {}
        self._spent: list[tuple[float, float]] = []
        self._runs: Sequence[StudyRun] = ()

    def go(self, runs: Sequence[StudyRun]) -> None:
        """Do all runs that are not done, in this order. Raises Interrupted when the user asks to stop."""
        self._runs = runs
        waiting, due = deque(runs), 0.0
        elsewhere: deque[StudyRun] = deque()
        self._show()
        with self._ending_on_signals():
            while waiting or elsewhere or self._active:
                if elsewhere and time.monotonic() >= due:
                    waiting.extend(elsewhere)
                    elsewhere.clear()
                while waiting and len(self._active) < self.jobs:
                    run = waiting.popleft()
                    if not self._begin(run):
                        elsewhere.append(run)
                        due = time.monotonic() + LOOK_AGAIN
                again = [started.process.run for started in self._active[:] if self._look_at(started)]
                elsewhere.extend(again)
                if self._active or elsewhere:
                    time.sleep(POLL)

    def time_alone(self, runs: Sequence[StudyRun]) -> None:
        """Repeat, one after the other, the finished runs whose seconds were not measured alone."""
        with self._ending_on_signals():
            for run in runs:
                with suppress(Busy), held(record_file(self.folder, run.name)):
                    end = self._end_of(run)
                    if end and end.status == "done" and not read_record(self.folder, run.name).get("alone"):
                        self._repeat(run)
                        self.changed()

    def _begin(self, run: StudyRun) -> bool:
        """Start a run, unless it is done; False where another process has it."""
        lock = ExitStack()
        try:
            lock.enter_context(held(record_file(self.folder, run.name)))
            end = self._end_of(run)
            if end is not None and self._stays(end, run):
                self._ended[run.name] = end
                lock.close()
                self._show()
                return True
            if (self.folder / run.name).is_dir():
                refuse_live_run(self.folder / run.name)
        except (Busy, CaseError):
            lock.close()
            return False
        with lock:
            facts = {"code": None, "reason": "", "identity": run.identity, "timeout": False}
            sizes = asdict(run.facts) if run.facts else None
            add_to_record(self.folder, run.name, **facts, facts=sizes, changes=described(run.changes))
            load, used = OtherLoad(), _used()
            process = Process(run, self.case_file, self.folder / run.name, self.ranks)
            self._active.append(_Started(process, lock.pop_all(), load, used))
        self.started += 1
        if len(self._active) > 1:
            for started in self._active:
                started.alone = False
        self._show()
        return True

    def _stays(self, end: RunEnd, run: StudyRun) -> bool:
        """Whether a run's end is taken as it is, in place of another attempt."""
        if end.outcome == "timeout":
            limit = read_record(self.folder, run.name).get("limit", 0.0)
            return self.timeout is not None and self.timeout <= limit
        return end.final

    def _end_of(self, run: StudyRun) -> RunEnd | None:
        record = read_record(self.folder, run.name)
        return read_end(self.folder / run.name, run.identity, version(), record)

    def _look_at(self, started: _Started) -> bool:
        """Note the end of a run that has ended; True where it has to be looked at again later."""
        process = started.process
        code = process.code()
        timed_out = code is None and self.timeout is not None and process.seconds > self.timeout
        if code is None and not timed_out:
            return False
        if timed_out:
            process.ask_to_stop()
            process.end(PATIENCE)
            code, reason = TIMED_OUT, f"stopped after {self.timeout:.3g} s, the time a run was given"
        else:
            reason = one_line(process.reason()) if code else ""
            process.end()
        self._active.remove(started)
        used = _used() - started.used
        alone = started.alone and started.load.left_alone(used, self.ranks)
        with started.lock:
            if code == CaseError.exit_code and ANOTHER in reason:
                return True
            add_to_record(
                self.folder,
                process.run.name,
                code=code,
                reason=reason,
                timeout=timed_out,
                limit=self.timeout,
                wall=process.seconds,
                alone=alone,
                processor=used if started.alone else None,
                seconds=None,
            )
        self._note(process)
        return False

    def _note(self, process: Process) -> None:
        run = process.run
        end = self._ended[run.name] = self._end_of(run)
        self._spent.append((run.seconds, process.seconds))
        words = end.outcome if end else "interrupted"
        count = f"run {len(self._ended)} of {len(self._runs)}"
        more = f": {end.reason}" if end and end.reason else ""
        log.info("%s, %s: %s, %.3g s%s", count, run.label, words, process.seconds, more)
        self.changed()
        self._show()

    def _repeat(self, run: StudyRun) -> None:
        """One more run in a folder of its own, for its seconds alone."""
        folder = self.folder / f"{run.name}.timing"
        shutil.rmtree(folder, ignore_errors=True)
        load, used = OtherLoad(), _used()
        process = Process(run, self.case_file, folder, self.ranks)
        started = _Started(process, ExitStack(), load, used)
        self._active.append(started)
        while process.code() is None:
            time.sleep(POLL)
        process.end()
        self._active.remove(started)
        seconds = summary_of(folder).get("seconds")
        shutil.rmtree(folder, ignore_errors=True)
        if seconds:
            alone = load.left_alone(_used() - used, self.ranks)
            add_to_record(self.folder, run.name, seconds=seconds, alone=alone, ranks=self.ranks)
            log.info("%s: %.4g s alone", run.label, seconds["total"])

    def _show(self) -> None:
        ended = list(self._ended.values())
        failed = sum(end is None or end.status != "done" for end in ended)
        left = None
        if self._spent:
            rate = sum(real for _, real in self._spent) / max(sum(guess for guess, _ in self._spent), 1e-9)
            rest = sum(run.seconds for run in self._runs if run.name not in self._ended)
            left = rate * rest / self.jobs
        self.progress(StudyProgress(len(self._runs), len(ended) - failed, len(self._active), failed, left))

    @contextmanager
    def _ending_on_signals(self) -> Iterator[None]:
        """End all runs cleanly when the study is asked to stop, or fails."""
        names = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        main = threading.current_thread() is threading.main_thread()
        before = [signal.signal(name, _interrupt) for name in names] if main else []
        try:
            yield
        except KeyboardInterrupt:
            raise Interrupted(
                f"interrupted; {len(self._ended)} of {len(self._runs)} runs are done, the same command goes on"
            ) from None
        finally:
            self._end_all()
            for name, handler in zip(names, before, strict=False):
                signal.signal(name, handler)

    def _end_all(self) -> None:
        for started in self._active:
            started.process.ask_to_stop()
        limit = time.monotonic() + PATIENCE
        for started in self._active:
            with started.lock:
                started.process.end(limit - time.monotonic())
        self._active.clear()


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def _used() -> float:
    """Seconds of processor time of all processes that were started from here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def free_cores(jobs: int | None, ranks: int) -> int:
    """How many runs go on beside each other: as asked, else cores over ranks."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return jobs or max(1, cores // ranks)
