"""Bodies of revolution and prisms are recognised as wholes and as sectors, in any place and direction; so is what is none."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from scene_bodies import CENTRE, INNER, OUTER, box_case, box_mesh, ring_case, ring_mesh

from ancf_petsc import CaseError, case_from_dict, load_case, run
from ancf_petsc.cli import main
from ancf_petsc.mesh.gmsh_session import gmsh_session
from ancf_petsc.mesh.kinds import KINDS, part_sizes, qualities
from ancf_petsc.plan.plan import make_plan
from ancf_petsc.reduce.prism import prism_of
from ancf_petsc.reduce.profile import profile_of
from ancf_petsc.reduce.profile_lines import simplified, traced
from ancf_petsc.reduce.profile_mesh import meshed
from ancf_petsc.reduce.revolution import Ring, ring_of
from ancf_petsc.reduce.symmetry import SceneModel
from ancf_petsc.reduce.write import reduce, write_case


def scene_of(case):
    return SceneModel(case, make_plan(case))


def area_of(mesh):
    return float(np.abs(part_sizes(mesh.points, mesh.cells, KINDS["triangle"])).sum())


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_whole_ring_and_its_section(tmp_path, axis):
    """The axis to chords, the profile to rounding: nodes lie on the body, and chords around it are chords of angle."""
    scene = scene_of(ring_case(tmp_path, axis=axis))
    ring, why = ring_of(scene)
    assert why == ""
    assert ring.is_whole
    assert ring.axis.tolist() == np.eye(3)[axis].tolist()
    expected = np.roll([*CENTRE, 6.0], axis - 2)
    np.testing.assert_allclose(ring.point, expected, atol=1e-5)  # the nodes of the outer circle are exact
    profile = simplified(profile_of(scene, ring))
    assert len(profile.points) == 4
    low, high = profile.points.min(axis=0), profile.points.max(axis=0)
    np.testing.assert_allclose([low, high], [[INNER, 1.0], [OUTER, 11.0]], atol=1e-5)
    mesh = meshed(profile, 0, 2, 2.0)
    assert area_of(mesh) == pytest.approx((OUTER - INNER) * 10.0, rel=5e-3)
    assert qualities(mesh.points, mesh.cells, KINDS["triangle"]).min() > 0.4
    for name, level in (("low", 1.0), ("high", 11.0)):
        group = mesh.groups[name]
        assert np.ptp(mesh.points[group.nodes, 2]) < 1e-12
        assert mesh.points[group.nodes[0], 2] == pytest.approx(level)
        assert len(group.parts[1]) == len(group.nodes) - 1


def test_the_quarter_of_the_block_is_a_sector_of_a_ring(project):
    scene = scene_of(load_case(project / "cases" / "pvc_block"))
    ring, _ = ring_of(scene)
    assert ring.angle == pytest.approx(np.pi / 2)
    assert set(ring.walls) == {"constraint.symmetry_x", "constraint.symmetry_y"}
    np.testing.assert_allclose(ring.point[:2], 0, atol=1e-15)
    corners = {tuple(np.round(p, 9)) for p in simplified(profile_of(scene, ring)).points.tolist()}
    groove = {
        (0.025, 0.0),
        (0.095, 0.0),
        (0.095, 0.04),
        (0.07, 0.05),
        (0.095, 0.06),
        (0.095, 0.1),
        (0.025, 0.1),
    }
    assert corners == groove


def test_a_half_between_its_plane_of_symmetry(tmp_path):
    half, _ = write_case(reduce(ring_case(tmp_path, size=2.2), "half-x"), tmp_path / "half")
    ring, why = ring_of(scene_of(half))
    assert why == ""
    assert ring.angle == np.pi
    assert ring.walls == ("constraint.symmetry_x",)


def test_a_disc_and_a_hollow_sphere_have_sections_that_end_on_the_axis(tmp_path):
    """A disc without a hole; a sphere of radius 5 with a hole of radius 2 inside it, held on its outer surface."""
    scene = scene_of(ring_case(tmp_path, hollow=0.0))
    ring, _ = ring_of(scene)
    mesh = meshed(simplified(profile_of(scene, ring)), 0, 2, 2.5)
    assert area_of(mesh) == pytest.approx(OUTER * 10.0, rel=5e-3)
    assert mesh.points[:, 0].min() == pytest.approx(0.0, abs=1e-12)
    path = tmp_path / "sphere.msh"
    with gmsh_session(
        **{"Mesh.MeshSizeMax": 1.6, "Mesh.MeshSizeMin": 1.6, "Mesh.MshFileVersion": 2.2}
    ) as gmsh:
        occ = gmsh.model.occ
        occ.cut([(3, occ.addSphere(1, 2, 3, 5))], [(3, occ.addSphere(1, 2, 3, 2))])
        occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], 1, "body")
        gmsh.model.addPhysicalGroup(2, [gmsh.model.getEntities(2)[0][1]], 2, "skin")
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    case = case_from_dict(
        {
            "title": "Sphere",
            "mesh": {"file": str(path), "element": "3413"},
            "material": {"law": "svk", "young": 1.0, "poisson": 0.3, "density": 1.0},
            "constraint": [{"group": "skin", "fix": ["x", "y", "z"]}],
            "load": [{"type": "gravity", "acceleration": [0.0, -1.0, 0.0]}],
            "statics": {"steps": 1},
        },
        tmp_path,
    )
    scene = scene_of(case)
    ring, why = ring_of(scene)
    assert why == ""
    assert ring.axis.tolist() == [0.0, 1.0, 0.0]
    profile = simplified(profile_of(scene, ring))
    assert len(traced(profile)) == 1
    mesh = meshed(profile, 0, 1, None)
    assert area_of(mesh) == pytest.approx(np.pi / 2 * (5**2 - 2**2), rel=0.05)
    assert "skin" in mesh.groups


def test_the_section_has_the_force_of_the_ring_and_of_its_half(tmp_path):
    """Within what two coarse meshes of quadratic elements differ by; sectors keep their angle, so that symmetry stays."""
    whole = ring_case(tmp_path, "3-10-1-3", axis=1, size=2.2)
    half, _ = write_case(reduce(whole, "half-z"), tmp_path / "half")
    expected = run(whole, tmp_path / "whole").curve["force"][-1]
    for number, case in enumerate((whole, half)):
        folder = tmp_path / f"section {number}"
        section, plan = write_case(reduce(case, "section", 1.5), folder)
        assert section.spec.mesh.element == "2-6-1-2"
        assert section.spec.section.axis == "y"
        assert section.spec.section.angle == (180.0 if number else None)
        assert section.spec.output.symmetry == (2 if number else 1)
        assert len(plan.mesh.cells) < 100
        assert run(section, tmp_path / f"run {number}").curve["force"][-1] == pytest.approx(
            expected, rel=0.02
        )
        narrow, _ = write_case(reduce(case, "wedge"), tmp_path / f"wedge {number}")
        assert narrow.spec.output.symmetry == 72
        assert narrow.spec.mesh.element == "3-10-1-3"
        assert run(narrow, tmp_path / f"run wedge {number}").curve["force"][-1] == pytest.approx(
            expected, rel=0.02
        )


# --- wedges


def sections_of(case):
    """The area of its section and the lines of its groups."""
    return reduce(case, "section").mesh


@pytest.mark.parametrize(("angle", "hollow"), [(2.0, INNER), (90.0, INNER), (35.0, 0.0)])
def test_a_wedge_is_swept_without_gaps(tmp_path, angle, hollow):
    """Faces that neighbours divide differently would be two: the Euler characteristic of a ball is 1. Its volume is Pappus's."""
    case = ring_case(tmp_path, axis=0, size=2.5, hollow=hollow)
    section, mesh = sections_of(case), reduce(case, "wedge", angle=angle).mesh
    tetra = KINDS["tetra"]
    parts = [
        np.unique(np.sort(mesh.cells[:, np.array(rows)].reshape(-1, len(rows[0])), axis=1), axis=0)
        for rows in (tetra.edges, tetra.sides)
    ]
    assert len(np.unique(mesh.cells)) - len(parts[0]) + len(parts[1]) - len(mesh.cells) == 1
    sizes = part_sizes(mesh.points, mesh.cells, tetra)
    assert sizes.min() > 0
    areas = np.abs(part_sizes(section.points, section.cells, KINDS["triangle"]))
    radius = section.points[section.cells][..., 1].mean(axis=1)
    layers = np.ceil(angle / 5.0)
    least, most = layers * np.sin(np.radians(angle) / layers), np.radians(angle)
    assert least * (1 - 1e-9) <= sizes.sum() / (areas @ radius) <= most
    for name in ("symmetry_1", "symmetry_2"):
        rows = mesh.groups[name].parts[2]
        assert part_sizes(mesh.points, rows, KINDS["triangle"]).sum() == pytest.approx(areas.sum())
    plane = [mesh.points[mesh.groups[name].nodes] for name in ("symmetry_1", "symmetry_2")]
    normals = [np.linalg.svd(points - points.mean(axis=0))[2][2] for points in plane]
    between = np.degrees(np.arccos(np.clip(abs(normals[0] @ normals[1]), 0, 1)))
    assert between == pytest.approx(angle, abs=1e-5)
    ends = part_sizes(mesh.points, mesh.groups["low"].parts[2], KINDS["triangle"]).sum()
    assert ends == pytest.approx(np.radians(angle) / 2 * (OUTER**2 - hollow**2), rel=0.02)


def test_a_wedge_of_a_ring_askew_with_loads(tmp_path):
    """About an axis that is none of the three: reactions to a force and weight are the whole's, and so is the way of the top."""
    rotation = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    axis = rotation[:, 2]
    changes = {
        "constraint.high": None,
        "constraint.low.fix": ["x", "y", "z"],
        "material.density": 2e-3,
        "load": [
            {"type": "force", "group": "high", "total": (-60.0 * axis).tolist()},
            {"type": "gravity", "acceleration": (-9.81 * axis).tolist()},
        ],
        "probe": [{"name": "top", "group": "high", "mean": "area"}],
        "output.curve": None,
    }
    case = ring_case(tmp_path, "3-10-1-3", rotation=rotation).with_changes(changes)
    wedge, _ = write_case(reduce(case, "wedge", angle=10.0), tmp_path / "wedge")
    assert wedge.spec.output.symmetry == 36
    found, wanted = run(wedge, tmp_path / "a"), run(case, tmp_path / "b")

    def along(values, name):
        return sum(values[f"{name}{i}"][-1] * part for i, part in zip("xyz", axis, strict=True))

    # The wedge's chords leave out 0.13 % of the weight.
    assert along(found.curve, "low.r") == pytest.approx(60.0 + 9.81 * 2e-3 * np.pi * 550, rel=2e-3)
    assert along(found.probes, "top.u") == pytest.approx(along(wanted.probes, "top.u"), rel=0.03)
    ring, why = ring_of(scene_of(wedge))
    assert why == ""
    assert np.degrees(ring.angle) == pytest.approx(10.0)
    np.testing.assert_allclose(np.abs(ring.axis @ axis), 1.0, rtol=1e-12)
    narrower = reduce(wedge, "wedge", angle=4.0)
    assert narrower.data["output"]["symmetry"] == pytest.approx(90.0)
    assert sum("normal" in row["fix"] for row in narrower.data["constraint"]) == 2
    total = narrower.data["load"][0]["total"]
    np.testing.assert_allclose(total, -60.0 * axis / 90)


def test_the_verb_makes_a_wedge_that_runs_alike_on_two_ranks(tmp_path, ancf, capsys):
    (tmp_path / "case.toml").write_text(ring_case(tmp_path, hollow=0.0).text)
    words = ["--to", "wedge", "--angle", "20", "--size", "3", "--out", str(tmp_path / "wedge")]
    assert main(["reduce", str(tmp_path), *words]) == 0
    assert "elements" in capsys.readouterr().out
    ancf("run", "wedge", "--quiet", "--out", "two", ranks=2)
    one = run(load_case(tmp_path / "wedge"), tmp_path / "one").curve["force"]
    two = np.genfromtxt(tmp_path / "two" / "curve.csv", delimiter=",", names=True)["force"]
    np.testing.assert_allclose(two, one, rtol=1e-8)


@pytest.mark.parametrize("angle", [0.0, -5.0, 90.5, float("nan"), float("inf")])
def test_angles_that_are_none_of_a_wedge(tmp_path, angle):
    with pytest.raises(
        CaseError, match="--angle: the wedge is no part of .* expected degrees above 0 and up to 90"
    ):
        reduce(ring_case(tmp_path), "wedge", angle=angle)


def test_what_no_wedge_can_be_made_of(tmp_path):
    case = ring_case(tmp_path, hollow=0.0)
    with pytest.raises(CaseError, match="--angle: only a wedge has an angle"):
        reduce(case, "section", angle=5.0)
    points = make_plan(case).mesh.points
    tip = points[np.linalg.norm(points - [*CENTRE, 11.0], axis=1).argmin()]
    rows = [
        {"group": "low", "fix": ["x", "y", "z"]},
        {"group": "tip", "fix": ["x", "y"], "move": {"z": -0.5}},
    ]
    changes = {"groups": {"tip": {"nearest": tip.tolist()}}, "constraint": rows, "output.curve": None}
    held = case.with_changes(changes)
    for to in ("section", "wedge"):
        with pytest.raises(CaseError, match="tip"):
            reduce(held, to)
    with pytest.raises(CaseError, match="not one of revolution about"):
        reduce(box_case(tmp_path), "wedge")


def test_rotating_mirrors_what_leaves_a_sector():
    ring = Ring(
        np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), np.pi / 2, ("a", "b")
    )
    radius, angle, height = ring.coordinates(ring.rotated(np.array([[1.0, 2.0, 5.0], [3.0, 0.0, 5.0]]), 0.5))
    np.testing.assert_allclose(radius, 2.0)
    np.testing.assert_allclose(angle, np.pi / 4)
    np.testing.assert_allclose(height, 5.0)


SIDEWAYS = [{"type": "force", "group": "high", "total": [1.0, 0.0, 0.0]}]
WRONG = {
    "a force across": ({"load": SIDEWAYS}, r"load\.0: what it does to high is not along"),
    "weight across": (
        {"load": [{"type": "gravity", "acceleration": [0.0, 1.0, 0.0]}], "material.density": 1.0},
        r"load\.0: \(0, 1, 0\) is not along the axis",
    ),
    "one component": ({"constraint.low.fix": ["x", "z"]}, r"constraint\.low: components held on low differ around"),
    "a patch": (
        {"groups": {"patch": {"box": [[-10, -10, 0], [3, 20, 2]]}}, "constraint.low.group": "patch"},
        r"constraint\.patch: patch at .* rotated by .* lies off by",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), WRONG.values(), ids=WRONG.keys())
def test_what_differs_around_the_axis_is_refused_with_its_reason(tmp_path, changes, message):
    case = ring_case(tmp_path).with_changes({"output.curve": None, **changes})
    with pytest.raises(CaseError, match=f"not one of revolution about the axis through .*{message}") as error:
        reduce(case, "section")
    assert "\n" not in str(error.value)


def test_a_notch_or_a_square_is_no_ring(tmp_path):
    ring_mesh(tmp_path / "ring.msh", notch=1.5)
    case = ring_case(tmp_path, notch=1.5)
    assert ring_of(scene_of(case))[0] is None
    assert ring_of(scene_of(box_case(tmp_path)))[0] is None


# --- prisms


def test_a_prism_between_planes_of_symmetry(tmp_path):
    """Held along y at both ends; with one end free, or a load along y, it is none."""
    ends = {
        "front": {"plane": "y", "at": "min"},
        "back": {"plane": "y", "at": "max"},
        "low": {"plane": "z", "at": "min"},
        "high": {"plane": "z", "at": "max"},
    }
    rows = [
        {"group": "front", "fix": ["y"]},
        {"group": "back", "fix": ["y"]},
        {"group": "low", "fix": ["x", "z"]},
        {"group": "high", "fix": ["x"], "move": {"z": -0.3}},
    ]
    case = box_case(tmp_path, groups=ends, constraint=rows)
    assert prism_of(scene_of(case)) == (1, 1.0)
    assert prism_of(scene_of(box_case(tmp_path, groups=ends, constraint=rows[1:]))) is None
    weight = [{"type": "gravity", "acceleration": [0.0, 1.0, 0.0]}]
    assert prism_of(scene_of(box_case(tmp_path, groups=ends, constraint=rows, load=weight))) is None
    patch = {**ends, "high": {"box": [[0, 0, 3], [2, 0.5, 3]]}}
    assert prism_of(scene_of(box_case(tmp_path, groups=patch, constraint=rows))) is None
    points = meshio.read(box_mesh(tmp_path / "plain.vtu"))
    tapered = points.points * np.column_stack(
        (1 + 0.1 * points.points[:, 1], *np.ones((2, len(points.points))))
    )
    meshio.write(tmp_path / "box.vtu", meshio.Mesh(tapered, [("tetra", tetrahedra_of(points.cells[0].data))]))
    assert prism_of(scene_of(box_case(tmp_path, "3413", groups=ends, constraint=rows))) is None


def tetrahedra_of(bricks):
    from ancf_petsc.mesh.kinds import KUHN

    return bricks[:, np.array(KUHN)].reshape(-1, 4)
