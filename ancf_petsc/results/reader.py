"""Read what a run left: curves and fields as numpy arrays, without MPI."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.mesh.foreign.guard import Refused, check_dataset
from ancf_petsc.results.folder import unlocked
from ancf_petsc.results.tables import file_text, read_table
from ancf_petsc.results.xdmf import CELL_KINDS, field_name, link_name

if TYPE_CHECKING:
    import pyvista

DAMAGE = (
    OSError,
    KeyError,
    ValueError,
    TypeError,
    AttributeError,
    RuntimeError,
    IndexError,
    OverflowError,
    Refused,
)
"""What h5py raises for files that are damaged or not ours."""

Array = NDArray[Any]
Columns = dict[str, NDArray[np.float64]]


def open_results(folder: str | Path) -> Results:
    """The run in a folder, finished or still going on; CaseError where there is none."""
    return Results(Path(folder))


class Results:
    """A run. Everything but the names is read when it is asked for.

    title, units, note, kind: as the case and the mesh have them; kind is meshio's name of the cells.
    times: (steps,) pseudo-time of statics, time of motion, one an output.
    extras: attributes of every step.
    facts: attributes of the file, as text: case, hash, mesh_file, mesh_sha256, date, host, command, versions ...
    fields: names of what every step holds: node_fields over nodes, cell_fields over cells.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / "results.h5"
        if "\0" in str(folder):
            raise CaseError(
                "a NUL character in a path", got=str(folder), expected="a folder", cure="remove it"
            )
        if not self.path.is_file():
            raise CaseError("no results here", file=folder, expected="a folder that `ancf run` has written")
        with self._reading() as file:
            self._read_names(file)

    @contextmanager
    def _reading(self) -> Iterator[h5py.File]:
        """results.h5, open; what is damaged or missing in it is a CaseError."""
        try:
            with unlocked(), h5py.File(self.path, "r", locking=False) as file:
                yield file
        except DAMAGE as error:
            raise self._damaged(" ".join(str(error).split()) or type(error).__name__) from error

    def _damaged(self, what: str) -> CaseError:
        cure = "the run may have been killed while it wrote, or the file is damaged: run again"
        return CaseError(f"cannot be read: {what}", file=self.path, cure=cure)

    def _read_names(self, file: h5py.File) -> None:
        self.facts = {name: _text(file, name) for name in file.attrs}
        self.title, self.units = self.facts["title"], self.facts["units"]
        self.note = self.facts.get("note", "")
        self.kind = str(file["mesh"].attrs["kind"])
        steps = file["steps"]
        self._steps = sorted((name for name in steps if "time" in steps[name].attrs), key=int)
        self.times = np.array([steps[name].attrs["time"] for name in self._steps], float)
        self.extras = [dict(steps[name].attrs) for name in self._steps]
        self.node_fields = _names(steps, "node_fields")
        self.cell_fields = _names(steps, "cell_fields")
        self.fields = self.node_fields + self.cell_fields
        if self.kind not in CELL_KINDS or self.times.ndim != 1:
            raise Refused(f"{len(self.times)} steps of {self.kind!r} cells")

    @cached_property
    def summary(self) -> dict[str, Any]:
        """summary.json; empty while the run goes on."""
        path = self.folder / "summary.json"
        if not path.is_file():
            return {}
        try:
            return dict(json.loads(file_text(path)))
        except (OSError, ValueError, TypeError, RecursionError) as error:
            raise CaseError(f"cannot be read: {error}", file=path, cure="run again") from error

    @cached_property
    def curve(self) -> Columns:
        """Columns (rows,) of curve.csv by name. Raises CaseError where the folder holds modes."""
        if self.holds_modes:
            raise CaseError(
                "modes have no curves",
                file=self.folder,
                cure=f"modes.csv has the frequencies, ancf view {shlex.quote(str(self.folder))} the shapes",
            )
        return read_table(self.folder / "curve.csv")

    @property
    def holds_modes(self) -> bool:
        """Whether the steps are shapes of vibration, `times` their numbers and extras their frequencies."""
        return bool(self.extras) and all("frequency" in extra for extra in self.extras)

    @cached_property
    def probes(self) -> Columns:
        """Columns (rows,) of probes.csv by name; empty where the case has no probe."""
        path = self.folder / "probes.csv"
        return read_table(path) if path.is_file() else {}

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """(n, 3) undeformed."""
        points = self._dataset("mesh/points")
        if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind != "f":
            raise self._damaged(f"points of shape {points.shape}")
        return points

    @cached_property
    def cells(self) -> NDArray[np.int64]:
        """(e, k) indices of points."""
        cells, nodes = self._dataset("mesh/cells"), CELL_KINDS[self.kind].nodes
        if cells.ndim != 2 or cells.shape[1] != nodes or cells.dtype.kind not in "iu":
            raise self._damaged(f"{self.kind} cells of shape {cells.shape}")
        if cells.size and not 0 <= cells.min() <= cells.max() < len(self.points):
            raise self._damaged("cells have nodes that are not there")
        return cells

    @cached_property
    def node_numbers(self) -> NDArray[np.int64]:
        """(n,) numbers in the mesh file."""
        return self._dataset("mesh/node_numbers")

    @cached_property
    def cell_numbers(self) -> NDArray[np.int64]:
        """(e,) numbers in the mesh file."""
        return self._dataset("mesh/cell_numbers")

    @cached_property
    def groups(self) -> dict[str, NDArray[np.int64]]:
        """name -> (m,) indices of points."""
        with self._reading() as file:
            links = list(file["mesh/groups"])
        found = {field_name(link): self._dataset(f"mesh/groups/{link}") for link in links}
        for name, nodes in found.items():
            inside = nodes.ndim == 1 and nodes.dtype.kind in "iu"
            if not inside or nodes.size and not 0 <= nodes.min() <= nodes.max() < len(self.points):
                raise self._damaged(f"the group {name} has nodes that are not there")
        return found

    def field(self, name: str, step: int = -1) -> Array:
        """Values (n, ...) over nodes or (e, ...) over cells at a step, counted from 0 or from the end."""
        if name not in self.fields:
            raise CaseError("no such field", file=self.path, got=name, cure=did_you_mean(name, self.fields))
        values = self._dataset(f"steps/{self._steps[self.step_number(step)]}/{link_name(name)}")
        rows = len(self.points if name in self.node_fields else self.cells)
        if values.shape[:1] != (rows,) or values.dtype.kind not in "iuf":
            raise self._damaged(f"the field {name} has the shape {values.shape} for {rows} rows")
        return values

    def step_at(self, time: float) -> int:
        """The step nearest to a time."""
        return int(np.argmin(np.abs(self.times - time)))

    def mesh(
        self, step: int = -1, *, scale: float = 1.0, fields: Iterable[str] | None = None
    ) -> pyvista.UnstructuredGrid:
        """The body at a step for pyvista, with all fields or some; displacements times `scale`."""
        import pyvista

        count, nodes = self.cells.shape
        connectivity = np.hstack([np.full((count, 1), nodes), self.cells])
        points = self.points + scale * self.field("displacement", step)
        grid = pyvista.UnstructuredGrid(connectivity, np.full(count, CELL_KINDS[self.kind].vtk), points)
        for name in self.fields if fields is None else fields:
            data = grid.point_data if name in self.node_fields else grid.cell_data
            data[name] = self.field(name, step)
        return grid

    def step_number(self, step: int) -> int:
        """A step counted from 0, given from 0 or from the end (-1); CaseError where there is none."""
        count = len(self._steps)
        if not -count <= step < count:
            raise CaseError(
                "no such step", file=self.path, got=step, expected=f"0 to {count - 1}, or -1 for the last"
            )
        return step % count

    def _dataset(self, path: str) -> Array:
        with self._reading() as file:
            one: Any = file
            for name in path.split("/"):
                if isinstance(one.get(name, getlink=True), h5py.ExternalLink):
                    raise Refused(f"{path} is a link to another file")
                one = one[name]
            check_dataset(one)
            return np.asarray(one[()])


def _names(steps: h5py.Group, name: str) -> tuple[str, ...]:
    """An attribute that lists names."""
    given = steps.attrs.get(name, ())
    if isinstance(given, str | bytes) or np.ndim(given) != 1:
        raise Refused(f"{name} is no list of names")
    return tuple(map(str, given))


def _text(file: h5py.File, name: str) -> str:
    """An attribute of the file; one too long for HDF5 is a dataset of that name."""
    if name in file and isinstance(file[name], h5py.Dataset):
        return str(file[name].asstr()[()])
    return str(file.attrs[name])
