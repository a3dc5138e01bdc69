"""results.h5, written by all ranks, with results.xdmf beside it.

/mesh/points (n, 3), /mesh/cells (e, k), /mesh/node_numbers (n,), /mesh/cell_numbers (e,),
/mesh/groups/NAME (m,) indices of points; /steps/00000/FIELD (n, ...) or (e, ...), one group a step with
its time and more as attributes. Rows are in the mesh file's order, one contiguous slab a rank.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.errors import EnvironmentProblem
from ancf_petsc.results.xdmf import Dataset, Xdmf, link_name

FORMAT = 1
Array = NDArray[Any]
Fields = Mapping[str, Array] | Iterable[tuple[str, Array]]


@dataclass(frozen=True)
class Slab:
    """This rank's rows, start to stop, of a table of `total` rows."""

    start: int
    stop: int
    total: int


@dataclass(frozen=True)
class Share:
    """A dataset, and this rank's rows of it."""

    dataset: Dataset
    rows: Array
    slab: Slab

    def __post_init__(self) -> None:
        expected = (self.slab.stop - self.slab.start, *self.dataset.shape[1:])
        if self.rows.shape != expected:
            raise ValueError(f"{self.dataset.path}: rows {self.rows.shape}, expected {expected}")


class ResultStore:
    """Every method is collective. The file is closed after each: what was written is whole on disk."""

    def __init__(
        self,
        folder: Path,
        comm: MPI.Intracomm,
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
        self._access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
        self._access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
        with self._agreed():
            if self.parallel:
                self._access.set_fapl_mpio(comm, MPI.Info())
            elif hasattr(
                self._access, "set_file_locking"
            ):  # a viewer that holds the file does not stop the run
                self._access.set_file_locking(False, False)
            if self.parallel or comm.rank == 0:
                h5py.h5f.create(os.fsencode(self.path), h5py.h5f.ACC_TRUNC, fapl=self._access).close()
        with self._open() as file:
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
        """points (slab, 3), cells (slab, k) indices of points, numbers (slab,); groups: on the root rank."""
        self._nodes = self._slab(len(points))
        self._cells = self._slab(len(cells))
        groups = {name: np.asarray(nodes, np.int64) for name, nodes in (groups or {}).items()}
        sizes = self.comm.bcast({name: len(nodes) for name, nodes in groups.items()})

        where = Dataset("/mesh/points", (self._nodes.total, 3))
        topology = Dataset("/mesh/cells", (self._cells.total, *np.shape(cells)[1:]), integer=True)
        tables = [
            Share(where, np.ascontiguousarray(points, float), self._nodes),
            Share(topology, np.ascontiguousarray(cells, np.int64), self._cells),
            _numbers("/mesh/node_numbers", node_numbers, self._nodes),
            _numbers("/mesh/cell_numbers", cell_numbers, self._cells),
        ]
        for name, size in sizes.items():
            mine = groups.get(name, np.empty(0, np.int64))
            tables.append(_numbers(f"/mesh/groups/{link_name(name)}", mine, Slab(0, len(mine), size)))
        with self._open() as file:
            if file:
                file.create_group("/mesh/groups")
                file.create_group("/steps")
                file["mesh"].attrs["kind"] = kind
            self._write(file, tables)
        self._xdmf.set_mesh(kind, where, topology)

    def write_step(
        self, time: float, node_fields: Fields, cell_fields: Fields, extra: Mapping[str, Any] | None = None
    ) -> None:
        """Fields (slab, ...) by name over nodes and cells; extra: attributes, the same on all ranks.

        Fields may be pairs that are made one after the other: each is written before the next is asked for.
        """
        where = f"/steps/{self.steps:05d}"
        written: list[Dataset] = []
        with self._open() as file:
            with self._agreed():
                if file:
                    group = h5py.Group(h5py.h5g.create(file.id, where.encode()))
                    _put_number(group, "time", time)
                    for name, value in (extra or {}).items():
                        group.attrs[name] = value
            for centre, slab, fields in (
                ("Node", self._nodes, node_fields),
                ("Cell", self._cells, cell_fields),
            ):
                for name, rows in fields.items() if isinstance(fields, Mapping) else fields:
                    table = _field(f"{where}/{link_name(name)}", rows, slab, centre)
                    self._write(file, [table])
                    written.append(table.dataset)
                    del table, rows  # before the next is made
            with self._agreed():
                if file and self.steps == 0:
                    for key, centre in (("node_fields", "Node"), ("cell_fields", "Cell")):
                        file["steps"].attrs[key] = [each.name for each in written if each.centre == centre]
        self._xdmf.add_step(float(time), written)
        with self._agreed():
            if self.comm.rank == 0:
                self._xdmf.write()
        self.steps += 1

    def _slab(self, rows: int) -> Slab:
        before = self.comm.exscan(rows)
        start = before if self.comm.rank else 0
        return Slab(start, start + rows, self.comm.allreduce(rows))

    @contextmanager
    def _open(self) -> Iterator[h5py.File | None]:
        """The file, on every rank that writes."""
        file = None
        with self._agreed():
            if self.parallel or self.comm.rank == 0:
                number = h5py.h5f.open(os.fsencode(self.path), h5py.h5f.ACC_RDWR, self._access)
                file = h5py.File(number)
        try:
            yield file
        except EnvironmentProblem:  # of all ranks; any other error is of this one alone, and closing waits
            if file:
                file.id.close()
            raise
        with self._agreed():
            if file:
                file.id.close()

    def _write(self, file: h5py.File | None, tables: list[Share]) -> None:
        """Make all datasets and write slabs; the root rank writes for all where this h5py cannot in parallel."""
        if not self.parallel:
            with self._agreed():
                self._write_through_root(file, tables)
            return
        with self._agreed():  # collective
            made = [_create(file, table) for table in tables] if file else []
        with self._agreed():
            for data, table in zip(made, tables, strict=True):
                _write_rows(data, table.slab.start, table.rows)

    def _write_through_root(self, file: h5py.File | None, tables: list[Share]) -> None:
        """One slab after the other, so that the root rank never holds a whole table."""
        places = self._gathered([(table.slab.start, len(table.rows)) for table in tables])
        if file is None:
            for table in tables:
                self.comm.Send(table.rows, 0)
            return
        problem: OSError | RuntimeError | None = None
        for index, table in enumerate(tables):
            data = None
            for rank, place in enumerate(places):
                start, count = place[index]
                rows = table.rows if rank == 0 else np.empty((count, *table.rows.shape[1:]), table.rows.dtype)
                if rank:
                    self.comm.Recv(rows, rank)
                try:
                    data = data or _create(file, table)
                    _write_rows(data, start, rows)
                except (OSError, RuntimeError) as error:
                    problem = problem or error  # the others still send: take it all, then tell
        if problem:
            raise problem

    def _gathered(self, value: Any) -> list[Any]:
        """Of all ranks, on the root rank."""
        return [value] if self.comm.size == 1 else self.comm.gather(value) or []

    @contextmanager
    def _agreed(self) -> Iterator[None]:
        """What fails on one rank is raised on all, so that none waits for the others."""
        problem = ""
        try:
            yield
        except (OSError, RuntimeError) as error:  # h5py's two words for a write that failed
            problem = str(error)
        problems = [problem] if self.comm.size == 1 else self.comm.allgather(problem)
        if any(problems):
            reason = next(filter(None, problems))
            raise EnvironmentProblem(f"{self.path}: cannot be written: {reason}; look for space on the disk")


def _field(path: str, rows: Array, slab: Slab, centre: str) -> Share:
    """(m,), (m, 3) as they are; (m, 3, 3) as (m, 9)."""
    rows = np.ascontiguousarray(rows, float)
    rows = rows.reshape(len(rows), math.prod(rows.shape[1:])) if rows.ndim > 2 else rows
    return Share(Dataset(path, (slab.total, *rows.shape[1:]), centre=centre), rows, slab)


def _numbers(path: str, rows: Array, slab: Slab) -> Share:
    return Share(Dataset(path, (slab.total,), integer=True), np.ascontiguousarray(rows, np.int64), slab)


def _put_number(group: h5py.Group, name: str, value: float) -> None:
    """An attribute, by low-level calls."""
    space = h5py.h5s.create(h5py.h5s.SCALAR)
    h5py.h5a.create(group.id, name.encode(), h5py.h5t.NATIVE_DOUBLE, space).write(np.array(value, float))


def _create(file: h5py.File, table: Share) -> h5py.h5d.DatasetID:
    """h5py's low-level calls: half the time of its datasets, which counts where steps are many and small."""
    kind = h5py.h5t.py_create(table.rows.dtype)
    space = h5py.h5s.create_simple(table.dataset.shape)
    return h5py.h5d.create(file.id, table.dataset.path.encode(), kind, space)


def _write_rows(data: h5py.h5d.DatasetID, start: int, rows: Array) -> None:
    if len(rows) == 0:
        return
    if data.shape == rows.shape:
        data.write(h5py.h5s.ALL, h5py.h5s.ALL, rows)
        return
    space = data.get_space()
    space.select_hyperslab((start, *(0,) * (rows.ndim - 1)), rows.shape)
    data.write(h5py.h5s.create_simple(rows.shape), space, rows)
