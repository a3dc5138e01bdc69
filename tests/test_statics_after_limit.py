"""Paths that go on after their end by damped motion: `statics.after_limit = "dynamics"`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from restart_cases import differences, followed, snapshots, with_checkpoints
from slender_bodies import arch, solved

from ancf_petsc import case_from_dict, open_results
from ancf_petsc.errors import CaseError

LOAD = 0.02


@pytest.fixture(scope="module")
def jumped(tmp_path_factory):
    """The arch by force, carried on where it snaps: results, summary, what was said."""
    folder = tmp_path_factory.mktemp("arch")
    return solved(arch(folder, load=LOAD, steps=5, after_limit="dynamics"), folder)


def test_a_shallow_arch_snaps_through_by_force_alone(jumped):
    """One jump, from just below its limit point to the force just beyond, with rows before and after it."""
    results, summary, said = jumped
    assert (said, summary["status"], summary["end"]["kind"]) == ("", "done", "reached")
    (jump,) = summary["jumps"]
    assert jump["cause"] == "limit_point"
    assert jump["from"] < summary["critical_points"][0]["pseudo_time"] < jump["pseudo_time"] < 0.479
    curve = results.curve
    (after,) = np.flatnonzero(curve["jumps"])
    assert curve["pseudo_time"][[after - 1, after]].tolist() == [jump["from"], jump["pseudo_time"]]
    assert curve["stroke"][[after - 1, after]].tolist() == [jump["stroke_before"], jump["stroke"]]
    assert jump["stroke"] < -0.2 < -0.1 < jump["stroke_before"]
    assert curve["force"] == pytest.approx(LOAD * curve["pseudo_time"], rel=1e-8)
    assert "dynamics" in [entry["action"] for entry in summary["step_control"]]


def test_beyond_the_snap_the_curve_is_the_one_by_displacement(jumped, tmp_path):
    results, summary, _ = jumped
    late = results.curve["pseudo_time"] >= summary["jumps"][0]["pseudo_time"]
    force, stroke = results.curve["force"][late], results.curve["stroke"][late]
    wanted, _, _ = solved(arch(tmp_path, load=None, strokes=[float(-u) for u in stroke]), tmp_path)
    rows = [np.abs(wanted.curve["stroke"] - u).argmin() for u in stroke]
    np.testing.assert_allclose(wanted.curve["stroke"][rows], stroke, rtol=0, atol=1e-12)
    np.testing.assert_allclose(wanted.curve["force"][rows], force, rtol=0, atol=1e-7 * force.max())


def test_what_the_snap_loses_is_what_the_work_leaves(jumped):
    """Work = strain energy + what was lost, in every row; the loss is that of the path's two states, and positive."""
    results, summary, _ = jumped
    curve, (jump,) = results.curve, summary["jumps"]
    balance = curve["external_work"] - curve["strain_energy"] - curve["dissipated_energy"]
    assert np.abs(balance).max() < 2e-3 * curve["external_work"].max()
    assert jump["energy_lost"] == pytest.approx(curve["dissipated_energy"][-1], rel=1e-12)
    (after,) = np.flatnonzero(curve["jumps"])
    moved = curve["stroke"][after - 1] - curve["stroke"][after]
    lost = LOAD * jump["pseudo_time"] * moved - np.diff(curve["strain_energy"])[after - 1]
    assert jump["energy_lost"] == pytest.approx(lost, rel=1e-6)
    assert lost > 0.1 * curve["external_work"][after]
    assert summary["doubts"] is None


def test_one_two_and_three_ranks_come_to_rest_alike(jumped, on_three_ranks, tmp_path):
    """And where the path that jumped is at the same load, though the motion began elsewhere."""
    (tmp_path / "case.json").write_text(json.dumps(arch(tmp_path, load=LOAD, steps=5)))
    said = on_three_ranks(
        Path(__file__).with_name("settling_on_ranks.py"), tmp_path / "case.json", timeout=240
    )
    found = json.loads(said.stdout.partition("FOUND")[2])
    curve = jumped[0].curve
    (row,) = np.flatnonzero(curve["pseudo_time"] == 0.6)
    assert len(found) == 6
    for one in found:
        assert one["steps"] == found[0]["steps"] > 10
        assert one["energy"] == pytest.approx(curve["strain_energy"][row], rel=1e-7)
        assert one["at"][1] == pytest.approx(curve["stroke"][row], rel=1e-8)


def test_a_path_that_was_carried_on_goes_on_from_its_checkpoints(tmp_path):
    """From the last one before the jump, and from one after it, to the last bit."""
    case = with_checkpoints(
        arch(tmp_path, load=LOAD, times=[0.3, 0.6, 1.0], after_limit="dynamics"), "4 steps"
    )
    with snapshots(tmp_path) as kept:
        end = followed(case, tmp_path / "whole")
    jumped = [open_results(folder).curve["jumps"].any() for folder in kept]
    assert {False, True} == set(jumped)
    for folder in (kept[jumped.index(True) - 1], kept[jumped.index(True)]):
        assert followed(case, folder, restart=True) == end
        assert differences(tmp_path / "whole", folder) == [], folder.name
        summaries = [open_results(path).summary for path in (tmp_path / "whole", folder)]
        assert summaries[0]["jumps"] == summaries[1]["jumps"]
        assert len(summaries[0]["jumps"]) == 1


def test_arc_length_needs_no_dynamics(tmp_path):
    with pytest.raises(CaseError, match=r"statics.after_limit: .*arc_length goes past limits by itself"):
        case_from_dict(arch(tmp_path, load=LOAD, control="arc_length", after_limit="dynamics"), tmp_path)
