"""Parts of symmetric bodies against the whole: what a plane of symmetry holds, and what is no such plane."""

from __future__ import annotations

import itertools

import meshio
import numpy as np
import pytest

from ancf_petsc import case_from_dict, run
from ancf_petsc.element.catalog import element
from ancf_petsc.mesh.generate import bricks
from ancf_petsc.mesh.kinds import KUHN
from ancf_petsc.plan.plan import make_plan
from ancf_petsc.plan.symmetry import Held, Sheared, planes_of_symmetry

AXES = "xyz"
SIZES, CELLS = (1.0, 0.7, 0.5), (1, 1, 2)
MIRRORED = {"tetra": [0, 2, 1, 3], "hexahedron": [0, 3, 2, 1, 4, 7, 6, 5], "quad": [0, 3, 2, 1]}


def box(kind):
    """Points and cells of a box with a corner at the origin; of a rectangle in the plane x-y."""
    axes = [np.linspace(0, size, n + 1) for size, n in zip(SIZES, CELLS, strict=True)]
    if kind == "quad":
        axes = [np.linspace(0, 1.0, 2), np.linspace(0, 0.5, 3), np.zeros(1)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    if kind == "quad":
        index = np.arange(6).reshape(2, 3)
        return points.reshape(-1, 3), np.stack(
            (index[0, :-1], index[1, :-1], index[1, 1:], index[0, 1:]), axis=1
        )
    points, cells = bricks(points.transpose(2, 1, 0, 3))
    return points, cells[:, np.array(KUHN)].reshape(-1, 4) if kind == "tetra" else cells


def reflected(points, cells, kind, axis):
    """The body and its image in the plane through the origin."""
    here = np.abs(points[:, axis]) < 1e-12
    image = np.where(here, np.arange(len(points)), len(points) + np.cumsum(~here) - 1)
    others = points[~here] * np.where(np.arange(3) == axis, -1.0, 1.0)
    return np.concatenate((points, others)), np.concatenate((cells, image[cells][:, MIRRORED[kind]]))


def pressed(code, body, planes, folder, *, turn=0, whole=False, scale=1.0):
    """A bonded block pressed along its last axis; turn: by how many places x, y, z are exchanged in a circle."""
    kind, name = element(code).cell_name, f"{code}_{turn}_{whole}_{len(planes)}"
    last = 1 if kind == "quad" else 2
    axes = [AXES[(i + turn) % 3] for i in range(3)]
    points = np.roll(body[0], turn, axis=1) * scale
    meshio.Mesh(points, [(kind, body[1])]).write(folder / f"{name}.vtu")
    bonded = [axes[i] for i in range(last)]
    ends = [("high", -0.05)] + (
        [("low", 0.05 if last in planes else 0.0)] if last not in planes or whole else []
    )
    data = {
        "title": name,
        "mesh": {"file": f"{name}.vtu", "element": code},
        "groups": {"high": {"plane": axes[last], "at": "max"}, "low": {"plane": axes[last], "at": "min"}},
        "material": {"law": "neo_hooke", "young": 2.0 / scale**2, "poisson": 0.35},
        "constraint": [{"group": g, "fix": bonded, "move": {axes[last]: scale * d}} for g, d in ends],
        "statics": {"steps": 1, "tolerance": 1e-12},
    }
    if kind == "quad":
        data["section"] = {"thickness": 1.0, "plane": "strain"}
    for axis in () if whole else planes:
        data["groups"][f"symmetry_{axis}"] = {"plane": axes[axis], "at": 0.0}
        data["constraint"].append({"group": f"symmetry_{axis}", "fix": [axes[axis]]})
    results = run(case_from_dict(data, folder), folder / f"run_{name}")
    return results.curve[f"high.r{axes[last]}"][-1], results.curve["strain_energy"][-1]


PLANES = {
    "3843": [(0,), (0, 1), (0, 1, 2)],
    "3443": [(1,), (0, 1, 2)],
    "3443+4": [(2,), (0, 1)],
    "2432": [(0,), (0, 1)],
    "3-10-1-3": [(0, 1)],
}


@pytest.mark.parametrize(("code", "planes"), [(c, p) for c, several in PLANES.items() for p in several])
def test_a_part_is_the_whole(code, planes, tmp_path):
    """Half, quarter and eighth; cells reflected with the body, so both have one discrete answer. Newton leaves 1e-12."""
    kind = element(code).cell_name
    part = whole = box(kind)
    for axis in planes:
        whole = reflected(*whole, kind, axis)
    force, energy = pressed(code, part, planes, tmp_path)
    force_of_all, energy_of_all = pressed(code, whole, planes, tmp_path, whole=True)
    last = 1 if kind == "quad" else 2
    assert force * 2 ** len(set(planes) - {last}) == pytest.approx(force_of_all, rel=1e-10)
    assert energy * 2 ** len(planes) == pytest.approx(energy_of_all, rel=1e-10)


@pytest.mark.parametrize("code", ["3843", "3443"])
def test_planes_of_any_axis_and_bodies_of_any_size(code, tmp_path):
    """The block with x, y, z exchanged, in metres and in millimetres; only the numbering of components changes."""
    body = box(element(code).cell_name)
    force, energy = pressed(code, body, (0, 1, 2), tmp_path)
    for turn, scale in ((1, 1.0), (2, 1e3)):
        found = pressed(code, body, (0, 1, 2), tmp_path, turn=turn, scale=scale)
        assert found == pytest.approx((force, energy * scale), rel=1e-10)


def mirrors(held, sheared=(), across=None):
    """Of the faces of a unit cube: held and sheared name faces and axes."""
    points = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    sides = {
        f"{AXES[axis]}{end}": np.flatnonzero(points[:, axis] == end)[[0, 1, 3, 2]]
        for axis in range(3)
        for end in (0, 1)
    }

    def rows(names):
        return np.array([sides[name] for name in names.split()])

    def numbers(axes):
        return frozenset(AXES.index(axis) for axis in axes)

    supports = [Held(names, numbers(fix + move), numbers(fix), rows(names)) for names, fix, move in held]
    forces = [Sheared(numbers(axes), rows(names)) for names, axes in sheared]
    found = planes_of_symmetry(points, 1.0, across, supports, forces)
    return {(mirror.group, AXES[mirror.normal]) for mirror in found}


def test_a_flat_side_with_its_normal_component_held_alone_is_a_plane_of_symmetry():
    assert mirrors([("x0", "x", ""), ("y0", "y", ""), ("z1", "z", "")]) == {
        ("x0", "x"),
        ("y0", "y"),
        ("z1", "z"),
    }
    assert mirrors([("x0 x1", "x", "")]) == {("x0 x1", "x")}


@pytest.mark.parametrize(
    ("held", "sheared"),
    [
        ([("x0", "xy", "")], ()),
        ([("x0", "x", ""), ("x0", "yz", "")], ()),
        ([("x0", "", "x")], ()),
        ([("x0", "y", "")], ()),
        ([("x0 y0", "x", "")], ()),
        ([("x0", "x", "")], [("x0", "z")]),
    ],
    ids=["bonded", "bonded by two", "moved", "held along it", "not flat", "sheared by a force"],
)
def test_what_is_no_plane_of_symmetry(held, sheared):
    assert mirrors(held, sheared) == set()


def test_of_a_plane_body_the_component_across_does_not_count():
    assert mirrors([("x0", "xz", "")], across=2) == {("x0", "x")}


def test_the_log_names_planes_of_symmetry(tmp_path):
    points, cells = box("hexahedron")
    meshio.Mesh(points, [("hexahedron", cells)]).write(tmp_path / "box.vtu")
    data = {
        "title": "Box",
        "mesh": {"file": "box.vtu", "element": "3843"},
        "groups": {"left": {"plane": "x", "at": "min"}, "low": {"plane": "z", "at": "min"}},
        "material": {"law": "svk", "young": 1.0, "poisson": 0.3, "density": 1.0},
        "constraint": [{"group": "left", "fix": ["x"]}, {"group": "low", "fix": ["x", "y", "z"]}],
        "dynamics": {"duration": 1.0, "step": 0.1},
    }
    notes = make_plan(case_from_dict(data, tmp_path)).mesh.notes
    expected = (
        "left is taken as a plane of symmetry normal to x: the slope across it keeps its direction at 6 nodes"
    )
    assert [note for note in notes if "symmetry" in note] == [expected]
