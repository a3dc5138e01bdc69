"""What a process that reads somebody's file may take: memory, processor time, no files to write."""

from __future__ import annotations

import resource
import time
from contextlib import suppress
from pathlib import Path

MEMORY, MEMORY_PER_BYTE = 768 * 2**20, 60
"""Bytes beyond what the process has when it starts to read, and for each byte of the file: a number of a text becomes an object."""
UNPACKED = 10
"""Times as much for files that are packed as a whole (.gz)."""


def allowed_bytes(path: Path, size: int) -> int:
    """Of memory for a file of `size` bytes, all that belong to it together."""
    return MEMORY + MEMORY_PER_BYTE * size * (UNPACKED if path.suffix.lower() == ".gz" else 1)


def limit(memory: int, seconds: float) -> None:
    """Set limits on this process, beyond what it has taken so far: memory in bytes, seconds of processor time."""
    used = _address_space()
    if used is not None:
        _set(resource.RLIMIT_AS, used + memory)
    _set(resource.RLIMIT_CPU, int(time.process_time() + seconds) + 1)
    _set(resource.RLIMIT_CORE, 0)
    _set(resource.RLIMIT_FSIZE, 0)


def _set(what: int, value: int) -> None:
    """Lower a limit; a lower one stays."""
    hard = resource.getrlimit(what)[1]
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    with suppress(ValueError, OSError):
        resource.setrlimit(what, (value, hard))


def _address_space() -> int | None:
    """Bytes of addresses this process has; None where the system does not say."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    except OSError:
        return None
