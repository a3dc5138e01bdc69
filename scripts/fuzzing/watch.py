"""What an input may not cause, and what it takes: audit events, memory, processor time, files that change."""

from __future__ import annotations

import contextlib
import os
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

GIGABYTE = 2**30
PROGRAMS = ("python", "python3", os.path.basename(sys.executable), "lscpu", "xset")
"""This one for readers, and those by which numpy and pyvista ask for the processor and the display."""
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


class Watch:
    """Audit events that no input may cause: writing elsewhere, reading what was planted, other programs, the network."""

    def __init__(self) -> None:
        self.allowed: tuple[str, ...] = ()
        self.room = ""
        self.seen: list[str] = []
        self.on = self.deck = False
        sys.addaudithook(self.hear)

    def hear(self, event: str, given: tuple) -> None:
        if not self.on:
            return
        self.on = False
        try:
            words = self._words(event, given)
            if words:
                self.seen.append(words)
        finally:
            self.on = True

    def _words(self, event: str, given: tuple) -> str:
        if event == "open" and isinstance(given[0], str | bytes | os.PathLike):
            path = os.path.abspath(os.fsdecode(given[0]))
            flags = given[2] if isinstance(given[2], int) else 0
            if flags & WRITES and not path.startswith((*self.allowed, "/dev/null")):
                return f"writes {path}"
            # Decks may include any ordinary file, as they do in the programs they are for.
            if not self.deck and (
                "secret" in os.path.basename(path) or path in ("/etc/passwd", "/etc/shadow")
            ):
                return f"reads {path}"
        elif event in (
            "os.mkdir",
            "os.remove",
            "os.rmdir",
            "os.rename",
            "os.symlink",
            "os.link",
            "os.truncate",
            "shutil.rmtree",
        ):
            place = given[1] if event in ("os.rename", "os.symlink", "os.link") else given[0]
            # Relative to an open folder: what rmtree removes of a temporary one.
            path = (
                ""
                if isinstance(place, int) or given[-1] not in (-1, None)
                else os.path.abspath(os.fsdecode(place))
            )
            if path and not path.startswith(self.allowed):
                return f"{event} {path}"
        elif event == "subprocess.Popen" and os.path.basename(str(given[0])) not in PROGRAMS:
            return f"starts {given[0]}"
        elif event in (
            "os.system",
            "socket.connect",
            "socket.getaddrinfo",
            "urllib.Request",
            "os.exec",
            "ftplib.connect",
        ):
            return f"{event} {given[1:]}"
        return ""


@contextlib.contextmanager
def limited_memory(kind: str) -> Iterator[None]:
    """A gigabyte of addresses beyond what the process has; drawing takes many that it never uses, so its peak alone is judged."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + GIGABYTE
    if kind != "results":
        resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def forget_peak() -> None:
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def memory(name: str) -> int:
    """Bytes of a line of /proc/self/status: VmHWM is the peak, VmRSS what is resident now."""
    text = Path("/proc/self/status").read_text()
    return int(text.partition(f"{name}:")[2].split()[0]) * 1024


def processor_time() -> float:
    """Seconds of this process and of those it started that have ended."""
    return sum(os.times()[:4])


def tree(room: Path, without: Path) -> dict[str, tuple]:
    """Size and date of all below a folder, except below another."""
    found: dict[str, tuple] = {}
    for folder, names, files in os.walk(room):
        if Path(folder) == without:
            names.clear()
            continue
        for name in (*names, *files):
            path = os.path.join(folder, name)
            stat = os.lstat(path)
            moment = 0 if os.path.isdir(path) else stat.st_mtime_ns
            found[path] = (stat.st_mode, 0 if os.path.isdir(path) else stat.st_size, moment)
    return found
