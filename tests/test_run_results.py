"""What a real run leaves opens in readers that are not ours, and says the same everywhere."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
import pyvista
from conftest import PATIENCE

from ancf_petsc import open_results


@pytest.fixture(scope="module", params=[1, 3])
def folder(request, environment, project, tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "block"
    command = [
        "mpiexec",
        "-n",
        str(request.param),
        sys.executable,
        "-m",
        "ancf_petsc",
        "run",
        "--out",
        str(out),
    ]
    command += [str(project / "cases/pvc_block"), "--set", "statics.steps=4", "--quiet"]
    subprocess.run(command, env=environment, check=True, capture_output=True, timeout=120 * PATIENCE)
    return out


def test_pyvista_opens_the_time_series(folder):
    run = open_results(folder)
    reader = pyvista.get_reader(folder / "results.xdmf")
    assert reader.time_values == pytest.approx(list(run.curve["pseudo_time"]), abs=0)
    reader.set_active_time_value(reader.time_values[-1])
    grid = reader.read()
    grid = grid[0] if isinstance(grid, pyvista.MultiBlock) else grid
    assert isinstance(grid, pyvista.UnstructuredGrid)
    assert (grid.n_points, grid.n_cells) == (234, 816)
    np.testing.assert_array_equal(grid.point_data["displacement"], run.field("displacement"))
    np.testing.assert_array_equal(grid.cell_data["von_mises"], run.field("von_mises"))


def test_meshio_opens_the_time_series(folder):
    run = open_results(folder)
    with meshio.xdmf.TimeSeriesReader(folder / "results.xdmf") as reader:
        points, cells = reader.read_points_cells()
        time, point_data, cell_data = reader.read_data(reader.num_steps - 1)
    assert time == run.curve["pseudo_time"][-1]
    assert points.shape == (234, 3)
    assert cells[0].data.shape == (816, 4)
    np.testing.assert_array_equal(point_data["displacement"], run.field("displacement"))
    np.testing.assert_array_equal(np.reshape(cell_data["cauchy"][0], (816, 9)), run.field("cauchy"))


def test_displacement_of_the_last_step_is_the_stroke(folder):
    run = open_results(folder)
    top = run.groups["top"]
    with h5py.File(folder / "results.h5") as file:
        displacement = file["steps/00004/displacement"][...]
    assert displacement[top, 2].mean() == pytest.approx(run.curve["stroke"][-1], rel=1e-14)
    assert run.curve["stroke"][-1] == pytest.approx(-0.025, rel=1e-12)


def test_results_are_in_the_files_order(folder, project):
    mesh, run = meshio.read(project / "meshes/pvc_block_234.msh"), open_results(folder)
    np.testing.assert_array_equal(run.points, mesh.points)
    np.testing.assert_array_equal(np.sort(run.cells, axis=1), np.sort(mesh.cells_dict["tetra"], axis=1))


def test_summary_has_the_contracts_keys(folder):
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "done"
    assert set(summary["seconds"]) == {"import", "read", "setup", "solve", "output", "total"}
    assert summary["nodes"] == 234
    assert summary["elements"] == 816
    assert summary["dof"] == 702
    assert len(summary["memory_peak_bytes"]) == summary["ranks"]
    assert summary["iterations"]["newton"] > 0
    assert summary["final"]["force"] == open_results(folder).curve["force"][-1]


def test_energy_balances_the_work_of_the_top(folder):
    """The work follows a cubic through the reactions of these four wide steps: 3e-4 here, 1e-6 with 25."""
    curve = open_results(folder).curve
    assert curve["external_work"][-1] == pytest.approx(curve["strain_energy"][-1], rel=1e-3)


def test_results_say_what_was_computed(folder):
    """On any number of ranks: the attributes are those of the summary, and the mesh's digest its file's."""
    summary, facts = json.loads((folder / "summary.json").read_text()), open_results(folder).facts
    mesh = Path(summary["mesh"]["file"])
    assert facts["mesh_sha256"] == summary["mesh"]["sha256"] == hashlib.sha256(mesh.read_bytes()).hexdigest()
    for name in ("hash", "date", "host", "command"):
        assert facts[name] == summary[name]
    assert facts["case"] == summary["case"]["text"]
    assert facts["ranks"] == str(summary["ranks"])
    assert "steps = 4" in facts["case"]
    assert facts["hash"] in (folder / "log.txt").read_text()
    assert not (folder / "running.json").exists()
