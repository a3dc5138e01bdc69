"""Space on the disk and the right to write for results.h5: both made sure of before HDF5 writes.

HDF5 keeps what it could not write and tries again until the process ends, where it then crashes. So the
disk sets the space of an output aside before HDF5 begins it (posix_fallocate; HDF5 gives back what it does
not need), and a file that failed all the same is closed into memory.
"""

from __future__ import annotations

import errno
import fcntl
import logging
import os
import resource
import struct
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ancf_petsc.errors import cannot_write

MARGIN = 65536  # bytes beyond the numbers themselves: HDF5's tables of what is where, a line of each table
WAIT = 10.0  # seconds that another program may hold the file for writing
log = logging.getLogger("ancf")


class DiskSpace:
    """Of one file, on the root rank; other ranks only `divert`.

    While it is open, a shared lock on the file keeps programs that would write to it out: HDFView or h5py in
    mode "r+" would cut off, on closing, all that was added since they opened it. Readers pass.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._number: int | None = None

    def create(self) -> None:
        """Make the file, empty. Raises OSError."""
        self._number = os.open(self.path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o666)

    def reserve(self, size: int) -> None:
        """Have the disk keep `size` bytes beyond the file's end. Raises EnvironmentProblem, OSError."""
        number = self._number
        if number is None:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        there = os.stat(self.path)
        if not os.path.samestat(there, os.fstat(number)):
            raise OSError(errno.ESTALE, os.strerror(errno.ESTALE), str(self.path))
        self._lock(number)
        begin = there.st_size
        set_aside = getattr(os, "posix_fallocate", None)
        if set_aside is None:  # macOS
            return
        try:
            set_aside(number, begin, size + MARGIN)
        except OSError as error:
            if error.errno in (errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL):
                return  # a file system that cannot: HDF5 will notice by itself
            with suppress(OSError):
                os.ftruncate(number, begin)
            raise

    def _lock(self, number: int) -> None:
        """Wait a little for a program that writes to the file; then give up."""
        end = time.monotonic() + WAIT
        said = False
        while True:
            try:
                fcntl.flock(number, fcntl.LOCK_SH | fcntl.LOCK_NB)
                return
            except OSError as error:
                if error.errno not in (errno.EAGAIN, errno.EACCES):
                    return  # no locks on this file system
                if time.monotonic() > end:
                    raise cannot_write(BlockingIOError(errno.EAGAIN, ""), self.path) from None
            if not said:
                log.warning("%s: another program has it open for writing; waiting %g s", self.path, WAIT)
                said = True
            time.sleep(0.1)

    def close(self) -> None:
        """Let go of the lock."""
        if self._number is not None:
            os.close(self._number)
            self._number = None

    __del__ = close

    def divert(self) -> None:
        """Let every descriptor of the file lead to memory, of whatever driver it is: what HDF5 still wants to
        write is taken and dropped, so that it can close its objects. A limit on the size of files, which
        memory would share, is lifted as far as this process may.
        """
        self.close()
        _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
        try:
            lost = os.stat(self.path)
        except OSError:
            lost = None
        with _spare_file() as spare:
            for number in _open_numbers():
                with suppress(OSError):
                    if _leads_to(number, self.path, lost):
                        os.dup2(spare, number, inheritable=False)


def lengthen(path: Path) -> None:
    """Give a file that was cut short the length in its superblock: HDF5 opens no shorter one.

    Costs no space: what is missing reads as zeros. HDF5 File Format Specification 3.0, II.A (superblock).
    """
    with suppress(OSError, KeyError, IndexError, struct.error), path.open("r+b") as file:
        head = file.read(64)
        place = {0: 40, 1: 44, 2: 28, 3: 28}[head[8]]
        (length,) = struct.unpack_from("<Q", head, place)
        if os.fstat(file.fileno()).st_size < length < 2**62:
            file.truncate(length)


def _leads_to(number: int, path: Path, there: os.stat_result | None) -> bool:
    """Whether a descriptor is of the file, which may have been removed."""
    if there is not None:
        return os.path.samestat(os.fstat(number), there)
    return os.readlink(f"/proc/self/fd/{number}").removesuffix(" (deleted)") == str(path.resolve())


def _open_numbers() -> list[int]:
    """Descriptors of this process."""
    place = "/proc/self/fd" if Path("/proc/self/fd").is_dir() else "/dev/fd"
    try:
        return [int(name) for name in os.listdir(place)]
    except OSError:
        return []


@contextmanager
def _spare_file() -> Iterator[int]:
    """A file without a place on the disk."""
    if hasattr(os, "memfd_create"):
        number = os.memfd_create("results", getattr(os, "MFD_CLOEXEC", 0))
    else:
        with tempfile.TemporaryFile() as file:
            number = os.dup(file.fileno())
    try:
        yield number
    finally:
        os.close(number)
