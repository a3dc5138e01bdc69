"""A polite end: SIGINT, SIGTERM and SIGUSR1 (of batch systems, before the time is over) are noted, and the run stops after the
step it is in.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

from mpi4py import MPI


class StopRequest:
    """Notes signals while it watches. A second SIGINT stops at once."""

    def __init__(self, comm: MPI.Comm) -> None:
        self.comm = comm
        self._noted = False

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Note signals during a block. Outside the main thread there is nothing to note."""
        names = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)
        try:
            before = [signal.signal(name, self._note) for name in names]
        except ValueError:
            yield
            return
        try:
            yield
        finally:
            for name, handler in zip(names, before, strict=True):
                signal.signal(name, handler)

    def asked(self) -> bool:
        """Whether any rank was asked to stop. Collective."""
        if self.comm.size == 1:
            return self._noted
        return bool(self.comm.allreduce(int(self._noted), MPI.MAX))

    def _note(self, number: int, frame: object) -> None:
        if self._noted and number == signal.SIGINT:
            raise KeyboardInterrupt
        self._noted = True
