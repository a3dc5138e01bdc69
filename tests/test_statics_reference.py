"""Static answers against independent codes (tests/reference/README.md), on 1, 2 and 3 ranks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from statics_cases import bar, block

from ancf_petsc import case_from_dict, open_results, run

REFERENCE = Path(__file__).parent / "reference"
STROKES = "[0.005,0.010,0.015,0.020,0.025]"
VARIANTS = {
    f"{law}_top_{top}_N": (f"material.law={law}", f"constraint.top.fix={fix}")
    for law in ("svk", "neo_hooke")
    for top, fix in (("fixed", '["x","y"]'), ("free", "[]"))
}


@pytest.fixture(scope="module")
def block_forces() -> np.ndarray:
    return np.genfromtxt(REFERENCE / "pvc_block_forces.csv", delimiter=",", names=True)


@pytest.mark.parametrize("column", VARIANTS)
def test_block_forces_equal_the_reference_on_any_number_of_ranks(
    column, block_forces, ancf, project, tmp_path
):
    """Within 1e-6 at every stroke; the curves of 1 and 3 ranks agree to 1e-9."""
    forces = {}
    for ranks in (1, 2, 3):
        out = tmp_path / f"run{ranks}"
        changes = [*VARIANTS[column], f"statics={{strokes={STROKES}}}"]
        ancf("run", project / "cases/pvc_block", "--out", out, "--set", *changes, "--quiet", ranks=ranks)
        curve = open_curve(out)
        np.testing.assert_allclose(-curve["stroke"][1:], block_forces["stroke_m"], rtol=1e-12)
        np.testing.assert_allclose(curve["force"][1:], block_forces[column], rtol=1e-6)
        forces[ranks] = curve["force"][1:]
    np.testing.assert_allclose(forces[2], forces[1], rtol=1e-9)
    np.testing.assert_allclose(forces[3], forces[1], rtol=1e-9)


def open_curve(folder: Path) -> dict[str, np.ndarray]:
    return open_results(folder).curve


def test_cube_force_equals_two_other_codes(tmp_path):
    """dolfinx and CalculiX agree on this force to all printed digits."""
    case = case_from_dict(block("cube_m2.msh", 0.015), tmp_path)
    force = run(case, tmp_path / "run").curve["force"][-1]
    assert force == pytest.approx(-2110.66766346, rel=1e-7)


@pytest.mark.parametrize("mesh", ["bar_2x2x10", "bar_2x2x20"])
@pytest.mark.parametrize("gravity", [0, 1])
def test_bar_stretches_as_the_reference(mesh, gravity, tmp_path):
    rows = np.genfromtxt(REFERENCE / "bar_tension.csv", delimiter=",", names=True)
    elements = 6 * int(np.prod([int(n) for n in mesh[4:].split("x")]))
    row = rows[(rows["elements"] == elements) & (rows["gravity"] == gravity)][0]
    case = case_from_dict(bar(f"{mesh}.msh", gravity=bool(gravity)), tmp_path)
    result = run(case, tmp_path / "run")
    # The reference lists 10 digits after the point.
    assert result.probes["middle.uz"][-1] == pytest.approx(row["mid_m"], rel=1e-6, abs=1e-10)
    assert result.probes["end.uz"][-1] == pytest.approx(row["end_m"], rel=1e-6, abs=1e-10)


def test_reactions_balance_weight_and_load(tmp_path):
    """rho g V = 382.59 N and the 120 N of the load hang on the top."""
    result = run(case_from_dict(bar("bar_2x2x10.msh", gravity=True), tmp_path), tmp_path / "run")
    assert result.curve["top.rz"][-1] == pytest.approx(7800 * 9.81 * 0.005 + 120, rel=1e-9)
    assert result.curve["top.rz"][-1] == pytest.approx(502.59, abs=1e-6)
    assert abs(result.curve["top.rx"][-1]) < 1e-6 * 502.59
