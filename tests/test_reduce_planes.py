"""Half and quarter of symmetric scenes give the answer of the whole; what is not symmetric is refused with its reason."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from scene_bodies import CENTRE, INNER, OUTER, box_case, box_mesh, ring_case

from ancf_petsc import CaseError, run
from ancf_petsc.cli import main
from ancf_petsc.mesh.check import statistics
from ancf_petsc.plan.plan import make_plan
from ancf_petsc.reduce.caps import nested
from ancf_petsc.reduce.symmetry import MirrorPlane, SceneModel, mirror_planes, moments
from ancf_petsc.reduce.write import reduce, write_case

SAME = 1e-9
"""Of forces: the tolerance of equilibrium is 1e-10 of the largest."""


def smaller(case, to, folder):
    """The reduced case as read back, and its notes."""
    found = reduce(case, to)
    return write_case(found, folder)[0], found.notes


def force(case, folder, column="force"):
    return run(case, folder).curve[column]


EDGE = {"edge": {"plane": [0, 1, 1], "at": "max"}}
MIDDLE = {"nearest": [[1.0, 0.0, 3.0], [1.0, 1.0, 3.0], [0.0, 0.5, 3.0], [2.0, 0.5, 3.0], [1.0, 0.5, 3.0]]}
LOADS = {
    "pressed": {},
    "weight": {"load": [{"type": "gravity", "acceleration": [0.0, 0.0, -9.81]}]},
    "forces on a face, on a line across the plane and on points in the plane": {
        "groups": {"low": {"plane": "z", "at": "min"}, "high": {"plane": "z", "at": "max"}, "points": MIDDLE},
        "constraint": [{"group": "low", "fix": ["x", "y", "z"]}],
        "load": [
            {"type": "force", "group": "high", "total": [0.0, 0.0, -100.0], "ramp": "cosine"},
            {"type": "force", "group": "points", "total": [0.0, 0.0, 30.0]},
        ],
        "output": {"curve": {"force": "low.z", "stroke": "high.z"}},
    },
}


@pytest.mark.parametrize("more", LOADS.values(), ids=LOADS.keys())
def test_half_and_quarter_have_the_force_of_the_whole(tmp_path, more):
    """On a mesh that is its own mirror image, to what the equilibrium leaves."""
    whole = force(box_case(tmp_path, **more), tmp_path / "whole")
    assert np.abs(whole).max() > 10
    for to, part in (("half-x", 2), ("half-y", 2), ("quarter", 4)):
        case, _ = smaller(box_case(tmp_path, **more), to, tmp_path / to)
        assert len(make_plan(case).mesh.cells) == 32 // part
        np.testing.assert_allclose(
            force(case, tmp_path / f"run {to}"), whole, rtol=SAME, atol=SAME * abs(whole[-1])
        )


def test_half_of_a_half_is_the_quarter_and_slopes_are_carried_along(tmp_path):
    """Elements with slopes hold what the plane of symmetry asks for; 3843, one element through the width of the quarter."""
    box_mesh(tmp_path / "box.vtu", (2, 2, 2))
    whole = box_case(tmp_path, "3843", statics={"steps": 1})
    half, _ = smaller(whole, "half-x", tmp_path / "half")
    quarter, _ = smaller(half, "half-y", tmp_path / "quarter")
    assert quarter.spec.output.symmetry == 4
    assert quarter.spec.title == "Box, half, half"
    expected = force(whole, tmp_path / "whole")
    np.testing.assert_allclose(force(quarter, tmp_path / "run"), expected, rtol=1e-8)


def test_a_motion_too(tmp_path):
    """Initial velocity in the plane, weight, and the support's reaction over time."""
    more = {
        "statics": None,
        "constraint": [{"group": "low", "fix": ["x", "y", "z"]}],
        "load": [{"type": "gravity", "acceleration": [0.0, 0.0, -9.81]}],
        "initial": {"velocity": [0.0, 0.0, 0.2]},
        "dynamics": {"duration": 0.02, "step": 0.005, "outputs": 4},
        "output": {"curve": {"force": "low.z", "stroke": "high.z"}},
    }
    whole = box_case(tmp_path, **more)
    expected = force(whole, tmp_path / "whole")
    assert np.ptp(expected) > 1
    quarter, _ = smaller(whole, "quarter", tmp_path / "quarter")
    np.testing.assert_allclose(
        force(quarter, tmp_path / "run"), expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max()
    )


def test_a_group_on_one_side_keeps_its_force(tmp_path):
    """Pulled at both ends: half the bar has the same end force, and a note says that energies are those of the part."""
    case = box_case(
        tmp_path,
        groups={
            "left": {"plane": "x", "at": "min"},
            "right": {"plane": "x", "at": "max"},
            "base": {"plane": "z", "at": "min"},
        },
        constraint=[
            {"group": "left", "move": {"x": -0.1}, "fix": ["y", "z"]},
            {"group": "right", "move": {"x": 0.1}, "fix": ["y", "z"]},
        ],
        output={"curve": {"force": "left.x", "stroke": "left.x"}},
        probe=[{"name": "right", "group": "right"}, {"name": "base", "group": "base"}],
    )
    half, notes = smaller(case, "half-x", tmp_path / "half")
    assert half.spec.output.symmetry == 1
    assert make_plan(half).mesh.points[:, 0].max() == pytest.approx(1.0)
    np.testing.assert_allclose(force(half, tmp_path / "a"), force(case, tmp_path / "b"), rtol=SAME)
    assert [probe.name for probe in half.spec.probe] == ["base"]
    said = "\n".join(notes)
    assert "output.symmetry stays" in said
    assert "probe.right: nothing of right is in the part that is kept" in said


def test_the_force_of_a_line_in_the_plane_is_that_of_the_whole(tmp_path):
    """Half of such a line's reaction is in the half: three-point bending takes its force there."""
    case = box_case(
        tmp_path,
        groups={
            "low": {"plane": "z", "at": "min"},
            "line": {"box": [[0.99, -1.0, 2.99], [1.01, 2.0, 3.01]]},
        },
        constraint=[
            {"group": "low", "fix": ["x", "y", "z"]},
            {"group": "line", "fix": ["x", "y"], "move": {"z": -0.1}},
        ],
        statics={"steps": 1},
        output={"curve": {"force": "line.z", "stroke": "line.z"}},
    )
    half, notes = smaller(case, "half-x", tmp_path / "half")
    assert half.spec.output.symmetry == 2
    assert not any("output.symmetry" in note for note in notes)
    for column in ("force", "strain_energy", "low.rz"):
        whole = force(case, tmp_path / f"whole {column}", column)
        np.testing.assert_allclose(force(half, tmp_path / f"run {column}", column), whole, rtol=1e-7)


def test_a_cut_gives_sets_of_nodes_no_new_faces(tmp_path):
    """Nodes through the whole middle of the box carry a force as the faces and points of the whole body that they cover."""
    slab = {"box": [[0.5, 0.0, 1.0], [1.5, 1.0, 2.0]]}
    case = box_case(
        tmp_path,
        groups={"low": {"plane": "z", "at": "min"}, "slab": slab, "section": {"plane": "x", "at": 1.0}},
        constraint=[{"group": "low", "fix": ["x", "y", "z"]}],
        load=[{"type": "force", "group": "slab", "total": [0.0, 0.0, 40.0]}],
        probe=[{"name": "section", "group": "section"}],
        output={},
    )
    half, _ = smaller(case, "half-x", tmp_path / "half")
    whole, part = run(case, tmp_path / "a"), run(half, tmp_path / "b")
    np.testing.assert_allclose(part.probes["section.uz"], whole.probes["section.uz"], rtol=SAME)
    with pytest.raises(CaseError, match="points in the plane of symmetry carry a force.*'points of section'"):
        reduce(case.with_changes({"load.slab.group": "section"}), "half-x")


def test_several_materials_and_quadratic_tetrahedra(tmp_path):
    """A stiff middle; tetrahedra made of mirrored bricks, with their mid-nodes and groups."""
    points, cells = mirrored_tetrahedra()
    meshio.write(tmp_path / "box.vtu", meshio.Mesh(points, [("tetra", cells)]))
    stiff = {"box": [[0.5, 0.0, 0.0], [1.5, 1.0, 1.5]]}
    case = box_case(
        tmp_path,
        "3-10-1-3",
        groups={"low": {"plane": "z", "at": "min"}, "high": {"plane": "z", "at": "max"}, "stiff": stiff},
        material=[
            {"law": "svk", "young": 1e3, "poisson": 0.3},
            {"group": "stiff", "law": "svk", "young": 1e4, "poisson": 0.3},
        ],
        statics={"steps": 1},
    )
    half, _ = smaller(case, "half-x", tmp_path / "half")
    whole, part = make_plan(case), make_plan(half)
    assert np.bincount(part.material).tolist() == (np.bincount(whole.material) // 2).tolist()
    assert len(part.mesh.groups["high"].nodes) == 5 * 5
    np.testing.assert_allclose(force(half, tmp_path / "a"), force(case, tmp_path / "b"), rtol=SAME)


def mirrored_tetrahedra():
    """A box of 4 x 2 x 2 bricks of six tetrahedra, the right half the mirror image of the left."""
    from ancf_petsc.mesh.generate import bricks
    from ancf_petsc.mesh.kinds import KINDS, KUHN

    z, y, x = np.meshgrid(np.linspace(0, 3, 3), np.linspace(0, 1, 3), np.linspace(0, 1, 3), indexing="ij")
    points, cells = bricks(np.stack([x, y, z], axis=-1))
    cells = cells[:, np.array(KUHN)].reshape(-1, 4)
    image = points * [-1, 1, 1] + [2, 0, 0]
    both, where = np.unique(np.round(np.concatenate((points, image)), 9), axis=0, return_inverse=True)
    where = where.reshape(-1)
    mirrored = cells[:, KINDS["tetra"].mirrored] + len(points)
    return both, where[np.concatenate((cells, mirrored))]


# --- planes that go through elements


@pytest.mark.parametrize("axis", [0, 2])
def test_a_part_is_meshed_anew_where_the_plane_goes_through_elements(tmp_path, axis):
    """Its volume, faces and quality; quadratic elements give the force of the whole within what their meshes differ by."""
    case = ring_case(tmp_path, "3-10-1-3", axis, size=2.2)
    first, second = "xyz"[(axis + 1) % 3], "xyz"[(axis + 2) % 3]
    quarter, notes = smaller(case, "quarter", tmp_path / "quarter")
    assert any("meshed anew" in note for note in notes)
    whole, part = statistics(make_plan(case).mesh), statistics(make_plan(quarter).mesh)
    assert part.volume == pytest.approx(whole.volume / 4, rel=0.01)
    assert part.worst_quality > 0.2
    faces = {name: group.measures.get(2, 0.0) for name, group in part.groups.items()}
    assert faces["low"] == pytest.approx(whole.groups["low"].measures[2] / 4, rel=0.01)
    for name in (first, second):
        assert faces[f"symmetry_{name}"] == pytest.approx(
            (OUTER - INNER) * 10.0, rel=0.03
        )  # chords of the hole
    assert force(quarter, tmp_path / "a")[-1] == pytest.approx(force(case, tmp_path / "b")[-1], rel=0.02)


def test_regions_of_a_cut_with_holes():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    loops = [square * 4 + [1, 1], square * 10, square + [8, 8], square + [20, 0], square + [3, 3]]
    assert nested(loops) == [[1, 0, 2], [3], [4]]


# --- what is found, in any orientation


def test_planes_of_a_body_askew(tmp_path):
    """A box far from the origin, rotated about an odd axis, all its surface nodes held: three planes, none normal to an axis."""
    from scipy.spatial.transform import Rotation

    points = meshio.read(box_mesh(tmp_path / "plain.vtu"))
    rotation = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    moved = points.points @ rotation.T + [100.0, -20.0, 7.0]
    meshio.write(tmp_path / "box.vtu", meshio.Mesh(moved, points.cells))
    normal = rotation[:, 2].tolist()
    case = box_case(
        tmp_path,
        groups={"low": {"plane": normal, "at": "min"}, "high": {"plane": normal, "at": "max"}},
        constraint=[{"group": "low", "fix": ["x", "y", "z"]}],
        load=[{"type": "force", "group": "high", "total": (3.0 * rotation[:, 2]).tolist()}],
        output={},
    )
    scene = SceneModel(case, make_plan(case))
    assert scene.volume == pytest.approx(6.0)
    found = mirror_planes(scene)
    assert len(found) == 2
    across = np.abs(np.array([plane.normal for plane in found]) @ rotation)
    np.testing.assert_allclose(np.sort(across, axis=0)[::-1], [[1, 1, 0], [0, 0, 0]], atol=1e-6)
    assert all(plane.axis is None for plane in found)
    with pytest.raises(CaseError, match="not symmetric about x = .*no mirror image"):
        reduce(case, "half-x")


def test_a_small_notch_breaks_the_symmetry_of_a_ring(tmp_path):
    """Chords of a coarse mesh are no asymmetry; a notch of their size is."""
    case = ring_case(tmp_path, notch=1.0)
    scene = SceneModel(case, make_plan(case))
    planes = [MirrorPlane(np.array([*CENTRE, 6.0]), normal) for normal in np.eye(3)[:2]]
    assert "no mirror image" in scene.why_not(planes[0])
    assert scene.why_not(planes[1]) == ""


def test_moments_of_a_box(tmp_path):
    volume, centre, second = moments(make_plan(box_case(tmp_path)).mesh)
    assert volume == pytest.approx(6.0)
    np.testing.assert_allclose(centre, [1.0, 0.5, 1.5], rtol=1e-12)
    np.testing.assert_allclose(second, np.diag([4.0, 1.0, 9.0]) * 6.0 / 12, atol=1e-12)


# --- planes held along their normals


def pressed_between_slides(folder, angle, **more):
    """A cube on end, rotated about z by an angle: its sides slide in their planes, so that it is compressed uniformly."""
    points, cells = mirrored_tetrahedra()
    c, s = np.cos(angle), np.sin(angle)
    normals = {"a": [c, s, 0.0], "b": [-s, c, 0.0]}
    turned = (points * [0.5, 1.0, 1.0]) @ np.array([normals["a"], normals["b"], [0.0, 0.0, 1.0]])
    meshio.write(folder / "box.vtu", meshio.Mesh(turned, [("tetra", cells)]))
    ends = {"low": {"plane": "z", "at": "min"}, "high": {"plane": "z", "at": "max"}}
    sides = {
        f"{name}_{at}": {"plane": normal, "at": at}
        for name, normal in normals.items()
        for at in ("min", "max")
    }
    held = [{"group": name, "fix": ["normal"]} for name in sides]
    rows = [{"group": "low", "fix": ["normal"]}, {"group": "high", "move": {"z": -0.3}}, *held]
    return box_case(
        folder, "3413", **{"groups": ends | sides, "constraint": rows, "statics": {"steps": 1}, **more}
    )


def test_a_rotated_cube_held_along_its_normals_is_symmetric(tmp_path):
    """About its diagonals, which are normal to axes after 45 degrees; about its middle planes; uniform strain on any mesh."""
    case = pressed_between_slides(tmp_path, np.pi / 4)
    scene = SceneModel(case, make_plan(case))
    assert sum(plane.axis in (0, 1) for plane in mirror_planes(scene)) == 2
    assert len(mirror_planes(scene)) == 4
    quarter, _ = smaller(case, "quarter", tmp_path / "quarter")
    assert quarter.spec.output.symmetry == 4
    expected = force(case, tmp_path / "whole")
    assert abs(expected[-1]) > 10
    np.testing.assert_allclose(force(quarter, tmp_path / "run"), expected, rtol=1e-8)
    open_side = [{"group": name, "fix": ["normal"]} for name in ("low", "a_max", "b_min", "b_max")]
    rows = [*open_side, {"group": "high", "move": {"z": -0.3}}]
    with pytest.raises(CaseError, match="constraint.b_min: b_min at .* has no mirror image"):
        reduce(pressed_between_slides(tmp_path, np.pi / 4, constraint=rows), "half-x")
    with pytest.raises(CaseError, match="not symmetric about x"):
        reduce(pressed_between_slides(tmp_path, 0.4), "half-x")


# --- refusals

MOTION = {"duration": 1.0, "step": 0.1}
SIDEWAYS = [{"type": "gravity", "acceleration": [1.0, 0.0, 0.0]}]
REFUSED = {
    "gravity": ({"load": SIDEWAYS}, "half-x", r"about x = 1: load\.0: its direction \(1, 0, 0\) is not in the plane"),
    "force": (
        {"load": [{"type": "force", "group": "high", "total": [1.0, 0.0, 0.0]}], "constraint.high": None},
        "half-x",
        r"load\.0: what it does to high has no mirror image",
    ),
    "support": ({"constraint.low.group": "corner"}, "half-x", r"constraint\.corner: corner at .* has no mirror image"),
    "one plane only": ({"load": SIDEWAYS}, "quarter", "about x = 1: load.0.*about z = 1.5: constraint.low: low at"),
    "spin": (
        {"initial": {"spin": [1.0, 0.0, 0.0]}, "dynamics": MOTION, "statics": None, "constraint.high": None},
        "half-y",
        r"initial\.spin: its direction \(1, 0, 0\) is not normal to the plane",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("changes", "to", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_what_is_not_symmetric_is_refused_with_its_reason(tmp_path, changes, to, message):
    groups = {
        "low": {"plane": "z", "at": "min"},
        "high": {"plane": "z", "at": "max"},
        "corner": {"box": [[0, 0, 0], [0.5, 1, 0]]},
    }
    case = box_case(tmp_path, groups=groups, output={})
    # A constraint is removed with what refers to it: here nothing does.
    with pytest.raises(CaseError, match=message) as error:
        reduce(case.with_changes(changes), to)
    assert "\n" not in str(error.value)


def test_bricks_across_the_plane_and_plane_bodies_are_refused(tmp_path):
    box_mesh(tmp_path / "box.vtu", (3, 2, 2))
    with pytest.raises(CaseError, match="mesh.element: a plane of symmetry goes through elements"):
        reduce(box_case(tmp_path), "half-x")


def test_the_verb_writes_a_case_that_runs_and_overwrites_none(tmp_path, capsys, monkeypatch, project):
    monkeypatch.chdir(tmp_path)
    case = str(project / "cases" / "bar_tension" / "statics.toml")
    assert main(["reduce", case, "--to", "quarter"]) == 0
    assert "statics-quarter: 60 elements, 44 nodes" in capsys.readouterr().out
    assert main(["run", "statics-quarter", "--quiet"]) == 0
    assert main(["reduce", case, "--to", "quarter"]) == 2
    assert "case.toml is there already" in capsys.readouterr().err
    assert main(["reduce", str(project / "cases" / "pendulum" / "eight_2432.toml"), "--to", "half-x"]) == 2
    assert "only solids are reduced" in capsys.readouterr().err
