"""Elements near nu = 0.5: who is warned, and of what."""

from __future__ import annotations

import pytest

from ancf_petsc import CaseError, case_from_dict
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.plan.plan import make_plan

KINDS = {"3413": {}, "3-10-1-3": {}, "3813": {"hexahedra": True}, "3843": {"hexahedra": True}}
PLANE = {"2412": "stress", "2432": "strain"}


def notes(code, poisson, folder, plane=""):
    mesh = make_mesh(
        "pendulum",
        folder / "body.msh",
        divisions=(1, 1, 1),
        **({"flat": "quad"} if code[0] == "2" else KINDS[code]),
    )
    data = {
        "title": "Pad",
        "mesh": {"file": str(mesh), "element": code},
        "material": {"law": "svk", "young": 1.0, "poisson": poisson, "density": 1.0},
        "dynamics": {"duration": 1.0, "step": 0.1},
    }
    data |= {"section": {"thickness": 1.0, "plane": plane}} if plane else {}
    return [note for note in make_plan(case_from_dict(data, folder)).mesh.notes if "poisson" in note]


@pytest.mark.parametrize(
    ("code", "plane", "instead"),
    [
        ("3413", "", 'element = "3-10-1-3" on the same mesh'),
        ("3813", "", 'element = "3843" where cells are parallelepipeds, else tetrahedra with "3-10-1-3"'),
        ("2412", "strain", 'element = "2432"'),
    ],
)
def test_linear_elements_are_warned_of_from_045_on(code, plane, instead, tmp_path):
    (note,) = notes(code, 0.45, tmp_path, plane)
    assert f"element {code} with poisson = 0.45 is too stiff" in note
    assert note.endswith(f"take {instead}")
    assert not notes(code, 0.449, tmp_path, plane)


@pytest.mark.parametrize(
    ("code", "plane"), [("3-10-1-3", ""), ("3843", ""), ("2432", "strain"), ("2412", "stress")]
)
def test_elements_that_keep_their_volume_are_not(code, plane, tmp_path):
    assert not notes(code, 0.499, tmp_path, plane)


def test_run_and_check_say_it(ancf, tmp_path):
    mesh = make_mesh("cube", tmp_path / "cube.msh", divisions=(1, 1, 1))
    (tmp_path / "case.toml").write_text(
        f"""title = "Pad"
mesh = {{ file = "{mesh.name}", element = "3413" }}
material = {{ law = "neo_hooke", young = 1.0, poisson = 0.49 }}
groups = {{ low = {{ plane = "z", at = "min" }} }}
constraint = [{{ group = "low", fix = ["x", "y", "z"] }}]
statics = {{ steps = 1 }}
"""
    )
    for verb in ("check", "run"):
        said = ancf(verb, "case.toml")
        text = " ".join((said.stdout + said.stderr).split())
        assert "element 3413 with poisson = 0.49 is too stiff" in text
        assert "3-10-1-3" in text


def test_one_half_is_refused_with_the_element_to_take(tmp_path):
    with pytest.raises(
        CaseError,
        match=r"found 0.5, expected a number in \(-1, 0.5\); use 0.49 with element 3-10-1-3 or 3843",
    ):
        notes("3413", 0.5, tmp_path)
