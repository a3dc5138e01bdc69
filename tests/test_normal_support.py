"""fix = ["normal"]: bodies held on planes of any orientation equal those held on planes of the axes, and wedges whole rings."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from mpi4py import MPI

from ancf_petsc import CaseError, case_from_dict, run
from ancf_petsc.analysis.build import build
from ancf_petsc.mesh.generate import bricks
from ancf_petsc.mesh.kinds import KUHN
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.drive import HELD, Drive
from ancf_petsc.model.mass import Mass
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.plan.plan import make_plan
from ancf_petsc.plan.supports.frames import Contradiction, Wanted, frame_of
from ancf_petsc.solve.modes import modes_at

WEIGHT = np.array([0.05, -0.08, -0.3])
LINEAR, COSINE = Ramp("linear"), Ramp("cosine")


def turn_of(seed):
    """A random rotation (3, 3)."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def eighth(code, turn, folder, *, fix="normal", **tables):
    """A block turned in space, kept on three planes through its corner, under its weight and a force on part of its far side."""
    sizes = [np.linspace(0, size, n + 1) for size, n in ((1.0, 2), (0.8, 2), (1.2, 3))]
    z, y, x = np.meshgrid(*sizes[::-1], indexing="ij")
    points, cells = bricks(np.stack((x, y, z), axis=-1))
    cells = cells[:, np.array(KUHN)].reshape(-1, 4)
    path = folder / f"block_{abs(turn[0, 0]):.6f}.vtu"
    meshio.Mesh(points @ turn.T, [("tetra", cells)]).write(path)
    planes = {f"plane_{axis}": {"plane": turn[:, i].tolist(), "at": "min"} for i, axis in enumerate("xyz")}
    far = np.flatnonzero((points[:, 2] > 1.19) & (points[:, 0] < 0.6))
    return {
        "title": "Eighth of a block",
        "mesh": {"file": str(path), "element": code},
        "groups": planes | {"far": {"nearest": (points[far] @ turn.T).tolist()}},
        "material": {"law": "neo_hooke", "young": 2.0, "poisson": 0.3, "density": 1.3},
        "constraint": [
            {"group": f"plane_{axis}", "fix": ["normal"] if fix == "normal" else [axis]} for axis in "xyz"
        ],
        "load": [
            {"type": "gravity", "acceleration": (turn @ WEIGHT).tolist()},
            {"type": "force", "group": "far", "total": (turn @ [0.0, 0.02, -0.05]).tolist()},
        ],
        **({} if "dynamics" in tables else {"statics": {"steps": 2, "tolerance": 1e-12}}),
        "probe": [{"name": "far", "group": "far"}],
        **tables,
    }


def solved(data, folder, name):
    return run(case_from_dict(data, folder), folder / name)


def assert_turned(found, wanted, turn, tolerance):
    """Fields, reactions and energies of a body that is turned are those of the other, turned."""
    for name in [name for name in wanted.node_fields if name != "slopes"]:
        turned = wanted.field(name) @ turn.T
        np.testing.assert_allclose(found.field(name), turned, rtol=0, atol=tolerance * np.abs(turned).max())
    for axis in "xyz":
        reaction = [np.array([of.curve[f"plane_{axis}.r{i}"][-1] for i in "xyz"]) for of in (found, wanted)]
        np.testing.assert_allclose(reaction[0], turn @ reaction[1], rtol=0, atol=10 * tolerance)
    for column in ("strain_energy", "external_work"):
        assert found.curve[column][-1] == pytest.approx(wanted.curve[column][-1], rel=10 * tolerance)
    moved = [np.array([of.probes[f"far.u{i}"][-1] for i in "xyz"]) for of in (found, wanted)]
    np.testing.assert_allclose(moved[0], turn @ moved[1], rtol=0, atol=tolerance)


@pytest.mark.parametrize("code", ["3413", "3-10-1-3"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_turned_block_at_rest_is_the_block_turned(code, seed, tmp_path):
    """Faces, edges and the corner where one, two and three planes meet."""
    turn = turn_of(seed)
    wanted = solved(eighth(code, np.eye(3), tmp_path, fix="axes"), tmp_path, "along")
    found = solved(eighth(code, turn, tmp_path), tmp_path, "turned")
    assert np.abs(wanted.field("displacement")).max() > 0.05
    assert_turned(found, wanted, turn, 1e-9)


def test_iterative_solvers_find_the_same(tmp_path):
    """Conjugate gradients on half of the matrix with two levels, and multigrid with its rigid motions."""
    turn = turn_of(4)
    wanted = solved(eighth("3413", np.eye(3), tmp_path, fix="axes"), tmp_path, "along")
    for name, options in {
        "multigrid": {"ksp_type": "cg", "pc_type": "gamg", "ksp_rtol": 1e-10},
        "jacobi": {"ksp_type": "cg", "pc_type": "bjacobi", "ksp_rtol": 1e-10},
    }.items():
        found = solved(eighth("3413", turn, tmp_path, petsc=options), tmp_path, name)
        assert_turned(found, wanted, turn, 1e-9)


MOTIONS = {
    "generalized_alpha": {"step": 0.05},
    "energy_momentum": {"step": 0.05},
    "theta": {"step": 0.05},
    "rosenbrock": {"step": 0.05},
    "bdf": {"step": 0.05},
    "runge_kutta_5dp": {"tolerance": 1e-10},
    "central_difference": {"step": 0.01},
}


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_a_turned_block_in_motion_is_the_block_turned(name, mass, tmp_path):
    """Every kind of integrator, each of them with both masses; the equations are solved to 1e-8 of a step or better."""
    turn, dynamics = (
        turn_of(5),
        {"duration": 0.4, "outputs": 2, "integrator": name, "mass": mass, **MOTIONS[name]},
    )
    initial = {"velocity": [0.0, 0.0, 0.2]}
    data = eighth("3413", np.eye(3), tmp_path, fix="axes", dynamics=dynamics, initial=initial)
    wanted = solved(data, tmp_path, "along")
    initial = {"velocity": (turn @ [0.0, 0.0, 0.2]).tolist()}
    found = solved(eighth("3413", turn, tmp_path, dynamics=dynamics, initial=initial), tmp_path, "turned")
    assert_turned(found, wanted, turn, 2e-7 if "tolerance" in MOTIONS[name] else 1e-8)
    for column in ("kinetic_energy", "energy_drift"):
        assert found.curve[column][-1] == pytest.approx(wanted.curve[column][-1], abs=1e-8)
    momentum = [np.array([of.curve[f"angular_momentum.{i}"][-1] for i in "xyz"]) for of in (found, wanted)]
    np.testing.assert_allclose(momentum[0], turn @ momentum[1], rtol=0, atol=1e-7)


def test_modes_of_a_turned_block_are_those_of_the_block(tmp_path):
    found = []
    for turn, fix in ((np.eye(3), "axes"), (turn_of(6), "normal")):
        assembly = Assembly(
            build(case_from_dict(eighth("3413", turn, tmp_path, fix=fix), tmp_path), MPI.COMM_SELF).model
        )
        found.append(modes_at(assembly, Mass(assembly), assembly.reference_vector(), 5).omega_squared)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


def test_a_plane_across_an_axis_is_held_as_that_axis(tmp_path):
    plans = [
        make_plan(case_from_dict(eighth("3413", np.eye(3), tmp_path, fix=fix), tmp_path))
        for fix in ("axes", "normal")
    ]
    np.testing.assert_array_equal(plans[0].supports.drive, plans[1].supports.drive)
    assert not len(plans[1].supports.axes)


# --- wedges


def written(points, cells, path):
    """Tetrahedra on points without duplicates, all of positive volume."""
    places, index = np.unique(np.round(points, 12), axis=0, return_inverse=True)
    cells = index.ravel()[cells]
    edges = places[cells[:, 1:]] - places[cells[:, :1]]
    flat = np.linalg.det(edges) < 0
    cells[flat] = cells[flat][:, [0, 2, 1, 3]]
    meshio.Mesh(places, [("tetra", cells)]).write(path)
    return path


def mirrored(points, cells, normal):
    """A body and its image in the plane through the origin."""
    image = points - 2 * np.outer(points @ normal, normal)
    return np.concatenate((points, image)), np.concatenate((cells, cells + len(points)))


def pressed(path, code, sides, folder, name):
    """Both ends bonded and pressed towards each other; sides: plane and how it is held."""
    groups = {"bottom": {"plane": "z", "at": "min"}, "top": {"plane": "z", "at": "max"}}
    groups |= {f"side{k}": {"plane": plane, "at": 0.0} for k, (plane, _) in enumerate(sides)}
    data = {
        "title": "Wedge",
        "mesh": {"file": str(path), "element": code},
        "groups": groups,
        "material": {"law": "neo_hooke", "young": 2.0, "poisson": 0.35, "density": 1.0},
        "constraint": [
            {"group": "bottom", "fix": ["x", "y", "z"]},
            {"group": "top", "fix": ["x", "y"], "move": {"z": -0.06}},
            *({"group": f"side{k}", "fix": fix} for k, (_, fix) in enumerate(sides)),
        ],
        "statics": {"steps": 1, "tolerance": 1e-12},
        "output": {"curve": {"force": "top.z", "stroke": "top.z"}},
    }
    return solved(data, folder, name).curve["force"][-1]


@pytest.mark.parametrize("code", ["3413", "3-10-1-3"])
def test_a_wedge_of_30_degrees_is_a_third_of_a_quarter(code, tmp_path):
    """The quarter of its images: bonded ends, where three axes and the normal agree, and planes through the axis."""
    angle, r, z = np.linspace(0, np.pi / 6, 2), np.linspace(0.5, 1, 3), np.linspace(0, 0.6, 4)
    z, angle, r = np.meshgrid(z, angle, r, indexing="ij")
    points, cells = bricks(np.stack((r * np.cos(angle), r * np.sin(angle), z), axis=-1))
    cells = cells[:, np.array(KUHN)].reshape(-1, 4)
    normal = np.array([np.sin(np.pi / 6), -np.cos(np.pi / 6), 0.0])
    wedge = written(points, cells, tmp_path / "wedge.vtu")
    sides = [("y", ["normal"]), (normal.tolist(), ["normal"])]
    force = pressed(wedge, code, sides, tmp_path, "wedge")
    two = mirrored(points, cells, normal)
    third = points @ np.array([[0.5, np.sqrt(0.75), 0.0], [-np.sqrt(0.75), 0.5, 0.0], [0.0, 0.0, 1.0]])
    every = np.concatenate((two[0], third)), np.concatenate((two[1], cells + len(two[0])))
    quarter = written(*every, tmp_path / "quarter.vtu")
    whole = pressed(quarter, code, [("y", ["y"]), ("x", ["x"])], tmp_path, "quarter")
    assert 3 * force == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize("code", ["3413", "3-10-1-3"])
def test_a_wedge_down_to_its_axis(code, tmp_path):
    """Half of a square pillar, cut along its diagonal: planes at 45 degrees meet at the axis, whose nodes move along it alone."""
    x, y, z = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4), np.linspace(0, 0.6, 4), indexing="ij")
    points, cells = bricks(np.stack((x, y, z), axis=-1).transpose(2, 1, 0, 3))
    cells = cells[:, np.array(KUHN)].reshape(-1, 4)
    diagonal = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    inside = (points[cells] @ diagonal > -1e-9).all(axis=1)
    half = written(points, cells[inside], tmp_path / "half.vtu")
    whole = written(*mirrored(points, cells[inside], diagonal), tmp_path / "whole.vtu")
    sides = [("y", ["y"]), (diagonal.tolist(), ["normal"])]
    force = pressed(half, code, sides, tmp_path, "half")
    wanted = pressed(whole, code, [("y", ["y"]), ("x", ["x"])], tmp_path, "whole")
    assert 2 * force == pytest.approx(wanted, rel=1e-9)


# --- frames of nodes

SLANT = np.array([0.6, 0.8, 0.0])


def wanted(direction, drive=HELD, name="group"):
    return Wanted(np.array(direction, float), drive, name)


def test_directions_that_are_prescribed_are_components_of_the_frame():
    frame = frame_of([wanted([0, 0, 1], Drive(0.1, LINEAR)), wanted(SLANT)])
    np.testing.assert_allclose(frame.axes.T @ frame.axes, np.eye(3), atol=1e-15)
    np.testing.assert_array_equal(frame.axes[:, 2], [0, 0, 1])
    np.testing.assert_allclose(frame.axes[:, 1], SLANT, atol=1e-15)
    assert frame.drives == (None, HELD, Drive(0.1, LINEAR))


def test_a_slanted_plane_turns_the_motion_of_an_axis_into_one_across():
    """u_x = a on the plane 0.6 x + 0.8 y = 0 needs u_y = - 0.75 a."""
    frame = frame_of([wanted([1, 0, 0], Drive(0.4, COSINE)), wanted(SLANT)])
    across = frame.drives[1]
    assert frame.axes[:, 0].tolist() == [1.0, 0.0, 0.0]
    assert (frame.axes[:, 1] * across.amplitude).tolist() == pytest.approx([0.0, -0.3, 0.0])
    assert across.ramp == COSINE
    assert frame.drives[2] is None


@pytest.mark.parametrize(
    "rest",
    [
        [wanted([1, 0, 0]), wanted([0, 1, 0])],
        [wanted([1, 0, 0], Drive(0.4, COSINE)), wanted([0, 1, 0], Drive(-0.3, COSINE)), wanted([0, 0, 1])],
    ],
)
def test_axes_that_say_all_need_no_frame(rest):
    assert frame_of([*rest, wanted(SLANT)]).is_global


@pytest.mark.parametrize(
    ("rest", "why"),
    [
        (
            [wanted([1, 0, 0], Drive(0.4, COSINE)), wanted([0, 1, 0])],
            "other supports move these nodes along it",
        ),
        (
            [wanted([1, 0, 0], Drive(0.4, COSINE)), wanted([0, 0, 1], Drive(0.1, LINEAR))],
            "two ramps would move these nodes across each other",
        ),
    ],
)
def test_what_cannot_be_had_is_a_contradiction(rest, why):
    slanted = np.array([0.6, 0.64, 0.48])
    with pytest.raises(Contradiction, match=why):
        frame_of([*rest, wanted(SLANT if why.startswith("other") else slanted)])


# --- what is refused


def refused(data, folder):
    with pytest.raises(CaseError) as caught:
        make_plan(case_from_dict(data, folder))
    return str(caught.value)


def test_groups_that_are_not_plane_are_refused(tmp_path):
    turn = turn_of(1)
    data = eighth("3413", turn, tmp_path)
    data["groups"]["bent"] = {"union": ["plane_x", "plane_y"]}
    data["constraint"].append({"group": "bent", "fix": ["normal"]})
    message = refused(data, tmp_path)
    assert (
        "constraint.bent.fix: the group is not plane: its nodes leave the nearest plane by up to 0."
        in message
    )
    assert "expected less than 2.54e-06, 1e-06 of the mesh's size" in message
    data["groups"]["bent"] = {"nearest": [[0.0, 0.0, 0.0]]}
    assert "the group's 1 nodes lie on a line or at a point: they span no plane" in refused(data, tmp_path)


def test_supports_that_contradict_each_other_are_named(tmp_path):
    data = eighth("3413", turn_of(2), tmp_path)
    data["constraint"].append({"group": "plane_x", "move": {"x": 0.1}})
    message = refused(data, tmp_path)
    assert "constraint.plane_" in message
    assert "contradicts 'plane_x'" in message
    assert "the first is node" in message


def test_elements_with_slopes_need_planes_of_the_axes(tmp_path):
    message = refused(eighth("3443", turn_of(1), tmp_path), tmp_path)
    assert (
        "constraint.plane_x.fix: element 3443 has slopes, and the group's plane the normal (-0.238138"
        in message
    )
    make_plan(case_from_dict(eighth("3443", np.eye(3), tmp_path), tmp_path))


def test_a_free_motion_along_an_oblique_plane_is_found(tmp_path):
    turn = turn_of(3)
    data = eighth("3413", turn, tmp_path)
    del data["constraint"][2]
    message = refused(data, tmp_path)
    along = turn[:, 2] * np.sign(turn[np.argmax(np.abs(turn[:, 2])), 2])
    assert f"translation along ({', '.join(f'{c:.3f}' for c in along)})" in message
    data["constraint"].append({"group": "far", "fix": ["x"]})
    assert "rigid motions free" not in _planned(data, tmp_path)


def _planned(data, folder):
    try:
        make_plan(case_from_dict(data, folder))
    except CaseError as error:
        return str(error)
    return ""
