"""The log: lines on the terminal and in log.txt, written by the root rank only, and a progress bar.

Library modules take `logging.getLogger("ancf")` and say what happens; the command line calls `configure`.
Lines of the logger "ancf.step", one a step, give way to the bar where there is one; the file has them all. Those of
"ancf.record", what a run says of itself, are for the file. The terminal shows both with the details (`--verbose`).
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Protocol, TextIO

from ancf_petsc.errors import cannot_write

LOGGER = logging.getLogger("ancf")
STEPS = "ancf.step"
RECORD = "ancf.record"


class _Lines(logging.Formatter):
    """The message alone; what is worse than information says so."""

    def format(self, record: logging.LogRecord) -> str:
        mark = f"{record.levelname.lower()}: " if record.levelno >= logging.WARNING else ""
        return mark + super().format(record)


class _Terminal(logging.StreamHandler):
    """Standard output, as it is at the moment: a progress bar puts itself in its place."""

    bar = False

    def __init__(self) -> None:
        logging.Handler.__init__(self)

    @property
    def stream(self) -> TextIO:
        return sys.stdout

    def filter(self, record: logging.LogRecord) -> Any:
        hidden = (STEPS, RECORD) if self.bar else RECORD
        terse = self.level > logging.DEBUG
        return super().filter(record) and not (terse and record.name.startswith(hidden))

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802
        """Whoever read the lines has gone (`| head`): the computation goes on without them."""
        if isinstance(sys.exc_info()[1], BrokenPipeError):
            silence_output()
        else:
            super().handleError(record)


class _File(logging.FileHandler):
    """log.txt. A line that finds no space is lost, and said once: the outputs decide whether the run can go on."""

    said = False

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802
        error = sys.exc_info()[1]
        if not isinstance(error, OSError):
            super().handleError(record)
        elif not self.said:
            self.said = True
            LOGGER.warning("%s", cannot_write(error, self.baseFilename))

    def close(self) -> None:
        """Closing writes what is left: without space that is lost too."""
        with suppress(OSError):
            super().close()


class _Pending(logging.Handler):
    """Keeps lines until there is a file for them."""

    def __init__(self) -> None:
        super().__init__()
        self.records: list[logging.LogRecord] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.records.append(record)


class ProgressBar(Protocol):
    """What `progress` gives: `advance_to` a share of the total, with a few words beside the bar."""

    def advance_to(self, done: float, words: str = "") -> None: ...


class _NoBar:
    def advance_to(self, done: float, words: str = "") -> None:
        """There is no bar to move."""


class _Bar:
    def __init__(self, bar: Any, task: Any) -> None:
        self._bar, self._task = bar, task

    def advance_to(self, done: float, words: str = "") -> None:
        self._bar.update(self._task, completed=done, words=words)


def configure(folder: str | Path | None = None, rank: int = 0, verbosity: int = 0) -> None:
    """Send the log to standard output and, once it has a place, to log.txt; other ranks than 0 stay silent.

    folder: where log.txt goes, None while it is not known (`attach_file`). verbosity: -1 warnings only,
    0 the course of things, 1 details too; the file never holds less than 0.
    """
    close()
    LOGGER.propagate = False
    if rank != 0:
        LOGGER.addHandler(logging.NullHandler())
        LOGGER.setLevel(logging.CRITICAL + 1)
        return
    level = {-1: logging.WARNING, 0: logging.INFO}.get(verbosity, logging.DEBUG)
    LOGGER.setLevel(min(level, logging.INFO))
    terminal = _Terminal()
    terminal.setLevel(level)
    for handler in (terminal, _Pending()):
        handler.setFormatter(_Lines())
        LOGGER.addHandler(handler)
    if folder is not None:
        attach_file(Path(folder) / "log.txt")


def attach_file(path: str | Path, mode: str = "w") -> None:
    """Write all lines, those so far too, to a new file, or, with mode "a", to the end of one. Does nothing where `configure`
    made no log.
    """
    waiting = [handler for handler in LOGGER.handlers if isinstance(handler, _Pending)]
    if not waiting:
        return
    file = _File(path, mode=mode, encoding="utf-8")
    file.setFormatter(_Lines())
    for pending in waiting:
        LOGGER.removeHandler(pending)
        for record in pending.records:
            file.handle(record)
    LOGGER.addHandler(file)


@contextmanager
def log_file(path: Path, rank: int, mode: str = "w") -> Iterator[None]:
    """Write all lines of a block, and those that waited for a file, to a file on the root rank; mode as `attach_file`."""
    if rank:
        yield
        return
    level = LOGGER.level
    LOGGER.setLevel(min(LOGGER.getEffectiveLevel(), logging.INFO))
    before = set(LOGGER.handlers)
    if not any(isinstance(handler, _Pending) for handler in before):
        LOGGER.addHandler(_Pending())
    attach_file(path, mode)
    try:
        yield
    finally:
        for handler in set(LOGGER.handlers) - before:
            LOGGER.removeHandler(handler)
            handler.close()
        LOGGER.setLevel(level)


def close() -> None:
    """Take the handlers of `configure` away and close their files."""
    for handler in list(LOGGER.handlers):
        LOGGER.removeHandler(handler)
        handler.close()


@contextmanager
def progress(total: float, unit: str = "") -> Iterator[ProgressBar]:
    """A bar with share, elapsed time and time left, on a terminal; elsewhere nothing."""
    terminal = next((handler for handler in LOGGER.handlers if isinstance(handler, _Terminal)), None)
    if terminal is None or terminal.level > logging.INFO or not on_terminal():
        yield _NoBar()
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bars

    columns = (
        TaskProgressColumn(),
        BarColumn(bar_width=30),
        TextColumn("{task.completed:.4g}/{task.total:.4g} " + unit, markup=False),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[words]}", markup=False),
    )
    with Bars(*columns, console=Console(file=sys.stdout), transient=True) as bars:
        terminal.bar = True
        try:
            yield _Bar(bars, bars.add_task("", total=total, words=""))
        finally:
            terminal.bar = False


def on_terminal() -> bool:
    """Whether a person sees standard output; mpiexec gives its processes a terminal even into a file."""
    if not sys.stdout.isatty() or os.environ.get("TERM", "dumb") == "dumb":
        return False
    if "OMPI_COMM_WORLD_RANK" not in os.environ:
        return True
    try:
        launcher = os.open(f"/proc/{os.getppid()}/fd/1", os.O_WRONLY | os.O_NOCTTY)
    except OSError:
        return False
    try:
        return os.isatty(launcher)
    finally:
        os.close(launcher)


def silence_output() -> None:
    """Let standard output lead nowhere, after its reader has closed it."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
