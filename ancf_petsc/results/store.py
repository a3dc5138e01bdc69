"""results.h5, written by all ranks, with results.xdmf beside it.

/mesh/points (n, 3), /mesh/cells (e, k), /mesh/node_numbers (n,), /mesh/cell_numbers (e,),
/mesh/groups/NAME (m,) indices of points; /steps/00000/FIELD (n, ...) or (e, ...), one group a step with
its time and more as attributes. Rows are in the mesh file's order, one contiguous slab a rank.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ancf_petsc.errors import EnvironmentProblem
from ancf_petsc.results.xdmf import Dataset, Xdmf, link_name

if TYPE_CHECKING:
    from mpi4py import MPI

FORMAT = 1
Array = NDArray[Any]
Fields = Mapping[str, Array]


@dataclass(frozen=True)
class Slab:
    """This rank's rows, start to stop, of a table of `total` rows."""

    start: int
    stop: int
    total: int


class ResultStore:
    """Every method is collective. The file is closed after each: what was written is whole on disk."""

    def __init__(
        self,
        folder: Path,
        comm: MPI.Comm,
        title: str,
        units: str,
        *,
        note: str = "",
        version: str = "",
        parallel: bool | None = None,
    ) -> None:
        """parallel: write by all ranks (default: where this h5py can) or through the root rank."""
        self.path = Path(folder) / "results.h5"
        self.comm = comm
        self.parallel = comm.size > 1 and (h5py.get_config().mpi if parallel is None else parallel)
        self.steps = 0
        self._xdmf = Xdmf(self.path.with_suffix(".xdmf"), self.path.name)
        attributes = {"title": title, "units": units, "note": note, "format": FORMAT, "version": version}
        with self._open("w") as file:
            if file:
                file.attrs.update(attributes)

    def write_mesh(
        self,
        points: Array,
        kind: str,
        cells: Array,
        node_numbers: Array,
        cell_numbers: Array,
        groups: Mapping[str, Array] | None = None,
    ) -> None:
        """points (slab, 3), cells (slab, k) indices of all points, numbers (slab,); groups on the root rank only."""
        self._nodes = self._slab(len(points))
        self._cells = self._slab(len(cells))
        groups = {name: np.asarray(nodes, np.int64) for name, nodes in (groups or {}).items()}
        sizes = self.comm.bcast({name: len(nodes) for name, nodes in groups.items()})

        with self._open() as file:
            where = self._write(file, "/mesh/points", np.asarray(points, float), self._nodes)
            topology = self._write(file, "/mesh/cells", np.asarray(cells, np.int64), self._cells)
            self._write(file, "/mesh/node_numbers", np.asarray(node_numbers, np.int64), self._nodes)
            self._write(file, "/mesh/cell_numbers", np.asarray(cell_numbers, np.int64), self._cells)
            for name, size in sizes.items():
                mine = groups.get(name, np.empty(0, np.int64))
                slab = Slab(0, len(mine), size)
                self._write(file, f"/mesh/groups/{link_name(name)}", mine, slab, moved=False)
            if file:
                file["mesh"].attrs["kind"] = kind
                file.require_group("/mesh/groups")
                file.require_group("/steps")
        self._xdmf.set_mesh(kind, where, topology)

    def write_step(
        self, time: float, node_fields: Fields, cell_fields: Fields, extra: Mapping[str, Any] | None = None
    ) -> None:
        """One output: fields (slab, ...) by name over nodes and cells; extra: attributes, the same on all ranks."""
        where = f"/steps/{self.steps:05d}"
        fields = []
        with self._open() as file:
            if file:
                file.create_group(where).attrs.update({"time": time, **(extra or {})})
            for centre, slab, group in (
                ("Node", self._nodes, node_fields),
                ("Cell", self._cells, cell_fields),
            ):
                for name, values in group.items():
                    rows = _rows_of_components(values)
                    fields.append(self._write(file, f"{where}/{link_name(name)}", rows, slab, centre=centre))
        self._xdmf.add_step(float(time), fields)
        with self._agreed():
            if self.comm.rank == 0:
                self._xdmf.write()
        self.steps += 1

    def _slab(self, rows: int) -> Slab:
        before = self.comm.exscan(rows)
        start = before if self.comm.rank else 0
        return Slab(start, start + rows, self.comm.allreduce(rows))

    @contextmanager
    def _open(self, mode: str = "r+") -> Iterator[h5py.File | None]:
        """The file, on every rank that writes. A viewer that holds the file open does not stop the run."""
        file = None
        with self._agreed():
            if self.parallel:
                file = h5py.File(self.path, mode, driver="mpio", comm=self.comm)
            elif self.comm.rank == 0:
                file = h5py.File(self.path, mode, locking=False)
        try:
            yield file
        finally:
            with self._agreed():
                if file:
                    file.close()

    def _write(
        self,
        file: h5py.File | None,
        path: str,
        rows: Array,
        slab: Slab,
        *,
        centre: str = "Node",
        moved: bool = True,
    ) -> Dataset:
        """A dataset from one slab a rank; moved: the root rank takes the others' where it alone writes."""
        if len(rows) != slab.stop - slab.start:
            raise ValueError(f"{path}: {len(rows)} rows for a slab of {slab.stop - slab.start}")
        rows = np.ascontiguousarray(rows)
        shape = (slab.total, *rows.shape[1:])
        with self._agreed():
            data = file.create_dataset(path, shape, rows.dtype) if file else None
            if data is not None:
                data.attrs["centre"] = centre
        with self._agreed():
            if data is not None and len(rows):
                data[slab.start : slab.stop] = (
                    rows  # independent: h5py skips an empty rank's collective write
                )
        if moved and not self.parallel:
            self._move_to_root(data, rows, slab)
        return Dataset(path, shape, integer=rows.dtype.kind == "i", centre=centre)

    def _move_to_root(self, data: h5py.Dataset | None, rows: Array, slab: Slab) -> None:
        """One slab after the other, so that the root rank never holds the whole table."""
        for rank in range(1, self.comm.size):
            start, stop = self.comm.bcast((slab.start, slab.stop), rank)
            if self.comm.rank == rank:
                self.comm.Send(rows, 0)
            elif self.comm.rank == 0:
                theirs = np.empty((stop - start, *rows.shape[1:]), rows.dtype)
                self.comm.Recv(theirs, rank)
            with self._agreed():
                if data is not None and stop > start:
                    data[start:stop] = theirs

    @contextmanager
    def _agreed(self) -> Iterator[None]:
        """What fails on one rank is raised on all, so that none waits for the others."""
        problem = ""
        try:
            yield
        except (OSError, RuntimeError) as error:  # h5py's two words for a write that failed
            problem = str(error)
        if any(problems := self.comm.allgather(problem)):
            reason = next(filter(None, problems))
            raise EnvironmentProblem(f"{self.path}: cannot be written: {reason}; look for space on the disk")


def _rows_of_components(rows: Array) -> Array:
    """(m,), (m, 3) as they are; (m, 3, 3) as (m, 9)."""
    rows = np.asarray(rows, float)
    return rows.reshape(len(rows), -1) if rows.ndim > 2 else rows
