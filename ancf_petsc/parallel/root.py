"""What the root rank knows, for all ranks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.parallel.exchange import lookup, scatter_rows
from ancf_petsc.parallel.slabs import slab_bounds

D = TypeVar("D")
K = TypeVar("K")
T = TypeVar("T")


class FromRoot(Generic[K]):
    """Hands out what the root rank holds; on other ranks it is empty. Every call is collective.

    A call takes a function that picks something from what is held; it is called on the root rank alone and must not fail.
    """

    def __init__(self, comm: MPI.Comm, held: K | None) -> None:
        self.comm = comm
        self._held = held

    def _pick(self, of: Callable[[K], T]) -> T | None:
        return None if self._held is None else of(self._held)

    def derived(self, of: Callable[[K], D]) -> FromRoot[D]:
        """The same with what can be made of what is held."""
        return FromRoot(self.comm, self._pick(of))

    def local(self, of: Callable[[K], T], otherwise: T) -> T:
        """Something for the root rank alone; other ranks get `otherwise`. Nothing is sent."""
        found = self._pick(of)
        return otherwise if found is None else found

    def value(self, of: Callable[[K], T]) -> T:
        """Something small, on every rank."""
        return self.comm.bcast(self._pick(of))

    def slab(self, of: Callable[[K], NDArray]) -> NDArray:
        """This rank's slab of a table."""
        return scatter_rows(self.comm, self._pick(of))

    def rows(self, of: Callable[[K], NDArray], wanted: NDArray) -> NDArray:
        """The rows of a table whose numbers are wanted on this rank."""
        table = self._pick(of)
        total = self.comm.bcast(None if table is None else len(table))
        return lookup(self.comm, slab_bounds(total, self.comm.size), scatter_rows(self.comm, table), wanted)
