"""Bodies far from the file's origin: the same answers, in the file's coordinates."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from family import unit_cube
from statics_cases import MESHES, block

from ancf_petsc import case_from_dict, run
from ancf_petsc.plan.space import nearby_origin

FAR = np.array([2500.0, -1000.0, 31.0])
DENSITY, VOLUME = 7800.0, 0.5 * 0.1 * 0.1


def moved(mesh, folder, shift, scale=1.0):
    """The tetrahedra of a mesh, scaled and then moved."""
    read = meshio.read(mesh)
    path = folder / "moved.vtu"
    meshio.Mesh(read.points * scale + shift, [("tetra", read.cells_dict["tetra"])]).write(path)
    return path


def cube(folder, code, shift, scale):
    """A cube pressed between two sides chosen by plane."""
    path = moved(unit_cube(code, 2, folder), folder, shift, scale)
    return {
        "title": "Cube",
        "mesh": {"file": str(path), "element": code},
        "groups": {"bottom": {"plane": "z", "at": "min"}, "top": {"plane": "z", "at": "max"}},
        "material": {"law": "neo_hooke", "young": 1e6, "poisson": 0.4},
        "constraint": [
            {"group": "bottom", "fix": ["x", "y", "z"]},
            {"group": "top", "fix": ["x", "y"], "move": {"z": -0.2 * scale}},
        ],
        "statics": {"steps": 2},
        "output": {"curve": {"force": "top.z", "stroke": "top.z"}},
        "probe": [{"name": "top", "group": "top"}],
    }


@pytest.mark.parametrize(("code", "scale"), [("3413", 0.3), ("3443", 0.01), ("3-10-1-3", 0.01)])
def test_statics_far_away(code, scale, tmp_path):
    """To what rounding leaves of the mesh's own coordinates: 5e-13 of 2500, a part of 1e-10 of cells of 5 mm."""
    here, there = (
        run(case_from_dict(cube(tmp_path, code, shift, scale), tmp_path), tmp_path / name)
        for name, shift in (("here", 0.0), ("there", FAR))
    )
    for column in ("force", "strain_energy", "external_work", "stroke"):
        wanted = here.curve[column]
        np.testing.assert_allclose(
            there.curve[column], wanted, rtol=0, atol=1e-8 * np.abs(wanted).max(), err_msg=column
        )
    for axis, far in zip("xyz", FAR, strict=True):
        found, wanted = (each.probes[f"top.{axis}"] for each in (there, here))
        np.testing.assert_allclose(found - far, wanted, rtol=0, atol=1e-11)
    np.testing.assert_allclose(there.points - FAR, here.points, rtol=0, atol=1e-12)


def test_the_shipped_block_at_30_m(tmp_path):
    """Its groups come with the file: Gmsh's text, every node moved."""
    lines = (MESHES / "pvc_block_234.msh").read_text().split("\n")
    first = lines.index("$Nodes") + 2
    count = int(lines[first - 1])
    for k in range(first, first + count):
        number, *point = lines[k].split()
        lines[k] = " ".join([number, *(repr(float(c) + 30.0) for c in point)])
    (tmp_path / "far.msh").write_text("\n".join(lines))
    data = block("pvc_block_234.msh", 0.005, steps=1)
    here = run(case_from_dict(data, tmp_path), tmp_path / "here")
    data["mesh"]["file"] = str(tmp_path / "far.msh")
    there = run(case_from_dict(data, tmp_path), tmp_path / "there")
    assert there.curve["force"][-1] == pytest.approx(here.curve["force"][-1], rel=1e-9)


@pytest.mark.parametrize("integrator", ["runge_kutta_4", "generalized_alpha"])
def test_motion_far_away(integrator, tmp_path):
    """A free body that flies and turns about a point: momenta about the file's origin, potential with its height."""
    runs = []
    for name, shift in (("here", np.zeros(3)), ("there", FAR)):
        data = {
            "title": "Flight",
            "mesh": {"file": str(moved(MESHES / "pendulum_96.msh", tmp_path, shift)), "element": "3413"},
            "groups": {"tip": {"plane": "x", "at": "max"}},
            "material": {"law": "svk", "young": 2e6, "poisson": 0.3, "density": DENSITY},
            "load": [{"type": "gravity", "acceleration": [1.0, 0.0, -9.81]}],
            "initial": {
                "velocity": [1.0, 2.0, 3.0],
                "spin": [0.0, 5.0, 1.0],
                "centre": [float(c) for c in shift + [0.5, 0.0, 0.0]],
            },
            "dynamics": {"duration": 0.02, "outputs": 2, "integrator": integrator, "step": 2e-4},
            "probe": [{"name": "tip", "group": "tip"}],
        }
        runs.append(run(case_from_dict(data, tmp_path), tmp_path / name))
    here, there = (each.curve for each in runs)
    mass = DENSITY * VOLUME
    for column in ("kinetic_energy", "strain_energy", "momentum.x", "momentum.y", "momentum.z"):
        size = np.abs(here[column]).max() + here["strain_energy"].max()
        np.testing.assert_allclose(there[column], here[column], rtol=0, atol=1e-7 * size, err_msg=column)
    linear = np.stack([here[f"momentum.{axis}"] for axis in "xyz"], axis=1)
    orbital = np.cross(FAR, linear)
    for k, axis in enumerate("xyz"):
        wanted = here[f"angular_momentum.{axis}"] + orbital[:, k]
        np.testing.assert_allclose(there[f"angular_momentum.{axis}"], wanted, rtol=0, atol=1e-9 * 1e5)
        np.testing.assert_allclose(
            runs[1].probes[f"tip.{axis}"] - FAR[k], runs[0].probes[f"tip.{axis}"], rtol=0, atol=1e-8
        )
    height = -mass * (np.array([1.0, 0.0, -9.81]) @ FAR)
    np.testing.assert_allclose(there["potential_energy"] - here["potential_energy"], height, rtol=1e-10)


def test_bodies_near_the_origin_stay_where_they_are():
    """And the shift of others costs no digit: it is a multiple of a power of two."""
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    assert not nearby_origin(points, 3.0).any()
    far = points * 1e-3 + [1000.1, 0.0, -7.3]
    origin = nearby_origin(far, 4e-3)
    assert np.abs(origin - [1000.1, 0.0, -7.3]).max() < 4e-3
    assert np.array_equal((far - origin) + origin, far)
