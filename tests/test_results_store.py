"""results.h5 and results.xdmf: the same on any number of ranks, open to readers that are not ours."""

from __future__ import annotations

import fcntl
import resource
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import h5py
import meshio
import numpy as np
import pytest
import pyvista
import results_writer as run
from mpi4py import MPI

from ancf_petsc.errors import EnvironmentProblem
from ancf_petsc.results.store import ResultStore
from ancf_petsc.results.tables import read_table
from ancf_petsc.results.xdmf import CELL_KINDS, Dataset, Xdmf

WRITER = Path(run.__file__)
LAST = run.TIMES[-1]


@pytest.fixture(
    scope="module", params=["1 rank", "2 ranks", "3 ranks", "2 ranks gathered", "3 ranks gathered"]
)
def folder(request, environment, tmp_path_factory) -> Path:
    """A run written on 1, 2, 3 ranks by parallel HDF5, and through the root rank."""
    path = tmp_path_factory.mktemp("run")
    ranks, _, *gathered = request.param.split()
    subprocess.run(
        ["mpiexec", "-n", ranks, sys.executable, WRITER, path, *gathered],
        env=environment,
        check=True,
        timeout=120,
    )
    return path


def test_every_number_arrives_in_file_order(folder):
    points, cells = run.mesh()
    with h5py.File(folder / "results.h5") as file:
        assert dict(file.attrs) == {
            "title": run.TITLE, "units": run.UNITS, "note": run.NOTE, "format": 1, "version": "0"
        }  # fmt: skip
        np.testing.assert_array_equal(file["mesh/points"][()], points)
        np.testing.assert_array_equal(file["mesh/cells"][()], cells)
        np.testing.assert_array_equal(file["mesh/node_numbers"][()], np.arange(10, 18))
        np.testing.assert_array_equal(file["mesh/cell_numbers"][()], np.arange(100, 106))
        np.testing.assert_array_equal(file["mesh/groups/base"][()], run.GROUPS["base"])
        assert list(file["steps"]) == ["00000", "00001", "00002", "00003"]
        for time, step in zip(run.TIMES, file["steps"].values(), strict=True):
            assert step.attrs["time"] == time
            assert step.attrs["stroke"] == -0.1 * time
            for name, rows in {**run.node_fields(time), **run.cell_fields(time)}.items():
                expected = rows.reshape(len(rows), 9) if rows.ndim == 3 else rows
                np.testing.assert_array_equal(step[name][()], expected)


def test_pyvista_reads_the_series_as_an_unstructured_grid(folder):
    reader = pyvista.get_reader(folder / "results.xdmf")
    assert reader.time_values == list(read_table(folder / "curve.csv")["pseudo_time"])
    for time in run.TIMES:
        reader.set_active_time_value(time)
        grid = reader.read()
        assert isinstance(grid, pyvista.UnstructuredGrid)
        np.testing.assert_array_equal(grid.cells_dict[pyvista.CellType.TETRA], run.mesh()[1])
        np.testing.assert_array_equal(grid.points, run.mesh()[0])
        for name, rows in run.node_fields(time).items():
            np.testing.assert_array_equal(grid.point_data[name], rows)
        np.testing.assert_array_equal(
            grid.cell_data["cauchy"], run.cell_fields(time)["cauchy"].reshape(-1, 9)
        )
        np.testing.assert_array_equal(grid.cell_data["det_F"], run.cell_fields(time)["det_F"])


def test_meshio_reads_the_series(folder):
    with meshio.xdmf.TimeSeriesReader(folder / "results.xdmf") as reader:
        points, cells = reader.read_points_cells()
        read = [reader.read_data(step) for step in range(reader.num_steps)]
    np.testing.assert_array_equal(points, run.mesh()[0])
    assert [block.type for block in cells] == ["tetra"]
    np.testing.assert_array_equal(cells[0].data, run.mesh()[1])
    assert tuple(time for time, _, _ in read) == run.TIMES
    _, at_nodes, over_cells = read[-1]
    np.testing.assert_array_equal(at_nodes["displacement"], run.node_fields(LAST)["displacement"])
    np.testing.assert_array_equal(over_cells["cauchy"][0], run.cell_fields(LAST)["cauchy"].reshape(-1, 9))


@pytest.mark.parametrize("kind", CELL_KINDS)
def test_both_readers_know_the_cells(kind, tmp_path):
    """One cell of every kind: type and order of nodes survive."""
    known = CELL_KINDS[kind]
    points = np.random.default_rng(1).random((known.nodes, 3))
    cells = np.arange(known.nodes)[None]
    store = ResultStore(tmp_path, MPI.COMM_SELF, "one cell", "SI")
    store.write_mesh(points, kind, cells, np.arange(known.nodes), np.arange(1))
    store.write_step(0.0, {"displacement": points}, {})
    grid = pyvista.get_reader(tmp_path / "results.xdmf").read()
    assert grid.celltypes.tolist() == [pyvista.CellType.POLY_LINE if kind == "line" else known.vtk]
    np.testing.assert_array_equal(grid.points[grid.cell_connectivity], points)
    with meshio.xdmf.TimeSeriesReader(tmp_path / "results.xdmf") as reader:
        _, (block,) = reader.read_points_cells()
    assert block.type == kind
    np.testing.assert_array_equal(block.data, cells)


def test_every_step_is_whole_on_disk_when_it_is_written(tmp_path):
    points, cells = run.mesh()
    store = ResultStore(tmp_path, MPI.COMM_SELF, "t", "SI")
    store.write_mesh(points, "tetra", cells, np.arange(8), np.arange(6))
    for step, time in enumerate(run.TIMES):
        store.write_step(time, run.node_fields(time), run.cell_fields(time))
        assert pyvista.get_reader(tmp_path / "results.xdmf").time_values == list(run.TIMES[: step + 1])
        assert not list(tmp_path.glob("*.part"))


def test_a_viewer_that_holds_the_file_does_not_stop_the_run(tmp_path):
    points, cells = run.mesh()
    store = ResultStore(tmp_path, MPI.COMM_SELF, "t", "SI")
    store.write_mesh(points, "tetra", cells, np.arange(8), np.arange(6))
    with (tmp_path / "results.h5").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_SH)  # what HDF5 does for a reader
        store.write_step(0.5, run.node_fields(0.5), {})
    with h5py.File(tmp_path / "results.h5", "r") as file:
        assert file["steps/00000"].attrs["time"] == 0.5


FAILING = """
import sys
import fcntl
import resource
import subprocess
import sys
from pathlib import Path
from mpi4py import MPI
from ancf_petsc.errors import EnvironmentProblem
from ancf_petsc.results.store import ResultStore
try:
    ResultStore(Path(sys.argv[1]) / "missing", MPI.COMM_WORLD, "t", "SI", parallel=sys.argv[2] == "parallel")
except EnvironmentProblem as error:
    Path(sys.argv[1], f"told_{MPI.COMM_WORLD.rank}").write_text(str(error))
"""


@pytest.mark.parametrize("way", ["parallel", "gathered"])
def test_what_fails_on_one_rank_is_raised_on_all(way, mpirun, tmp_path):
    mpirun(2, ["-c", FAILING, tmp_path, way])
    for rank in range(2):
        assert "cannot be written" in (tmp_path / f"told_{rank}").read_text()


def test_rows_that_do_not_fill_the_slab_are_refused(tmp_path):
    points, cells = run.mesh()
    store = ResultStore(tmp_path, MPI.COMM_SELF, "t", "SI")
    store.write_mesh(points, "tetra", cells, np.arange(8), np.arange(6))
    with pytest.raises(ValueError, match=r"displacement: rows \(7, 3\), expected \(8, 3\)"):
        store.write_step(0.0, {"displacement": points[:7]}, {})


def test_a_full_disk_is_an_environment_problem(tmp_path):
    (tmp_path / "results.h5").mkdir()
    with pytest.raises(EnvironmentProblem, match=r"results\.h5: cannot be written"):
        ResultStore(tmp_path, MPI.COMM_SELF, "t", "SI")


def test_the_steps_in_xdmf_grow_without_writing_it_anew(tmp_path):
    """The file stays the same one; every state of it is well-formed and lists the steps so far."""
    xdmf = Xdmf(tmp_path / "results.xdmf", "results.h5")
    xdmf.set_mesh("tetra", Dataset("/mesh/points", (4, 3)), Dataset("/mesh/cells", (1, 4), integer=True))
    files = set()
    for step in range(5):
        xdmf.add_step(0.1 * step, [Dataset(f"/steps/{step:05d}/displacement", (4, 3))])
        xdmf.write()
        files.add(xdmf.path.stat().st_ino)
        times = ElementTree.parse(xdmf.path).getroot().iter("Time")
        assert [float(time.get("Value")) for time in times] == [0.1 * k for k in range(step + 1)]
    assert len(files) == 1


def test_xdmf_is_whole_after_a_step_there_was_no_space_for(tmp_path):
    xdmf = Xdmf(tmp_path / "results.xdmf", "results.h5")
    xdmf.set_mesh("tetra", Dataset("/mesh/points", (4, 3)), Dataset("/mesh/cells", (1, 4), integer=True))
    xdmf.add_step(0.0, [])
    xdmf.write()
    before = xdmf.path.read_bytes()
    xdmf.add_step(1.0, [Dataset("/steps/00001/displacement", (4, 3))])
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 10, limit[1]))
    try:
        with pytest.raises(OSError, match="No space left|File too large"):
            xdmf.write()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert xdmf.path.read_bytes() == before
