"""Where paths begin and what they end with: loads that do not begin at 0, strokes both ways, doubtful ends, line searches."""

from __future__ import annotations

import re

import meshio
import numpy as np
import pytest
from bodies import assembly_of
from family import unit_cube
from slender_bodies import column, euler, solved

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.modes import find_modes
from ancf_petsc.model.drive import Drive
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.model.work import PathWork
from ancf_petsc.plan.outputs import output_times
from ancf_petsc.solve.load_path import Marks
from ancf_petsc.solve.newton import Newton
from ancf_petsc.solve.petsc import petsc_options


def pressed(folder, ramp, *, law="neo_hooke", stroke=0.4, **statics):
    """A unit cube between bonded plates."""
    return {
        "title": "Cube",
        "mesh": {"file": str(unit_cube("3413", 2, folder)), "element": "3413"},
        "groups": {"bottom": {"plane": "z", "at": "min"}, "top": {"plane": "z", "at": "max"}},
        "material": {"law": law, "young": 1.0, "poisson": 0.3},
        "constraint": [
            {"group": "bottom", "fix": ["x", "y", "z"]},
            {"group": "top", "fix": ["x", "y"], "move": {"z": -stroke}, "ramp": ramp},
        ],
        "statics": statics or {"steps": 5},
        "output": {"curve": {"force": "top.z", "stroke": "top.z"}},
    }


@pytest.mark.parametrize(("ramp", "first"), [("constant", 1.0), ([[0, 0.5], [1, 1]], 0.6)])
def test_work_is_energy_where_moves_do_not_begin_at_zero(ramp, first, tmp_path):
    results, _, _ = solved(pressed(tmp_path, ramp), tmp_path)
    stroke, energy = results.curve["stroke"], results.curve["strain_energy"]
    assert stroke[:2] == pytest.approx([0.0, -0.4 * first], abs=1e-12)
    assert energy[1] > 0.01
    np.testing.assert_allclose(results.curve["external_work"], energy, rtol=0, atol=2e-4 * energy[-1])


def test_work_of_a_load_that_is_there_from_the_start(tmp_path):
    """A weight on one face: what it does on its way to rest, brought up in proportion."""
    data = pressed(tmp_path, "linear", stroke=0.0)
    data["constraint"] = data["constraint"][:1]
    data["output"] = {}
    data["load"] = [{"type": "force", "group": "top", "total": [0.05, 0.0, -0.1], "ramp": "constant"}]
    results, summary, _ = solved(data, tmp_path)
    energy = results.curve["strain_energy"]
    assert energy[1:] == pytest.approx(energy[1] * np.ones(5), rel=1e-9)
    assert results.curve["external_work"][1:] == pytest.approx(energy[1:], rel=1e-4)
    assert summary["critical_points"] == []


def test_strokes_are_reached_in_both_directions_and_rounding_makes_no_second_output(tmp_path):
    ramp = [[0, 0], [0.3, -0.5], [1, 1]]
    data = pressed(tmp_path, ramp, strokes=[0.1, 0.2, 0.4])
    times = output_times(case_from_dict(data, tmp_path).spec)
    assert Marks.of(times, Ramp("table", tuple(map(tuple, ramp))).corners()).outputs == pytest.approx(
        [0.15, 0.3, 0.65, 0.7 * 1.0 / 1.5 + 0.3, 1.0], rel=1e-12
    )
    results, _, _ = solved(data, tmp_path)
    assert results.curve["stroke"] == pytest.approx([0, 0.1, 0.2, -0.1, -0.2, -0.4], abs=1e-12)
    assert (results.curve["pseudo_time"] == 1.0).sum() == 1


def test_times_that_differ_by_rounding_are_one():
    marks = Marks.of([0.1, 0.3, 0.7, 1.0 - 1e-16], [0.7000000000000001, 0.30000000000000004, 0.5])
    assert marks.outputs == (0.1, 0.3, 0.7, 1.0)
    assert marks.corners == {0.3, 0.5, 0.7}
    assert [marks.after(s) for s in (0.0, 0.3, 0.5, 0.7)] == [0.1, 0.5, 0.7, 1.0]


def test_work_along_the_length_of_a_path_that_turns_back():
    """f = sin 2 l and D = l: W = integral of f dD = (1 - cos 2 l) / 2, across the turn of f."""

    class Load:
        ramp = Ramp("linear")

    work = PathWork([], [Load()])
    lengths = np.linspace(0.0, 1.2, 13)
    work.start(0.0, np.zeros(0), np.zeros(1), 0.0)
    for length in lengths[1:]:
        work.add(np.sin(2 * length), np.zeros(0), np.array([length]), length)
    assert work.total == pytest.approx((1 - np.cos(2.4)) / 2, rel=1e-4)


def test_work_is_exact_from_the_first_step_on_where_reactions_are_cubic():
    """R = 2 q + q^3 over q = 0.5 f, W = q^2 + q^4 / 4: once four states are known, for what came before them too."""
    drive = Drive(0.5, Ramp("cosine"))
    work = PathWork([drive], [])
    work.start(0.0, np.zeros(1), np.zeros(0))
    for count, s in enumerate((0.3, 0.4, 0.6, 0.65, 1.0), 2):
        q = drive.value(s)
        work.add(s, np.array([2 * q + q**3]), np.zeros(0))
        if count >= 4:
            assert work.total == pytest.approx(q**2 + q**4 / 4, rel=1e-13)


def test_work_of_a_load_is_that_of_its_force_along_the_displacement():
    """D = 4 p^3 - p^2, where the change of p D is not twice the integral of D: W = 3 p^4 - 2 p^3 / 3."""

    class Load:
        ramp = Ramp("cosine")

    work = PathWork([], [Load()])
    work.start(0.0, np.zeros(0), np.zeros(1))
    for s in (0.3, 0.6, 1.0):
        p = Load.ramp.value(s)
        work.add(s, np.zeros(0), np.array([4 * p**3 - p**2]))
    assert work.total == pytest.approx(3 - 2 / 3, rel=1e-13)


# --- doubtful ends


def test_a_law_beyond_its_limit_is_warned_of(tmp_path):
    _, summary, _ = solved(pressed(tmp_path, "linear", law="svk", stroke=0.44), tmp_path)
    assert summary["status"] == "done"
    assert "svk carries the less" in summary["doubts"]
    assert "48 elements" in summary["doubts"]
    assert summary["doubts"] in (tmp_path / "run" / "log.txt").read_text()
    _, summary, _ = solved(pressed(tmp_path, "linear", law="svk", stroke=0.1), tmp_path)
    assert summary["doubts"] is None


# --- line searches


def test_work_that_does_not_balance_the_energy_is_doubted(tmp_path, monkeypatch):
    """As on a path that jumps: to the work along it a twentieth is added."""
    true_increment = PathWork._increment
    monkeypatch.setattr(PathWork, "_increment", lambda work, k: 1.05 * true_increment(work, k))
    _, summary, _ = solved(pressed(tmp_path, "linear", law="neo_hooke", stroke=0.1), tmp_path)
    assert "differ by 4.8 %" in summary["doubts"]
    assert summary["doubts"] in (tmp_path / "run" / "log.txt").read_text()


def test_a_leaning_column_is_followed_far_beyond_euler_s_load(tmp_path):
    """Dead load of twice Euler's on a free end, with a side force of 3e-3 of it: steps that have to lower the out-of-balance
    force take three to five times as many iterations."""
    data = column(tmp_path, "3843", counts=(8, 1, 1), statics={"steps": 2}, output={})
    data["constraint"] = data["constraint"][:1]
    free = euler() / 4
    data["load"] = [{"type": "force", "group": "head", "total": [-2 * free, 3e-3 * free, 0.0]}]
    results, summary, _ = solved(data, tmp_path)
    assert (summary["status"], summary["critical_points"]) == ("done", [])
    assert summary["iterations"]["newton"] < 150
    # The elastica under twice Euler's load: K. Mattiasson's elliptic integrals for P L^2 / (E I) = pi^2 / 2, a slender column.
    assert results.probes["head.uy"][-1] == pytest.approx(0.79, abs=0.03)
    shown = re.findall(r"min det F (\S+)", (tmp_path / "run" / "log.txt").read_text())
    assert len(shown) > len(
        results.curve["min_det_F"]
    )  # steps between outputs too: means of elements, bent without swelling
    assert min(map(float, shown)) == pytest.approx(results.curve["min_det_F"].min(), abs=2e-3)


def test_an_option_keeps_its_line_search(tmp_path):
    assembly = assembly_of(pressed(tmp_path, "linear"), tmp_path)
    with petsc_options({"snes_linesearch_type": "l2"}):
        newton = Newton(assembly, 1e-10)
    assert not newton.can_be_careful
    newton.destroy()
    newton = Newton(assembly, 1e-10)
    assert newton.can_be_careful
    newton.destroy()


# --- modes


def line(folder):
    """A line of eight pieces along x, of length 1."""
    points = np.zeros((9, 3))
    points[:, 0] = np.linspace(0.0, 1.0, 9)
    path = folder / "line.vtu"
    meshio.Mesh(points, [("line", np.stack((np.arange(8), np.arange(1, 9)), axis=1))]).write(path)
    return path


def test_modes_beyond_the_critical_load_say_what_grows(tmp_path, caplog):
    """Greenhill: a standing column buckles under its weight q = 7.8373 E I / L^3; twice as heavy, it falls."""
    inertia, area = 1e-9, 1e-4
    weight = 2 * 7.8373 * 1e9 * inertia / area
    data = {
        "title": "Standing column",
        "mesh": {"file": str(line(tmp_path)), "element": "1222"},
        "groups": {"foot": {"plane": "x", "at": "min"}},
        "section": {"area": area, "inertia": inertia},
        "material": {"law": "svk", "young": 1e9, "poisson": 0.0, "density": 1.0},
        "constraint": [{"group": "foot", "fix": ["x", "z"], "slopes": ["z"]}],
        "load": [{"type": "gravity", "acceleration": [-weight, 0.0, 0.0]}],
        "dynamics": {"duration": 1.0, "step": 0.1},
    }
    rows = find_modes(case_from_dict(data, tmp_path), tmp_path / "modes", 2, loaded=True, force=False)
    assert rows[0, 1] == 0.0
    assert rows[0, 5] > 0.0
    assert rows[1, 1] > 0.0
    assert rows[1, 5] == 0.0
    said = [record.getMessage() for record in caplog.records]
    critical = next(text for text in said if text.startswith("bifurcation"))
    assert float(critical.split("pseudo-time ")[1].split()[0]) == pytest.approx(0.5, rel=1e-3)
    assert any(text.startswith("mode 1 does not vibrate") and "(1, 0, 0)" in text for text in said)
