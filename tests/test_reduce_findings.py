"""What `ancf advise` finds in a scene, said with what it saves and how to get it."""

from __future__ import annotations

import numpy as np
import pytest
from scene_bodies import box_case, ring_case

from ancf_petsc import load_case, open_results, run
from ancf_petsc.reduce.findings import findings, largest_gradient


def by_kind(found):
    return {finding.kind: finding for finding in found}


def test_of_the_block(project):
    found = by_kind(findings(load_case(project / "cases" / "pvc_block"), at={"stroke": 0.01}))
    ring = found["revolution"]
    assert (
        "a sector of 90 degrees of a body of revolution about the axis through (0, 0, 0.05) along (0, 0, 1)"
        in ring.sentence
    )
    assert ring.how.endswith("cases/pvc_block --to section")
    assert ring.factor == pytest.approx(2 * 141 / 702, rel=0.05)
    assert found["path"].how == "--set constraint.top.move.z=-0.01"
    assert found["path"].factor == pytest.approx(0.4)
    assert found["outputs"].factor == pytest.approx(1 / 25)
    assert found["outputs"].how == "--set statics.steps= statics.strokes=[0.01]"


def test_of_bars(project, tmp_path):
    """Two planes, one, and none that is normal to an axis."""
    bar = by_kind(findings(load_case(project / "cases" / "bar_tension" / "statics.toml")))
    assert (
        bar["mirror"].sentence == "symmetric about x = 0.05 and y = 0.05: a quarter does, 60 of 240 elements"
    )
    assert bar["mirror"].how.endswith("cases/bar_tension/statics.toml --to quarter")
    assert bar["mirror"].factor == 0.25
    assert "outputs" not in bar
    cantilever = by_kind(findings(load_case(project / "cases" / "cantilever" / "quadratic_tetrahedra.toml")))
    assert cantilever["mirror"].how.endswith("--to half-y")
    assert "meshed anew" in cantilever["mirror"].sentence
    diagonal = [{"type": "gravity", "acceleration": [1.0, 1.0, 0.0]}]
    square = {"low": {"plane": "z", "at": "min"}, "high": {"plane": "z", "at": "max"}}
    from scene_bodies import box_mesh

    box_mesh(tmp_path / "box.vtu", (2, 2, 2), size=(1.0, 1.0, 3.0))
    found = by_kind(findings(box_case(tmp_path, groups=square, load=diagonal)))
    assert (
        "about the plane (0.7071, -0.7071, 0) . x = 0, which is normal to no axis" in found["mirror"].sentence
    )


def test_of_a_ring_and_a_prism(tmp_path):
    found = by_kind(findings(ring_case(tmp_path, size=3.5)))
    assert "a body of revolution about the axis" in found["revolution"].sentence
    assert found["revolution"].factor < 0.2
    assert found["mirror"].factor == 0.25
    rows = [
        {"group": "front", "fix": ["y"]},
        {"group": "back", "fix": ["y"]},
        {"group": "low", "fix": ["x", "z"]},
        {"group": "high", "fix": ["x"], "move": {"z": -0.3}},
    ]
    ends = {
        name: {"plane": a, "at": at}
        for name, a, at in (
            ("front", "y", "min"),
            ("back", "y", "max"),
            ("low", "z", "min"),
            ("high", "z", "max"),
        )
    }
    prism = by_kind(findings(box_case(tmp_path, groups=ends, constraint=rows)))["prism"]
    assert "prismatic along y" in prism.sentence
    assert "thickness = 1" in prism.how


def test_of_strains_in_a_run(tmp_path):
    """Pressed by a ten thousandth it is linear, by a tenth it is not; the gradient is that of a body strained evenly."""
    free = [
        {"group": "low", "fix": ["z"]},
        {"group": "pin", "fix": ["x", "y", "z"]},
        {"group": "side", "fix": ["y"]},
    ]
    groups = {
        "low": {"plane": "z", "at": "min"},
        "high": {"plane": "z", "at": "max"},
        "pin": {"nearest": [0, 0, 0]},
        "side": {"nearest": [2, 0, 0]},
    }
    for stroke, linear in ((3e-4, True), (0.3, False)):
        rows = [*free, {"group": "high", "move": {"z": -stroke}}]
        case = box_case(tmp_path, groups=groups, constraint=rows)
        results = run(case, tmp_path / f"run {stroke}")
        assert largest_gradient(results) == pytest.approx(stroke / 3, rel=1e-6)
        found = by_kind(findings(case, results))
        assert ("linear" in found) == linear
        if linear:
            assert found["linear"].within == pytest.approx(1e-4, rel=0.1)
            assert found["linear"].how == "--set statics.times= statics.strokes= statics.steps=1"


@pytest.mark.parametrize(("duration", "matters"), [(2.0, False), (0.1, True)])
def test_of_inertia_in_a_run(tmp_path, duration, matters):
    """The box pressed slowly and fast; its longest period is about 0.5."""
    case = box_case(
        tmp_path,
        statics=None,
        dynamics={"duration": 8 * duration, "step": duration / 4, "outputs": 32},
    )
    results = run(case, tmp_path / "run")
    inertia = by_kind(findings(case, open_results(tmp_path / "run")))["inertia"]
    kinetic, strain = results.curve["kinetic_energy"], results.curve["strain_energy"]
    assert inertia.within >= kinetic.max() / max(strain.max(), np.abs(results.curve["external_work"]).max())
    assert ("statics does" in inertia.sentence) == (not matters)
    assert ("inertia matters" in inertia.sentence) == matters


def test_advice_begins_with_them(project):
    """As sentences with their commands, for the stroke that is asked for."""
    from ancf_petsc.advise.advise import scene_findings
    from ancf_petsc.advise.question import read_quantity

    said = scene_findings(load_case(project / "cases" / "pvc_block"), read_quantity("force@stroke=0.010"))
    assert any(line.endswith("cases/pvc_block --to section") for line in said)
    assert "--set constraint.top.move.z=-0.01" in "\n".join(said)
