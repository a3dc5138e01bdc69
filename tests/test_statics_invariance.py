"""The answer does not depend on units or on the axes of the frame."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from statics_cases import MESHES, block

from ancf_petsc import case_from_dict, run


def pressed(folder, mesh, top=(0.0, 0.0, -0.008), young=6.8e6, law="svk"):
    """The block between bonded plates without symmetry planes: the force (3,) on the top."""
    data = block("pvc_block_234.msh", 0.01, steps=4)
    data["mesh"]["file"] = str(mesh)
    data["material"] = {"law": law, "young": young, "poisson": 0.35}
    data["constraint"] = [
        {"group": "bottom", "fix": ["x", "y", "z"]},
        {"group": "top", "move": dict(zip("xyz", map(float, top), strict=True)), "ramp": "cosine"},
    ]
    curve = run(case_from_dict(data, folder), folder / "run").curve
    return np.array([curve[f"top.r{axis}"][-1] for axis in "xyz"])


def moved_mesh(folder, change):
    """The block's mesh with changed points, its groups kept."""
    import gmsh

    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(MESHES / "pvc_block_234.msh"))
    tags, points, _ = gmsh.model.mesh.getNodes()
    for tag, point in zip(tags, change(points.reshape(-1, 3)), strict=True):
        gmsh.model.mesh.setNode(int(tag), point, [])
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
    gmsh.write(str(folder / "moved.msh"))
    gmsh.finalize()
    assert meshio.read(folder / "moved.msh").points.shape == (234, 3)
    return folder / "moved.msh"


@pytest.mark.parametrize("law", ["svk", "neo_hooke"])
def test_millimetres_and_megapascals_give_the_same_forces(law, tmp_path):
    """mm, MPa, N against m, Pa, N, to 1e-9."""
    (tmp_path / "m").mkdir()
    (tmp_path / "mm").mkdir()
    metres = pressed(tmp_path / "m", MESHES / "pvc_block_234.msh", law=law)
    mesh = moved_mesh(tmp_path, lambda points: 1e3 * points)
    millimetres = pressed(tmp_path / "mm", mesh, top=(0.0, 0.0, -8.0), young=6.8, law=law)
    np.testing.assert_allclose(millimetres, metres, atol=1e-9 * np.abs(metres).max())


@pytest.mark.parametrize("law", ["svk", "neo_hooke"])
def test_turned_case_gives_turned_forces(law, tmp_path):
    """A random rotation of mesh and motion turns the force, to 1e-9."""
    turn, _ = np.linalg.qr(np.random.default_rng(11).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    (tmp_path / "as_is").mkdir()
    (tmp_path / "turned").mkdir()
    straight = pressed(tmp_path / "as_is", MESHES / "pvc_block_234.msh", law=law)
    mesh = moved_mesh(tmp_path, lambda points: points @ turn.T + [5.0, -3.0, 2.0])
    turned = pressed(tmp_path / "turned", mesh, top=turn @ [0.0, 0.0, -0.008], law=law)
    np.testing.assert_allclose(turned, turn @ straight, atol=1e-9 * np.abs(straight).max())
