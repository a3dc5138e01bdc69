"""open_results: curves and fields as numpy arrays, without MPI."""

from __future__ import annotations

import subprocess
import sys

import h5py
import numpy as np
import pytest
import results_writer as run
from mpi4py import MPI

from ancf_petsc.errors import CaseError
from ancf_petsc.results.reader import open_results


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("run")
    run.write(path, MPI.COMM_SELF)
    return path


def test_all_that_was_written_is_read(folder):
    results = open_results(folder)
    assert (results.title, results.units, results.note, results.kind) == (
        run.TITLE,
        run.UNITS,
        run.NOTE,
        "tetra",
    )
    assert tuple(results.times) == run.TIMES
    assert results.node_fields == ("displacement", "temperature")
    assert results.cell_fields == ("cauchy", "det_F")
    np.testing.assert_array_equal(results.points, run.mesh()[0])
    np.testing.assert_array_equal(results.cells, run.mesh()[1])
    assert results.node_numbers.tolist() == list(range(10, 18))
    assert results.cell_numbers.tolist() == list(range(100, 106))
    assert {name: nodes.tolist() for name, nodes in results.groups.items()} == {
        name: nodes.tolist() for name, nodes in run.GROUPS.items()
    }
    assert results.curve["stroke"].tolist() == [-0.1 * time for time in run.TIMES]
    assert results.probes["top.z"].tolist() == [1 - 0.1 * time for time in run.TIMES]
    assert [extra["stroke"] for extra in results.extras] == results.curve["stroke"].tolist()


def test_fields_are_found_by_step_from_both_ends_and_by_time(folder):
    results = open_results(folder)
    np.testing.assert_array_equal(results.field("temperature"), run.node_fields(1.0)["temperature"])
    np.testing.assert_array_equal(results.field("temperature", 1), run.node_fields(0.1)["temperature"])
    np.testing.assert_array_equal(results.field("temperature", -3), run.node_fields(0.1)["temperature"])
    assert results.step_at(0.3) == 2


@pytest.mark.parametrize(
    ("time", "step"), [(-1.0, 0), (0.04, 0), (0.06, 1), (0.15, 1), (0.6, 2), (0.7, 3), (9.0, 3)]
)
def test_a_time_between_outputs_is_that_of_the_nearest(folder, time, step):
    """Earlier or later than asked; outputs at 0, 0.1, 1/3 and 1."""
    assert open_results(folder).step_at(time) == step


def test_the_mesh_is_the_deformed_body_with_its_fields(folder):
    results = open_results(folder)
    grid = results.mesh(scale=2.0)
    expected = run.mesh()[0] + 2 * run.node_fields(1.0)["displacement"]
    np.testing.assert_array_equal(grid.points, expected)
    np.testing.assert_array_equal(grid.cell_data["det_F"], run.cell_fields(1.0)["det_F"])
    assert results.mesh(0, scale=0.0).volume == pytest.approx(1.0, rel=1e-14)  # the unit cube, to rounding


def test_a_run_that_goes_on_has_neither_summary_nor_probes(tmp_path):
    run.write(tmp_path, MPI.COMM_SELF)
    (tmp_path / "probes.csv").unlink()
    results = open_results(tmp_path)
    assert results.summary == {}
    assert results.probes == {}


def test_reading_needs_no_mpi(folder):
    program = (
        "import sys, ancf_petsc as ancf\n"
        f"run = ancf.open_results({str(folder)!r})\n"
        "run.field('displacement'), run.curve, run.mesh()\n"
        "sys.exit('mpi4py' in sys.modules or 'petsc4py' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda results: results.field("vonmises"), "no such field: found 'vonmises'"),
        (lambda results: results.field("displacment"), "did you mean 'displacement'"),
        (
            lambda results: results.field("det_F", 4),
            "no such step: found 4, expected 0 to 3, or -1 for the last",
        ),
    ],
)
def test_what_is_not_there_is_told(folder, ask, message):
    with pytest.raises(CaseError, match=message):
        ask(open_results(folder))


def test_folders_that_are_no_run_are_told(tmp_path):
    with pytest.raises(CaseError, match="no results here: expected a folder that `ancf run` has written"):
        open_results(tmp_path)
    (tmp_path / "results.h5").write_bytes(b"cut short")
    with pytest.raises(CaseError, match=r"results\.h5: cannot be read"):
        open_results(tmp_path)
    with h5py.File(tmp_path / "results.h5", "w") as file:
        file["something"] = 1
    with pytest.raises(CaseError, match=r"results\.h5: cannot be read"):
        open_results(tmp_path)
