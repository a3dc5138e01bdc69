"""The mark of a live run in its folder: no two runs write into one.

The mark is a file that the run keeps locked (flock) and removes at its end. The system drops the lock when a
process ends, however it ends, so the mark of a killed run does not block the next one. Where locks do not
work (some network file systems), host and process number decide.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import socket
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any

from ancf_petsc.errors import CaseError
from ancf_petsc.results.tables import file_text

MARK = "running.json"
SPARE_BYTES = 65536  # blanks at the mark's end: on a full disk, removing the mark makes room for the summary
NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS)


class Mark:
    """Held by the root rank from `take` to `release`."""

    def __init__(self, folder: Path) -> None:
        self.path = Path(folder) / MARK
        self._number: int | None = None

    def take(self, facts: dict[str, Any], *, force: bool = False) -> None:
        """Mark the folder. Raises CaseError where a live run has it, OSError where it cannot be written.

        facts: what the mark says beside host and process. force: go on where only a mark of another host,
        which cannot be checked from here, is found.
        """
        while self._number is None:
            number = os.open(self.path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o644)
            try:
                self._lock(number, force=force)
            except BaseException:
                os.close(number)
                raise
            if _same_file(number, self.path):
                self._number = number
            else:  # the run before removed it between our opening and locking
                os.close(number)
        who = {"host": socket.gethostname(), "pid": os.getpid(), "start": _start_of(os.getpid())}
        text = json.dumps({**who, "since": datetime.now().astimezone().isoformat("T", "seconds"), **facts})
        try:
            os.ftruncate(self._number, 0)
            _write_all(self._number, text.encode() + b"\n" + b" " * SPARE_BYTES)
        except OSError:
            self.release()
            raise

    def _lock(self, number: int, *, force: bool) -> None:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise live_run(self.path.parent) from None
            if may_be_alive(read_mark(self.path.parent), force=force):
                raise live_run(self.path.parent) from None

    def make_room(self) -> None:
        """Give the spare blanks back to the disk, for what has to be written last."""
        if self._number is not None:
            with suppress(OSError):
                os.ftruncate(self._number, os.fstat(self._number).st_size - SPARE_BYTES)

    def release(self) -> None:
        """Take the mark away; a folder that has vanished has none."""
        if self._number is None:
            return
        with suppress(OSError):
            if _same_file(self._number, self.path):
                self.path.unlink()
        with suppress(OSError):
            os.close(self._number)
        self._number = None


def read_mark(folder: Path) -> dict[str, Any] | None:
    """What a mark says; None without one, empty for one that is not whole."""
    try:
        text = file_text(Path(folder) / MARK)
    except (OSError, ValueError):
        return None
    with suppress(ValueError):
        found = json.loads(text)
        return found if isinstance(found, dict) else {}
    return {}


def refuse_live_run(folder: Path, *, force: bool = False) -> None:
    """Raise CaseError if a live run has the folder; nothing is written."""
    try:
        number = os.open(Path(folder) / MARK, os.O_RDONLY)
    except OSError:
        return
    try:
        fcntl.flock(number, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno not in NO_LOCKS or may_be_alive(read_mark(folder), force=force):
            raise live_run(folder) from None
    finally:
        os.close(number)


def may_be_alive(mark: dict[str, Any] | None, *, force: bool) -> bool:
    """Whether the run of a mark may go on, asked without locks: a process of this host, or any of another."""
    if not mark or "host" not in mark:
        return False
    if mark.get("host") != socket.gethostname():
        return not force
    start = _start_of(int(mark.get("pid", 0)))
    return start is not None and start == mark.get("start", start)


def live_run(folder: Path) -> CaseError:
    """The refusal of a folder that a live run has."""
    mark = read_mark(folder) or {}
    who = f"process {mark.get('pid', '?')} on {mark.get('host', '?')}, since {mark.get('since', '?')}"
    return CaseError(
        "another run is writing into this folder",
        file=folder,
        key="--out",
        got=who,
        expected="a folder of its own for each run",
        cure="choose another folder by --out DIR, or wait for that run to end",
    )


def _same_file(number: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(number), os.stat(path))
    except FileNotFoundError:
        return False


def _start_of(pid: int) -> str | None:
    """When a process of this host began, in the system's own words; None if there is no such process."""
    if pid <= 0:
        return None
    try:
        text = Path(f"/proc/{pid}/stat").read_text()
        return text.rsplit(")", 1)[1].split()[19]
    except (OSError, IndexError):
        pass
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return None
    except OSError:
        return ""
    return ""


def _write_all(number: int, text: bytes) -> None:
    while text:
        text = text[os.write(number, text) :]
