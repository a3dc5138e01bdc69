"""Benchmarks: the answers they check against, how results are judged, the model of scaling, one of each through its process."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from ancf_petsc.bench.catalog import ROWS, choose
from ancf_petsc.bench.elements import compile_catalogue
from ancf_petsc.bench.meshes import mesh_path
from ancf_petsc.bench.problems import stretched_force
from ancf_petsc.bench.row import Row
from ancf_petsc.bench.suite import judged, launch
from ancf_petsc.bench.yardstick import gather_scatter
from ancf_petsc.cli import main
from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.errors import CaseError
from ancf_petsc.launcher import environment, on_ranks
from ancf_petsc.mesh.read import read_mesh

SMALL = "cube:2x2x4"
PRESSED = {"name": "block", "mesh": SMALL, "stroke": 0.001, "steps": 1}


@pytest.fixture(autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes that this process makes do not land in the user's cache; kernels stay where they are, compiled."""
    monkeypatch.setattr(
        "ancf_petsc.mesh.made.cache_folder", lambda: tmp_path_factory.getbasetemp() / "meshes"
    )


def test_a_derived_row_brings_what_it_is_derived_from():
    names = [row.name for row in choose(["gain_74k"], quick=False)]
    assert names == ["block_74k", "block_74k_one", "gain_74k"]


def test_beginnings_and_patterns_choose_rows():
    assert {row.name for row in choose(["scaling/messages"], quick=False)} == {
        f"scaling/messages/{ranks}" for ranks in (2, 4, 8, 16)
    }
    assert len(choose(["pendulum_1e*"], quick=False)) == 2


def test_without_names_the_rows_with_targets_and_their_sources_run():
    chosen = choose([], quick=False)
    assert {row.name for row in ROWS.values() if row.target is not None} <= {row.name for row in chosen}
    assert all(row.small for row in choose([], quick=True))


def test_an_unknown_name_is_told_with_the_nearest():
    with pytest.raises(CaseError, match=r"no such benchmark: found 'cube_m3'.*cube_m2"):
        choose(["cube_m3"], quick=False)


def test_every_row_says_what_it_measures_or_is_derived_from():
    assert all(bool(row.measure) != bool(row.of) for row in ROWS.values())


@pytest.mark.parametrize(
    ("samples", "error", "more", "met"),
    [
        ([1.0, 2.0, 3.0], 0.0, False, True),
        ([1.0, 2.1, 9.0], 0.0, False, False),
        ([1.0, 1.0, 1.0], 1e-3, False, False),
        ([1.0, 1.0, 1.0], None, False, True),
        ([3.0, 3.0, 3.0], 0.0, True, True),
        ([1.0, 1.0, 1.0], 0.0, True, False),
    ],
)
def test_a_target_is_met_by_the_median_and_a_right_answer(samples, error, more, met):
    row = Row("row", "a row", target=2.0, allowed=1e-6, more=more)
    result = judged(row, {"samples": samples, "error": error, "facts": {}})
    assert result["met"] is met
    assert result["median"] == np.median(samples)
    assert result["spread"] == pytest.approx((max(samples) - min(samples)) / 2 / np.median(samples))


def test_what_cannot_run_meets_no_target():
    row = Row("row", "a row", target=2.0)
    assert judged(row, {"problem": "why"})["met"] is False


def test_stretched_force_grows_as_its_derivative_says():
    step = 1e-6
    ahead, behind = stretched_force(0.9 + step)[0], stretched_force(0.9 - step)[0]
    # Central difference of a cubic: error step^2 times its third derivative, and rounding.
    assert (ahead - behind) / 2 / step == pytest.approx(stretched_force(0.9)[1], rel=1e-8)


def test_gather_scatter_adds_the_sum_of_a_cells_positions_to_its_nodes():
    positions = np.arange(15.0).reshape(5, 3)
    cells, force = np.array([[0, 1, 2, 3], [1, 2, 3, 4]], np.int32), np.zeros((5, 3))
    gather_scatter(positions, cells, force)
    sums = positions[cells].sum(axis=1)
    expected = np.zeros((5, 3))
    np.add.at(expected, cells, sums[:, None, :])
    assert np.array_equal(force, expected)


def test_a_made_mesh_is_kept():
    first = mesh_path(SMALL)
    made = first.stat().st_mtime_ns
    assert mesh_path(SMALL).stat().st_mtime_ns == made


def test_a_graded_mesh_has_a_name_of_its_own():
    uniform, graded = (
        read_mesh(mesh_path(name), ("tetra10",))
        for name in ("cube:0.025:quadratic", "cube:0.025:quadratic:rim=0.005")
    )
    assert len(graded.cells) > 2 * len(uniform.cells)
    assert graded.cells.shape[1] == uniform.cells.shape[1] == 10


def test_a_mesh_that_the_project_lacks_is_told():
    with pytest.raises(
        CaseError, match=r"meshes/nothing.msh: the benchmarks' file is missing; run the bench"
    ):
        mesh_path("nothing")


@pytest.mark.parametrize("measure", ["residual", "tangent"])
def test_kernels_are_checked_against_uniaxial_strain(measure):
    found = launch(measure, {"mesh": SMALL, "repetitions": 2})
    assert len(found["samples"]) == 2
    assert min(found["samples"]) > 0
    assert found["error"] < 1e-11  # rounding of 96 cells' forces
    assert found["facts"]["elements"] == 96


@pytest.mark.parametrize("code", ["3413", "3843", "2432", "1222"])
@pytest.mark.parametrize("kernel", ["residual", "tangent"])
def test_a_quadrature_point_is_timed_and_checked(code, kernel):
    row = ROWS[f"points/svk/{code}/{kernel}"]
    found = launch(row.measure, {**row.task, "repetitions": 2})
    assert min(found["samples"]) > 0
    assert found["facts"]["points"] == ELEMENTS[code].points["default"]
    # A central difference with steps of 1e-4; the tangent and its product differ by rounding.
    assert found["error"] <= row.allowed


def test_every_element_has_its_rows_of_points():
    for code in ELEMENTS:
        assert {f"points/svk/{code}/residual", f"points/svk/{code}/tangent"} <= set(ROWS)


def test_compiling_starts_from_an_empty_folder(tmp_path, monkeypatch):
    """One plain kernel instead of all: the process is timed, and what it compiles is not kept."""
    monkeypatch.setattr(
        "ancf_petsc.bench.elements.COMPILING",
        "import os; assert not os.listdir(os.environ['ANCF_CACHE_DIR'])",
    )
    found = compile_catalogue(MPI.COMM_SELF, repetitions=2)
    assert len(found["samples"]) == 2
    assert ROWS["compile_catalogue"].target == 90


def test_a_run_is_timed_and_checked_on_two_ranks():
    known = {"force": -1.0, "elements": 96}
    found = launch("run", {"problem": PRESSED, "known": known, "repetitions": 2}, ranks=2)
    assert len(found["samples"]) == 2
    force = found["facts"]["force"]
    assert found["error"] == abs(force / -1.0 - 1)
    known = {"force": force, "elements": 96}
    alone = launch("run", {"problem": PRESSED, "known": known, "repetitions": 1})
    assert alone["error"] < 1e-9  # tolerance 1e-8 of the reactions, reached quadratically


def test_a_problem_of_a_task_is_its_result():
    found = launch("run", {"problem": {**PRESSED, "element": "9999"}, "repetitions": 1})
    assert "9999" in found["problem"]


def test_one_rank_needs_no_launcher_and_others_get_an_environment_of_their_own(monkeypatch):
    monkeypatch.setenv("OMPI_COMM_WORLD_RANK", "1")
    assert "OMPI_COMM_WORLD_RANK" not in environment()
    assert on_ranks(1, ["python"]) == ["python"]
    assert on_ranks(3, ["python"])[1:] == ["-n", "3", "python"]


def test_the_list_shows_what_there_is(ancf):
    assert "block_480k" in ancf("bench", "--list").stdout


def test_the_table_and_the_json_file_have_what_was_measured(tmp_path: Path, monkeypatch, capsys):
    machine = {"cube:0.0025": {"copy_gb_s": [10.0, 12.0], "gather_scatter_ns": [9.0, 8.0], "copy_gain": 1.2}}
    monkeypatch.setattr("ancf_petsc.bench.suite.yardstick", lambda rows: machine)
    assert main(["bench", "start_help", "--repetitions", "1", "--json", str(tmp_path / "bench.json")]) == 0
    report = json.loads((tmp_path / "bench.json").read_text())
    assert report["machine"]["cores"] >= 1
    assert report["results"]["start_help"]["median"] > 0
    assert report["yardstick"] == machine
    said = capsys.readouterr().out
    assert "copy 10 and 12 GB/s" in said
    assert "ancf --help" in said


def test_wrong_arguments_are_told(ancf):
    assert "a number from 1" in ancf("bench", "--repetitions", "0", code=2).stderr
    assert "no such benchmark" in ancf("bench", "nothing", code=2).stderr


def _measured() -> dict:
    """Results as `ancf bench` leaves them, of a machine that follows the model's laws."""
    counted = {
        f"scaling/messages/{p}": {
            "ranks": p,
            "facts": {
                "elements": 73606,
                "nodes": 14190,
                "ghosts": 3 * (14190 / p) ** (2 / 3),
                "neighbours": 12 * (1 - p ** (-1 / 3)),
                "elements_over_share": 1 + 2 * (73606 / p) ** (-1 / 3),
            },
        }
        for p in (2, 4, 8, 16)
    }
    facts = {"elements": 478059, "dof": 254337, "iterations": {"linear": 300}}
    alone = {"read": [2.0], "tables": [1.0]}
    return counted | {
        "block_480k": {"median": 20.0, "facts": facts},
        "setup_480k": {"facts": {"seconds": alone}},
        "scaling/exchange": {"median": 1.0, "facts": {"bandwidth_gb_s": [5.0], "sum_us": [2.0]}},
    }


def test_the_model_finds_the_laws_it_was_fitted_to_and_the_run_it_was_scaled_by(project, monkeypatch):
    monkeypatch.syspath_prepend(str(project / "scripts"))
    model = __import__("scaling_model").Model(_measured(), "block_480k", multigrid=False)
    monkeypatch.delitem(sys.modules, "scaling_model")
    assert model.ghost_factor == pytest.approx(3)
    assert model.neighbour_limit == pytest.approx(12)
    assert model.overlap_factor == pytest.approx(2)
    assert model.parts(478059, 2).total == pytest.approx(20)
    assert model.parts(478059, 1).serial == pytest.approx(3)
    assert model.parts(478059, 16).total < 20
