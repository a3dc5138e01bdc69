"""Natural frequencies by SLEPc, and the damping made of them."""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import PROJECT, Followed, body, pendulum

from ancf_petsc import case_from_dict, load_case
from ancf_petsc.analysis.modes import COLUMNS, find_modes
from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.results.tables import read_table

BAR = PROJECT / "cases" / "bar_tension"


def modes(folder, case=BAR, *, count=6, loaded=False, changes=()):
    rows = find_modes(load_case(case, changes), folder, count, loaded=loaded, force=False)
    return dict(zip(COLUMNS, rows.T, strict=True))


def test_periods_of_the_bar(tmp_path):
    """By a dense eigensolver of another program: bending twice, and the axial mode, the sixth."""
    found = modes(tmp_path / "modes")
    np.testing.assert_allclose(found["period"][[0, 1, 5]], [2.422115, 2.06323, 0.386335], rtol=2e-6)
    assert found["critical_damping"][0] == pytest.approx(5.1882, rel=1e-5)
    table = read_table(tmp_path / "modes" / "modes.csv")
    assert np.array_equal(table["frequency"], found["frequency"])


def test_first_period_under_load(tmp_path):
    assert modes(tmp_path / "modes", count=1, loaded=True)["period"][0] == pytest.approx(0.868031, rel=1e-6)


def test_axial_frequency_is_that_of_a_rod(tmp_path):
    """T = 4 L sqrt(rho / E) without lateral contraction; 10 elements along make it (pi/20)^2/24 = 0.1 %
    shorter.
    """
    found = modes(tmp_path / "modes", changes=["material.poisson=0.0"], count=8)
    rod = 4 * 0.5 * np.sqrt(7800.0 / 2e5)
    error = np.abs(found["period"] / rod - 1)
    assert error.min() < 0.002


def test_a_free_body_has_six_rigid_motions(tmp_path):
    """Then the first elastic mode, of period 0.0963 s."""
    found = modes(tmp_path / "modes", PROJECT / "cases" / "tumbling_block", count=7)
    assert found["omega"][:6].max() < 1e-4 * found["omega"][6]
    assert found["period"][6] == pytest.approx(0.0963, rel=1e-3)


def test_shapes_can_be_looked_at(tmp_path):
    """One step a mode, its frequency beside it; held nodes do not move."""
    import h5py

    found = modes(tmp_path / "modes", count=2)
    with h5py.File(tmp_path / "modes" / "results.h5") as file:
        assert list(file["steps"]) == ["00000", "00001"]
        step = file["steps/00001"]
        assert step.attrs["frequency"] == found["frequency"][1]
        moved = np.linalg.norm(step["displacement"], axis=1)
        top = file["mesh/points"][:, 2] > -1e-9
        assert moved[top].max() == 0.0
        assert moved.max() > 0.01


def test_critical_damping_of_a_numbered_mode():
    """{ critical = 6 }: alpha = 4 pi / T of the unloaded bar's axial mode."""
    bar = body(
        "bar_2x2x10.msh",
        {"duration": 0.01, "outputs": 1, "step": 0.01, "damping": {"critical": 6}},
        material={"young": 2e5},
        constraint=[{"group": "top", "fix": ["x", "y", "z"]}],
    )
    assert Followed(bar, lambda motion: motion.equations.damping).rows[0] == pytest.approx(32.527, rel=1e-4)


@pytest.mark.parametrize("damping", ["critical", {"critical": 1}])
def test_a_mode_that_does_not_vibrate_is_refused(damping):
    """The pendulum turns freely about its hinge: there is nothing to damp critically."""
    with pytest.raises(CaseError, match=r"dynamics.damping: .*; give a number, or \{ critical = n \}"):
        Followed(pendulum({"duration": 0.1, "step": 0.01, "damping": damping}))


def first_bending(folder, element, divisions):
    """First frequency of a clamped bar, 1 x 0.1 x 0.1 m, over that of an Euler-Bernoulli beam."""
    folder.mkdir()
    make_mesh("cantilever", folder / "bar.msh", divisions=divisions, hexahedra=element[:2] == "38")
    case = case_from_dict(
        {
            "title": "Clamped bar",
            "mesh": {"file": "bar.msh", "element": element},
            "material": {"law": "svk", "young": 1e7, "poisson": 0.3, "density": 1000.0},
            "constraint": [{"group": "clamp", "fix": ["x", "y", "z"]}],
            "dynamics": {"duration": 1.0, "step": 0.1},
        },
        folder,
    )
    rows = find_modes(case, folder / "modes", 1, loaded=False, force=False)
    omega = dict(zip(COLUMNS, rows.T, strict=True))["omega"][0]
    return omega / (1.8751041**2 * np.sqrt(1e7 * 0.1**2 / 12 / 1000.0))


def test_bending_frequency_of_a_clamped_bar_is_that_of_beam_theory(tmp_path):
    """Length over height is 10: shear and rotary inertia lower Euler and Bernoulli's frequency by about 1 %."""
    quadratic = first_bending(tmp_path / "quadratic", "3-10-1-3", (20, 2, 2))
    bricks = first_bending(tmp_path / "bricks", "3843", (10, 1, 1))
    assert quadratic == pytest.approx(0.99, abs=0.01)
    # All approach the same solid from above, with different cells.
    assert quadratic == pytest.approx(bricks, rel=5e-3)
    for code in ("3443", "3443+4"):
        assert first_bending(tmp_path / code, code, (10, 1, 1)) == pytest.approx(bricks, rel=1e-2), code


def test_linear_tetrahedra_are_too_stiff_in_bending_and_soften_with_refinement(tmp_path):
    """3413 locks: its frequency comes down towards the quadratic element's, which is a bound from nearer."""
    coarse = first_bending(tmp_path / "coarse", "3413", (10, 2, 2))
    fine = first_bending(tmp_path / "fine", "3413", (40, 8, 8))
    refined = first_bending(tmp_path / "refined", "3-10-1-3", (20, 2, 2))
    assert coarse > 1.3 * refined
    assert refined < fine < refined + 0.3 * (coarse - refined)
