"""Where the time of a run goes."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager


class Clock:
    """Seconds spent in the parts of a run. A part inside another counts for itself only."""

    PARTS = ("import", "read", "setup", "solve", "output")

    def __init__(self, imports: float = 0.0) -> None:
        self.seconds = dict.fromkeys(self.PARTS, 0.0)
        self.seconds["import"] = imports
        self._begun, self._before = time.perf_counter(), imports
        self._inner = [0.0]

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Count the time of a block under `name`."""
        before = time.perf_counter()
        self._inner.append(0.0)
        try:
            yield
        finally:
            spent = time.perf_counter() - before
            self.seconds[name] += spent - self._inner.pop()
            self._inner[-1] += spent

    def add(self, earlier: Mapping[str, float]) -> None:
        """Count the seconds that `report` gave of earlier parts of the run too."""
        for name in self.PARTS:
            self.seconds[name] += earlier[name]
        self._before += earlier["total"]

    def report(self) -> dict[str, float]:
        """Seconds by part, and in total, imports included."""
        return {**self.seconds, "total": self._before + time.perf_counter() - self._begun}
