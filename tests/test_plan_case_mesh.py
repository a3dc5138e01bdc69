"""Meshes that a case asks for: of the program's bodies, made once; refined; their identity."""

import pytest

from ancf_petsc.analysis.identity import identity
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import case_from_dict
from ancf_petsc.plan.case_mesh import mesh_file
from ancf_petsc.results.reader import open_results


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr("ancf_petsc.mesh.made.cache_folder", lambda: tmp_path / "meshes")


def pressed(folder, **mesh):
    return case_from_dict(
        {
            "title": "pressed",
            "mesh": {"body": "cube", "element": "3413", **mesh},
            "material": {"law": "svk", "young": 6.8e6, "poisson": 0.35},
            "constraint": [
                {"group": "bottom", "fix": ["x", "y", "z"]},
                {"group": "top", "fix": ["x", "y"], "move": {"z": -0.004}},
                {"group": "symmetry_x", "fix": ["x"]},
                {"group": "symmetry_y", "fix": ["y"]},
            ],
            "statics": {"steps": 1},
            "output": {"curve": {"force": "top.z", "stroke": "top.z"}},
        },
        folder,
    )


def force(case, folder):
    return open_results(run_case(case, folder)).curve["force"][-1]


def test_a_body_is_made_once(tmp_path):
    case = pressed(tmp_path, size=0.025)
    made = mesh_file(case).stat().st_mtime_ns
    assert mesh_file(case).stat().st_mtime_ns == made
    assert not list(mesh_file(case).parent.glob("*.part*"))


def test_a_refined_mesh_gives_the_force_of_the_finer_one(tmp_path):
    """Bricks divided twice are the bricks of the finer grid."""
    coarse = pressed(tmp_path, divisions=[1, 1, 2], hexahedra=True, element="3813", refine=2)
    fine = pressed(tmp_path, divisions=[4, 4, 8], hexahedra=True, element="3813")
    assert force(coarse, tmp_path / "a") == pytest.approx(force(fine, tmp_path / "b"), rel=1e-9)


def test_refined_tetrahedra_give_nested_answers(tmp_path):
    """Displacements of the coarse mesh are among those of the fine one: its energy, and so the force, is never higher."""
    found = [abs(force(pressed(tmp_path, size=0.025, refine=k), tmp_path / f"{k}")) for k in range(3)]
    assert found[0] > found[1] > found[2]


def test_what_makes_another_mesh_makes_another_run(tmp_path):
    hashes = {
        identity(pressed(tmp_path, **keys)).hash
        for keys in ({"size": 0.025}, {"size": 0.02}, {"size": 0.025, "refine": 1}, {"divisions": [2, 2, 4]})
    }
    assert len(hashes) == 4
    assert identity(pressed(tmp_path, size=0.025)).hash == identity(pressed(tmp_path, size=2.5e-2)).hash


@pytest.mark.parametrize(
    ("mesh", "key", "words"),
    [
        ({"body": "cub"}, "mesh.body", "did you mean 'cube'"),
        ({"size": 0.02, "divisions": [2, 2, 4]}, "mesh.size", "bricks have divisions, not a size"),
        ({"size": 0.02, "rim": 0.03}, "mesh.rim", "at most mesh.size 0.02"),
        ({"body": "ellipsograph", "rim": 0.03}, "mesh.rim", "has no bonded face"),
    ],
)
def test_wrong_requests_name_their_key(tmp_path, mesh, key, words):
    with pytest.raises(CaseError) as caught:
        mesh_file(pressed(tmp_path, **mesh))
    assert caught.value.key == key
    assert words in str(caught.value)
    assert "--" not in str(caught.value)
