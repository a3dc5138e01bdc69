"""What ends a path, named: the material, a free surface, the body as a whole, an element at an edge, a step too long."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from slender_bodies import arch, column, grid, solved
from statics_cases import block

from ancf_petsc.mesh.kinds import KUHN
from ancf_petsc.solve.newton import Newton, Outcome


def bar(
    folder: Path,
    counts: tuple[int, int, int],
    code: str,
    law: str,
    squeeze: float,
    *,
    turn: int = 0,
    **statics: Any,
) -> dict[str, Any]:
    """A quarter of a bar twice as long as wide, between lubricated plates; its axis is x, or another one."""
    points, cells = grid(counts, (1.0, 0.5, 0.5))
    tetrahedra = ("tetra", cells[:, np.array(KUHN)].reshape(-1, 4))
    mesh = tetrahedra if code == "3413" else ("hexahedron", cells)
    path = folder / f"bar_{counts[0]}_{code}_{turn}.vtu"
    meshio.Mesh(np.roll(points, turn, axis=1), [mesh]).write(path)
    x, y, z = np.roll(list("xyz"), -turn)
    sides = {"foot": (x, "min"), "head": (x, "max"), "one": (y, "min"), "other": (z, "min")}
    return {
        "title": "Bar between lubricated plates",
        "mesh": {"file": str(path), "element": code},
        "groups": {name: {"plane": str(axis), "at": at} for name, (axis, at) in sides.items()},
        "material": {"law": law, "young": 1e6, "poisson": 0.35},
        "constraint": [
            {"group": "foot", "fix": [str(x)]},
            {"group": "one", "fix": [str(y)]},
            {"group": "other", "fix": [str(z)]},
            {"group": "head", "move": {str(x): -squeeze}},
        ],
        "statics": {"steps": 5, **statics},
    }


def test_svk_ends_at_its_limit_where_elements_are_too_long_to_fold(tmp_path):
    """Past 0.577 in uniaxial stress; four elements along the bar."""
    data = bar(tmp_path, (4, 2, 2), "3413", "svk", 0.6, on_bifurcation="stop")
    _, summary, said = solved(data, tmp_path)
    end = summary["end"]
    assert end["kind"] == "material_limit"
    assert end["critical_stretch"] == pytest.approx(3**-0.5, abs=1e-6)
    assert end["smallest_stretch"] == pytest.approx(3**-0.5, abs=0.01)
    assert "svk carries no more force below 0.577" in said
    assert summary["critical_points"][0]["cause"] == "material_limit"


@pytest.mark.parametrize(
    ("law", "code", "turn", "critical"),
    [("svk", "3413", 0, 0.6155), ("neo_hooke", "3813", 1, 0.4771)],
)
def test_a_free_surface_folds_before_where_elements_are_short(law, code, turn, critical, tmp_path):
    """Biot's stretch in uniaxial stress, computed: svk folds before it reaches its limit, neo-Hooke has none."""
    data = bar(tmp_path, (8, 4, 4), code, law, 0.6, turn=turn, on_bifurcation="stop")
    _, summary, said = solved(data, tmp_path)
    end = summary["end"]
    assert end["kind"] == "surface_fold"
    assert end["critical_stretch"] == pytest.approx(critical, abs=0.004)
    assert 0.9 * critical < end["smallest_stretch"] < critical
    assert "the free surface folds" in said
    assert end["smallest_stretch"] > 3**-0.5 or law != "svk"


def test_an_element_at_a_sharp_groove_is_pressed_flat(tmp_path):
    """svk has no barrier: at the root of the groove of the shipped block."""
    data = block("pvc_block_234.msh", 0.05, steps=2)
    _, summary, said = solved(data, tmp_path)
    end = summary["end"]
    assert (end["kind"], end["at_singular_edge"]) == ("inverted_element", True)
    assert np.hypot(*end["place"][:2]) == pytest.approx(0.073, abs=0.003)  # the root's radius is 70 mm
    assert abs(end["det_F"]) < 0.02
    assert "pressed flat at a singular edge" in said


def test_pressed_from_all_sides_the_material_shears_off(tmp_path):
    """No surface is free; svk is not elliptic any more below 0.905 (its shear waves), long before 0.577."""
    data = bar(tmp_path, (4, 2, 2), "3813", "svk", 0.5, on_bifurcation="stop")
    for axis in "yz":
        data["groups"][f"top_{axis}"] = {"plane": axis, "at": "max"}
        data["constraint"].append({"group": f"top_{axis}", "move": {axis: -0.25}})
    _, summary, said = solved(data, tmp_path)
    end = summary["end"]
    assert (end["kind"], end["critical_stretch"]) == ("material_limit", None)
    assert end["smallest_stretch"] == pytest.approx(0.905, abs=0.015)
    assert "svk is not elliptic any more" in said


def test_a_column_that_buckles_loses_definiteness_as_a_whole(tmp_path):
    data = column(tmp_path, "3813", statics={"steps": 5, "on_bifurcation": "stop"})
    _, summary, _ = solved(data, tmp_path)
    assert summary["end"]["kind"] == "lost_definiteness"
    assert summary["critical_points"][0]["cause"] == "lost_definiteness"


def test_an_arch_that_snaps_ends_at_a_limit_point(tmp_path):
    _, summary, said = solved(arch(tmp_path, load=0.02, steps=2), tmp_path)
    assert summary["end"]["kind"] == "limit_point"
    assert 'statics.after_limit = "dynamics" goes past it' in said


def test_a_step_that_is_merely_too_long(tmp_path, monkeypatch):
    """Newton's method finds nothing over more than 0.3 of the path, and no step shorter than all of it is allowed."""
    solve = Newton.solve

    def short(self, s, x, *, careful=False):
        near = solve(self, s, x, careful=careful)
        self.at = getattr(self, "at", 0.0)
        if s - self.at > 0.3:
            return Outcome(converged=False, reason="too far", newton=9, linear=0, residuals=())
        self.at = max(self.at, s) if near.converged else self.at
        return near

    monkeypatch.setattr(Newton, "solve", short)
    _, summary, said = solved(
        bar(tmp_path, (4, 2, 2), "3813", "neo_hooke", 0.3, steps=1, smallest_step=1.0), tmp_path
    )
    end = summary["end"]
    assert end["kind"] == "step_too_long"
    assert end["reached"] > end["pseudo_time"] + 0.3
    assert "shorter ones lead on to pseudo-time 0." in said
    assert "take a statics.smallest_step below 1" in said
