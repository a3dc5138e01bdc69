"""results.h5, written by all ranks, with results.xdmf beside it.

/mesh/points (n, 3), /mesh/cells (e, k), /mesh/node_numbers (n,), /mesh/cell_numbers (e,),
/mesh/groups/NAME (m,) indices of points; /steps/00000/FIELD (n, ...) or (e, ...), one group a step with
its time and more as attributes. Rows are in the mesh file's order, one contiguous slab a rank.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.errors import EnvironmentProblem, cannot_write
from ancf_petsc.results.folder import unlocked
from ancf_petsc.results.rollback import GoesOn, RawNumbers
from ancf_petsc.results.space import DiskSpace, lengthen
from ancf_petsc.results.xdmf import Dataset, Xdmf, link_name

FORMAT = 1
PER_DATASET = 2048  # bytes that HDF5 takes to describe a dataset, its link and its attributes, at most
LONGEST_ATTRIBUTE = 60_000  # HDF5 keeps an attribute within 64 KiB
HDF5_ERRORS = (OSError, RuntimeError, KeyError, ValueError)  # h5py's words for what fails in a file
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
        facts: Mapping[str, str] | None = None,
        parallel: bool | None = None,
        goes_on: GoesOn | None = None,
    ) -> None:
        """facts: further attributes, on the root rank. parallel: write by all ranks (default: where this h5py
        can) or through the root rank. goes_on: with the file that is there. Raises EnvironmentProblem.
        """
        self.path = Path(folder) / "results.h5"
        self.comm = comm
        self.parallel = comm.size > 1 and (h5py.get_config().mpi if parallel is None else parallel)
        self.steps = goes_on.steps if goes_on else 0
        self.numbers = RawNumbers(goes_on.spans if goes_on else None)
        self._space = DiskSpace(self.path)
        self._held: list[h5py.h5d.DatasetID] = []  # of the open file, until all is written
        self._xdmf = Xdmf(self.path.with_suffix(".xdmf"), self.path.name)
        attributes = {"title": title, "units": units, "note": note, "format": FORMAT, "version": version}
        attributes |= comm.bcast(dict(facts or {}))
        self._access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
        self._access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
        with self._agreed():
            if self.parallel:
                self._access.set_fapl_mpio(comm, MPI.Info())
            elif hasattr(self._access, "set_file_locking"):  # later HDF5 than Debian 12's first
                self._access.set_file_locking(False, False)
        with self._agreed():
            if comm.rank == 0:
                self._space.create()
        self._goes_on = goes_on is not None
        if self._goes_on:
            with self._agreed(self._xdmf.path):
                if comm.rank == 0:
                    self._xdmf.go_on()
            return
        with self._agreed(), unlocked():
            if self.parallel or comm.rank == 0:
                h5py.h5f.create(os.fsencode(self.path), h5py.h5f.ACC_TRUNC, fapl=self._access).close()
        self._reserve(sum(len(value.encode()) for value in map(str, attributes.values())))
        with self._open() as file, self._agreed():
            if file:
                for name, value in attributes.items():
                    _put_attribute(file, name, value)

    def close(self) -> None:
        """Let other programs write to the file again. Not collective."""
        self._space.close()

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
        self._xdmf.set_mesh(kind, where, topology)
        if self._goes_on:
            return
        tables = [
            Share(where, np.ascontiguousarray(points, float), self._nodes),
            Share(topology, np.ascontiguousarray(cells, np.int64), self._cells),
            _numbers("/mesh/node_numbers", node_numbers, self._nodes),
            _numbers("/mesh/cell_numbers", cell_numbers, self._cells),
        ]
        for name, size in sizes.items():
            mine = groups.get(name, np.empty(0, np.int64))
            tables.append(_numbers(f"/mesh/groups/{link_name(name)}", mine, Slab(0, len(mine), size)))
        self._reserve(sum(8 * math.prod(table.dataset.shape) + PER_DATASET for table in tables))
        with self._open() as file:
            with self._agreed():
                if file:
                    file.create_group("/mesh/groups")
                    file.create_group("/steps")
                    file["mesh"].attrs["kind"] = kind
            self._write(file, tables)

    def prepare_step(self, node_fields: Mapping[str, int], cell_fields: Mapping[str, int]) -> None:
        """Reserve the space of a step, given by names and numbers a row. Raises EnvironmentProblem, where there
        is none, before anything of the step is written.
        """
        rows = ((self._nodes.total, node_fields), (self._cells.total, cell_fields))
        self._reserve(
            sum(8 * total * width + PER_DATASET for total, widths in rows for width in widths.values())
        )

    def write_step(
        self, time: float, node_fields: Fields, cell_fields: Fields, extra: Mapping[str, Any] | None = None
    ) -> None:
        """Fields (slab, ...) by name over nodes and cells; extra: attributes, the same on all ranks.

        Fields may be pairs that are made one after the other: each is written before the next is asked for;
        `prepare_step` has to reserve their space.
        """
        if isinstance(node_fields, Mapping) and isinstance(cell_fields, Mapping):
            self.prepare_step(_widths(node_fields), _widths(cell_fields))
        where = f"/steps/{self.steps:05d}"
        written: list[Dataset] = []
        with self._open() as file:
            with self._agreed():
                if file:
                    group = h5py.Group(h5py.h5g.create(file.id, where.encode()))
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
                if file:  # last: a step without its time is not whole
                    _put_number(group, "time", time)
                if file and self.steps == 0:
                    for key, centre in (("node_fields", "Node"), ("cell_fields", "Cell")):
                        file["steps"].attrs[key] = [each.name for each in written if each.centre == centre]
        self._xdmf.add_step(float(time), written)
        with self._agreed(self._xdmf.path):
            if self.comm.rank == 0:
                self._xdmf.write()
        self.steps += 1

    def _reserve(self, size: int) -> None:
        """Have the disk keep `size` bytes and a little more for what is written next."""
        with self._agreed():
            if self.comm.rank == 0:
                self._space.reserve(size)

    def _slab(self, rows: int) -> Slab:
        before = self.comm.exscan(rows)
        start = before if self.comm.rank else 0
        return Slab(start, start + rows, self.comm.allreduce(rows))

    @contextmanager
    def _open(self) -> Iterator[h5py.File | None]:
        """The file, on every rank that writes."""
        file = None
        try:
            with self._agreed(), unlocked():
                if self.parallel or self.comm.rank == 0:
                    number = h5py.h5f.open(os.fsencode(self.path), h5py.h5f.ACC_RDWR, self._access)
                    file = h5py.File(number)
            yield file
            with self._agreed():  # while all objects are open: HDF5 reports no failure as one is closed
                if file:
                    h5py.h5f.flush(file.id)
                    self.numbers.note(self._held)
            self._held.clear()
            with self._agreed():
                if file:
                    file.id.close()
        except EnvironmentProblem:  # of all ranks; any other error is of this one alone, and closing waits
            self._space.divert()
            with suppress(*HDF5_ERRORS):
                self._held.clear()
                if file:
                    file.close()
            if self.comm.rank == 0:
                lengthen(self.path)
            raise

    def _write(self, file: h5py.File | None, tables: list[Share]) -> None:
        """Make all datasets and write slabs; the root rank writes for all where this h5py cannot in parallel."""
        if not self.parallel:
            with self._agreed():
                self._write_through_root(file, tables)
            return
        with self._agreed():  # collective
            made = [self._create(file, table) for table in tables] if file else []
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
        problem: Exception | None = None
        for index, table in enumerate(tables):
            data = None
            for rank, place in enumerate(places):
                start, count = place[index]
                rows = table.rows if rank == 0 else np.empty((count, *table.rows.shape[1:]), table.rows.dtype)
                if rank:
                    self.comm.Recv(rows, rank)
                try:
                    data = data or self._create(file, table)
                    _write_rows(data, start, rows)
                except HDF5_ERRORS as error:
                    self._space.divert()
                    problem = problem or error  # the others still send: take it all, then tell
        if problem:
            raise problem

    def _create(self, file: h5py.File, table: Share) -> h5py.h5d.DatasetID:
        """h5py's low-level calls: half the time of its datasets, which counts where steps are many and small."""
        kind = h5py.h5t.py_create(table.rows.dtype)
        space = h5py.h5s.create_simple(table.dataset.shape)
        data = h5py.h5d.create(file.id, table.dataset.path.encode(), kind, space)
        self._held.append(data)
        return data

    def _gathered(self, value: Any) -> list[Any]:
        """Of all ranks, on the root rank."""
        return [value] if self.comm.size == 1 else self.comm.gather(value) or []

    @contextmanager
    def _agreed(self, path: Path | None = None) -> Iterator[None]:
        """What fails on one rank is raised on all, so that none waits for the others."""
        problem = None
        try:
            yield
        except EnvironmentProblem as error:
            problem = error
        except HDF5_ERRORS as error:
            problem = cannot_write(error, path or self.path)
            self._space.divert()  # before objects of HDF5 go out of use with what they could not write
        problems = [problem] if self.comm.size == 1 else self.comm.allgather(problem)
        first = next((one for one in problems if one is not None), None)
        if first is not None:
            raise first


def _field(path: str, rows: Array, slab: Slab, centre: str) -> Share:
    """(m,), (m, 3) as they are; (m, 3, 3) as (m, 9)."""
    rows = np.ascontiguousarray(rows, float)
    rows = rows.reshape(len(rows), math.prod(rows.shape[1:])) if rows.ndim > 2 else rows
    return Share(Dataset(path, (slab.total, *rows.shape[1:]), centre=centre), rows, slab)


def _numbers(path: str, rows: Array, slab: Slab) -> Share:
    return Share(Dataset(path, (slab.total,), integer=True), np.ascontiguousarray(rows, np.int64), slab)


def _widths(fields: Mapping[str, Array]) -> dict[str, int]:
    """Numbers a row of each field."""
    return {name: math.prod(np.shape(rows)[1:]) for name, rows in fields.items()}


def _put_attribute(file: h5py.File, name: str, value: Any) -> None:
    """An attribute; a text too long for one becomes a dataset, which the attribute names."""
    if isinstance(value, str) and len(value.encode()) > LONGEST_ATTRIBUTE:
        file[name] = value
        value = f"see the dataset /{name}"
    file.attrs[name] = value


def _put_number(group: h5py.Group, name: str, value: float) -> None:
    """An attribute, by low-level calls."""
    space = h5py.h5s.create(h5py.h5s.SCALAR)
    h5py.h5a.create(group.id, name.encode(), h5py.h5t.NATIVE_DOUBLE, space).write(np.array(value, float))


def _write_rows(data: h5py.h5d.DatasetID, start: int, rows: Array) -> None:
    if len(rows) == 0:
        return
    if data.shape == rows.shape:
        data.write(h5py.h5s.ALL, h5py.h5s.ALL, rows)
        return
    space = data.get_space()
    space.select_hyperslab((start, *(0,) * (rows.ndim - 1)), rows.shape)
    data.write(h5py.h5s.create_simple(rows.shape), space, rows)
