"""What a study knows of each of its runs beside the run's own folder: runs/HASH.json.

The file is also the lock of the run: who holds it may start the run or write the record, so that studies that share a
folder never do a run twice. The system drops the lock with the process that held it.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ancf_petsc.results.mark import NO_LOCKS


class Busy(Exception):
    """Another study holds the run."""


def record_file(runs: Path, name: str) -> Path:
    """The record of the run of that hash."""
    return runs / f"{name}.json"


def read_record(runs: Path, name: str) -> dict[str, Any]:
    """What is recorded of a run; empty where nothing is, or where its writer was killed half-way."""
    with suppress(OSError, ValueError):
        found = json.loads(record_file(runs, name).read_text(encoding="utf-8"))
        if isinstance(found, dict):
            return found
    return {}


def add_to_record(runs: Path, name: str, **facts: Any) -> None:
    """Write facts into a record, beside what it holds. By the holder of the lock."""
    text = json.dumps({**read_record(runs, name), **facts}, indent=1) + "\n"
    number = os.open(record_file(runs, name), os.O_WRONLY | os.O_CREAT, 0o644)
    try:
        os.ftruncate(number, 0)
        view = text.encode()
        while view:
            view = view[os.write(number, view) :]
    finally:
        os.close(number)


@contextmanager
def held(path: Path, *, wait: bool = False) -> Iterator[None]:
    """Hold the lock of a file during a block. Raises Busy where another process has it and `wait` is not given."""
    number = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o644)
    try:
        lock(number, wait=wait)
        yield
    finally:
        os.close(number)


def lock(number: int, *, wait: bool = False) -> None:
    """Lock an open file; where locks do not work, the marks of live runs alone guard them."""
    try:
        fcntl.flock(number, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError as error:
        if error.errno in (errno.EAGAIN, errno.EACCES):
            raise Busy from None
        if error.errno not in NO_LOCKS:
            raise
