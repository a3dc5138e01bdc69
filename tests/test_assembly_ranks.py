"""What is assembled on 1, 2 and 3 ranks: tangents against differences of the forces."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from element_cells import CODES
from family import mesh_of, unit_cube

from ancf_petsc.element.catalog import element
from ancf_petsc.kernel.warmup import compile_kernels
from ancf_petsc.material import LAWS

SECTION = {"thickness": 0.7, "plane": "strain"}
# Differences are exact to 1e-10, 2e-9 where beams are bent sharply; neo-Hooke's mean stress divides the rise of the
# energy, which is rounded, by small strains.
TOLERANCES = {"tangent": 1e-8, "tangent_product": 1e-8, "mean_tangent": 2e-8}


def body(code: str, folder: Path) -> dict:
    """No two cells alike, two laws, one side held in x and moved in z (a beam in x and z): it is never solved."""
    row = element(code)
    mesh = (
        mesh_of("pendulum", code, (6, 1, 1), folder)
        if row.is_beam
        else unit_cube(code, 3 if row.is_plane else 2, folder, odd=True)
    )
    laws = [{"law": "svk", "young": 1.0, "poisson": 0.3, "density": 1.0}]
    data = {
        "title": f"Tangents of {code}",
        "mesh": {"file": str(mesh), "element": code},
        "groups": {"side": {"plane": "x", "at": "min"}, "half": {"box": [[-9, -9, -9], [0.75, 9, 9]]}},
        "material": laws,
        "constraint": [{"group": "side", "fix": ["x"], "move": {"z" if row.components == 3 else "y": 0.02}}],
        "dynamics": {"duration": 1.0, "step": 0.1},
    }
    if row.is_beam:
        data["section"] = {"area": 0.01, "inertia": 1e-5}
        data["constraint"][0]["move"] = {"z": 0.02}
    else:
        laws.append({"law": "neo_hooke", "young": 3.0, "poisson": 0.2, "density": 1.0, "group": "half"})
    if row.is_plane:
        data["section"] = SECTION
    return data


@pytest.fixture(scope="module")
def found(request, tmp_path_factory, on_three_ranks):
    """For each element that is asked for what `tangents_on_ranks` finds on one, two and three ranks."""
    folder = tmp_path_factory.mktemp("tangents")
    asked = [code for code in CODES if any(f"[{code}]" in item.name for item in request.session.items)]
    (folder / "cases.json").write_text(json.dumps({code: body(code, folder) for code in asked}))
    for code in asked:  # once, not on three ranks at the same time
        compile_kernels(element(code), list(LAWS.values()), mean=True)
    program = Path(__file__).with_name("tangents_on_ranks.py")
    said = on_three_ranks(program, folder / "cases.json")
    return json.loads(said.stdout.partition("FOUND")[2])


@pytest.mark.parametrize("code", CODES)
def test_tangents_are_the_differences_of_the_forces_on_any_number_of_ranks(code, found):
    """Along random directions. Rows and columns of driven degrees of freedom are left out, with the mean of the other
    diagonal terms on their diagonal.
    """
    for ranks, errors in zip((1, 2, 3), found[code], strict=True):
        assert errors["driven"] > 0
        for name, most in TOLERANCES.items():
            assert errors[name] < most, f"{name} on {ranks} ranks"
        for name in ("tangent where driven", "mean_tangent where driven"):
            assert errors[name] < 1e-13, f"{name} on {ranks} ranks"


@pytest.mark.parametrize("code", CODES)
def test_mean_forces_do_the_work_that_the_energy_grows_by(code, found):
    """An identity: rounding over the difference of two energies."""
    assert [errors["work of mean_force"] for errors in found[code]] == pytest.approx([0.0] * 3, abs=1e-11)


@pytest.mark.parametrize("code", CODES)
def test_energy_and_smallest_determinant_count_every_cell_once(code, found):
    one, *others = found[code]
    for name in ("energy", "smallest_det", "driven"):
        assert [other[name] for other in others] == pytest.approx([one[name]] * 2, rel=1e-12)
