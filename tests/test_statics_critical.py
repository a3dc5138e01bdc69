"""Critical points of load paths: bifurcations found, named, ended at or followed; limit points named, and passed by length."""

from __future__ import annotations

import json

import meshio
import numpy as np
import pytest
from bodies import assembly_of
from slender_bodies import LENGTH, arch, column, euler, solved
from statics_cases import block

from ancf_petsc import case_from_dict, open_results, run
from ancf_petsc.errors import NoEquilibrium
from ancf_petsc.solve.cubic import crossing, cubic, extreme
from ancf_petsc.solve.load_path import LoadPath, Marks
from ancf_petsc.solve.lowest import LowestMode
from ancf_petsc.solve.newton import Newton

# --- the lowest eigenvalue


def test_the_lowest_eigenvalue_and_mode_are_those_of_the_dense_matrix(tmp_path):
    assembly = assembly_of(block("pvc_block_234.msh", 0.005), tmp_path)
    newton = Newton(assembly, 1e-10)
    x = assembly.reference_vector()
    newton.predict(x, 0.0, 1.0)
    newton.tangent_at(x)
    lowest = LowestMode(newton)
    value = lowest.look(60)
    free = np.flatnonzero(assembly.model.drive[: assembly.model.owned].ravel() < 0)
    scale = np.sqrt(lowest.scale[free])
    dense = newton.matrix.mat.convert("dense").getDenseArray()[np.ix_(free, free)]
    values, vectors = np.linalg.eigh(dense / np.outer(scale, scale))
    assert value == pytest.approx(values[0], rel=1e-2)  # it stops where it changes by 1e-3 an iteration
    assert abs(vectors[:, 0] @ (scale * lowest.mode.ravel()[free])) > 0.99
    lowest.destroy()
    newton.destroy()


# --- bifurcations


@pytest.mark.parametrize(("unit", "axis"), [(1.0, 0), (1e-3, 2)])
def test_a_straight_column_buckles_at_euler_s_load(unit, axis, tmp_path):
    """Euler's load to 3 %: the column is a tenth as wide as long, so that it shears and shortens before."""
    results, summary, _ = solved(column(tmp_path, "3843", unit=unit, axis=axis), tmp_path)
    (event,) = summary["critical_points"]
    assert (event["kind"], event["negative_directions"], summary["status"]) == ("bifurcation", 2, "done")
    assert event["force"] == pytest.approx(-euler(), rel=0.03)
    assert event["stroke"] == pytest.approx(-0.2 * LENGTH / unit * event["pseudo_time"], rel=1e-9)
    low, high = event["between"]
    assert low <= event["pseudo_time"] <= high < low + 1e-4
    assert event["place"][axis] == pytest.approx(LENGTH / unit)
    assert abs(event["direction"][axis]) < 1e-6
    assert results.curve["pseudo_time"][-1] == 1.0
    assert "bifurcation" in (tmp_path / "run" / "log.txt").read_text()


def test_conjugate_gradients_find_the_same_point_as_factoring(tmp_path):
    found = []
    for petsc in ({}, {"ksp_type": "preonly", "pc_type": "cholesky", "pc_factor_mat_solver_type": "mumps"}):
        data = column(tmp_path, "3813", counts=(10, 2, 2), statics={"steps": 10}, petsc=petsc)
        _, summary, _ = solved(data, tmp_path)
        found.append(summary["critical_points"][0])
    assert found[0]["pseudo_time"] == pytest.approx(found[1]["pseudo_time"], rel=1e-4)
    assert found[0]["negative_directions"] == found[1]["negative_directions"] == 2


def test_a_path_may_end_at_the_bifurcation(tmp_path):
    data = column(tmp_path, "3843", statics={"steps": 5, "on_bifurcation": "stop"})
    results, summary, said = solved(data, tmp_path)
    (event,) = summary["critical_points"]
    assert summary["status"] == "stopped"
    assert said.startswith("bifurcation at pseudo-time")
    assert "statics.on_bifurcation" in said
    # The last state is the last stable one.
    assert results.curve["pseudo_time"][-1] == pytest.approx(event["pseudo_time"], rel=1e-4)
    assert results.curve["pseudo_time"][-1] <= event["pseudo_time"]


def test_a_path_may_take_the_stable_branch(tmp_path):
    """Buckled, the column carries about Euler's load, where the straight one would carry thirty times as much."""
    statics = {"steps": 5, "on_bifurcation": "follow"}
    results, summary, _ = solved(column(tmp_path, "3843", depth=0.12, statics=statics), tmp_path)
    (event,) = summary["critical_points"]
    assert event["direction"] == pytest.approx([0.0, 1.0, 0.0], abs=1e-3)
    force = -results.curve["force"][1:]
    assert ((force > 0.97 * euler(0.12)) & (force < 1.15 * euler(0.12))).all()
    assert (np.diff(force) > 0).all()
    assert (np.abs(results.probes["head.uy"][1:]) > 0.1).all()
    np.testing.assert_allclose(results.curve["pseudo_time"], np.linspace(0, 1, 6), rtol=1e-12)


def test_a_beam_a_hundred_times_as_long_as_thick_takes_the_stable_branch(tmp_path):
    """Along a narrow valley of the energy: stretching is 1e4 times as stiff as bending. Tip of the elastica at 1.884 times
    Euler's load: 0.803 aside, 0.123 high (Timoshenko and Gere, Theory of elastic stability, table 2-4).
    """
    height = np.linspace(0.0, 1.0, 41)
    lines = np.stack((np.arange(40), np.arange(1, 41)), axis=1)
    meshio.Mesh(np.outer(height, [0.0, 0.0, 1.0]), [("line", lines)]).write(tmp_path / "beam.vtu")
    data = {
        "title": "Beam",
        "mesh": {"file": str(tmp_path / "beam.vtu"), "element": "1222"},
        "section": {"area": 1e-4, "inertia": 1e-8 / 12},
        "groups": {"root": {"plane": "z", "at": "min"}, "tip": {"plane": "z", "at": "max"}},
        "material": {"law": "svk", "young": 1e9, "poisson": 0.0},
        "constraint": [{"group": "root", "fix": ["x", "z"], "slopes": ["x"]}],
        "load": [{"type": "force", "group": "tip", "total": [0.0, 0.0, -3.8754664482590027]}],
        "statics": {"times": [0.538728988432, 1.0], "on_bifurcation": "follow"},
        "probe": [{"name": "tip", "group": "tip"}],
    }
    results, _, _ = solved(data, tmp_path)
    assert abs(results.probes["tip.x"][-1]) == pytest.approx(0.803, abs=1e-3)
    assert results.probes["tip.z"][-1] == pytest.approx(0.123, abs=1e-3)


def test_an_ordinary_path_has_no_critical_point_and_pays_little_for_it(tmp_path, monkeypatch):
    """Products with the tangent for the lowest mode against iterations of the solver, which have one each."""
    products = []
    times = LowestMode._times
    monkeypatch.setattr(LowestMode, "_times", lambda self, v: products.append(1) or times(self, v))
    _, summary, _ = solved(block("pvc_block_234.msh", 0.010, steps=10), tmp_path)
    assert summary["critical_points"] == []
    assert len(products) < 0.1 * summary["iterations"]["linear"]


# --- limit points


@pytest.fixture(scope="module")
def passed(tmp_path_factory):
    """The arch by force, along the length of its path: results, summary."""
    folder = tmp_path_factory.mktemp("arch")
    results, summary, _ = solved(arch(folder, load=0.02, steps=10, control="arc_length"), folder)
    return results, summary


def test_arc_length_gives_the_curve_that_a_displacement_gives(passed, tmp_path):
    """On both sides of both limit points, at every output: to the tolerance of Newton's method."""
    results, _ = passed
    force, stroke = results.curve["force"], results.curve["stroke"]
    wanted, _, _ = solved(arch(tmp_path, load=None, strokes=[float(-u) for u in stroke[1:]]), tmp_path)
    rows = [np.abs(wanted.curve["stroke"] - u).argmin() for u in stroke]
    np.testing.assert_allclose(wanted.curve["stroke"][rows], stroke, rtol=0, atol=1e-12)
    np.testing.assert_allclose(wanted.curve["force"][rows], force, rtol=0, atol=1e-8 * force.max())


def test_outputs_of_arc_length_are_exact_wherever_the_load_factor_passes(passed):
    results, summary = passed
    s = results.curve["pseudo_time"]
    top, bottom = (event["pseudo_time"] for event in summary["critical_points"])
    assert [event["kind"] for event in summary["critical_points"]] == ["limit point", "limit point"]
    wanted = [0, *(k / 10 for k in range(1, 5)), top, 0.4, 0.3, bottom, *(k / 10 for k in range(3, 11))]
    assert s.tolist() == wanted
    assert results.curve["force"] == pytest.approx(0.02 * s, rel=1e-8)
    # The sum of the work along both turns is the strain energy: as well as cubics through the steps do.
    energy = results.curve["strain_energy"]
    np.testing.assert_allclose(results.curve["external_work"], energy, rtol=0, atol=1e-3 * energy.max())


def test_a_path_by_force_names_the_limit_point_it_ends_at(passed, tmp_path):
    _, summary, said = solved(arch(tmp_path, load=0.02, steps=10), tmp_path)
    (event,) = summary["critical_points"]
    assert event["kind"] == "limit point"
    assert event["pseudo_time"] == pytest.approx(passed[1]["critical_points"][0]["pseudo_time"], rel=1e-4)
    assert "limit point" in said
    assert "arc_length" in said
    assert "positive definite" not in said


def test_cubics_pass_levels_and_are_level_where_they_say():
    ends = (0.2, 0.3, 1.5, -2.0)
    top = extreme(*ends)
    assert abs(cubic(top + 1e-6, *ends) - cubic(top - 1e-6, *ends)) < 1e-11
    assert cubic(crossing(0.0, 1.0, 0.5, 3.0, 0.3), 0.0, 1.0, 0.5, 3.0) == pytest.approx(0.3, abs=1e-12)
    assert cubic(crossing(1.0, 0.0, -0.5, -3.0, 0.3), 1.0, 0.0, -0.5, -3.0) == pytest.approx(0.3, abs=1e-12)


# --- steps


def test_a_jump_to_another_branch_is_no_step_of_a_path(tmp_path):
    """Whole steps of Newton's method find the arch snapped through, at a load beyond its limit: the path does not."""
    assembly = assembly_of(arch(tmp_path, load=0.02, steps=1), tmp_path)
    newton = Newton(assembly, 1e-10)
    taken = []
    path = LoadPath(newton, Marks.of([1.0], ()), 1e-2, lambda step, x: taken.append(step.s))
    with pytest.raises(NoEquilibrium, match="limit point"):
        path.run()
    assert 0.45 < taken[-1] < 0.4768
    newton.destroy()


RUNNER = """
import json, sys
from pathlib import Path
from ancf_petsc import case_from_dict, run
for name, data in json.loads(Path(sys.argv[1]).read_text()).items():
    run(case_from_dict(data, Path(".")), Path(sys.argv[2]) / name)
"""


def test_branches_and_turns_are_the_same_on_any_number_of_ranks(tmp_path, mpirun):
    follow = {"steps": 2, "on_bifurcation": "follow"}
    cases = {
        "column": column(tmp_path, "3843", depth=0.12, counts=(3, 1, 1), statics=follow),
        "arch": arch(tmp_path, load=0.01, steps=1, control="arc_length"),
    }
    (tmp_path / "cases.json").write_text(json.dumps(cases))
    (tmp_path / "runner.py").write_text(RUNNER)
    for name, data in cases.items():
        run(case_from_dict(data, tmp_path), tmp_path / "on1" / name)
    for ranks in (2, 3):
        mpirun(ranks, [tmp_path / "runner.py", tmp_path / "cases.json", tmp_path / f"on{ranks}"], timeout=300)
    for name in cases:
        folders = [tmp_path / f"on{ranks}" / name for ranks in (1, 2, 3)]
        one, *others = (open_results(folder) for folder in folders)
        summaries = [
            json.loads((folder / "summary.json").read_text())["critical_points"] for folder in folders
        ]
        for other, points in zip(others, summaries[1:], strict=True):
            for column_name in ("pseudo_time", "force", "stroke", "strain_energy"):
                wanted = one.curve[column_name]
                # Critical points are found to 1e-4 of their pseudo-time, and are rows of the arch's table.
                np.testing.assert_allclose(
                    other.curve[column_name], wanted, rtol=0, atol=1e-6 * np.abs(wanted).max()
                )
            assert [point["kind"] for point in points] == [point["kind"] for point in summaries[0]]
            for point, known in zip(points, summaries[0], strict=True):
                assert point["place"] == pytest.approx(known["place"])
                assert point["direction"] == pytest.approx(known["direction"], abs=1e-3)
                assert point["pseudo_time"] == pytest.approx(known["pseudo_time"], rel=1e-4)
