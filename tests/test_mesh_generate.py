"""The project's meshes, against the shipped ones and against geometry."""

import numpy as np
import pytest

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.bodies import BODIES
from ancf_petsc.mesh.check import statistics
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.mesh.groups import boundary_faces
from ancf_petsc.mesh.read import read_mesh

SOLIDS = ("tetra", "tetra10", "hexahedron")


def as_sets(mesh):
    """Cells, and parts of each group, as sets of sets of positions; free of any numbering."""
    places = [tuple(place) for place in np.round(mesh.points, 12) + 0.0]
    found = {"cells": {frozenset(places[node] for node in cell) for cell in mesh.cells}}
    for name, group in mesh.groups.items():
        for dimension, parts in group.parts.items():
            found[name, dimension] = {frozenset(places[node] for node in row) for row in parts}
    return found


@pytest.mark.parametrize(
    ("shipped", "name", "options"),
    [
        ("bar_2x2x10", "bar", {"divisions": (2, 2, 10)}),
        ("bar_2x2x20", "bar", {"divisions": (2, 2, 20), "version": "4.1"}),
        ("pendulum_96", "pendulum", {"divisions": (4, 2, 2)}),
        ("pendulum_96_vertical", "pendulum_vertical", {"divisions": (2, 2, 4)}),
        ("ellipsograph_78", "ellipsograph", {"divisions": (13, 1, 1)}),
    ],
)
def test_bricks_give_the_shipped_meshes(tmp_path, project, shipped, name, options):
    ours = as_sets(read_mesh(make_mesh(name, tmp_path / "m.msh", **options), ("tetra",)))
    assert ours == as_sets(read_mesh(project / "meshes" / f"{shipped}.msh", ("tetra",)))


SHIPPED = {
    "pvc_block_234": (234, 816, {"bottom": 48, "top": 48, "symmetry_x": 34, "symmetry_y": 34}),
    "cube_m2": (2202, 9670, {"bottom": 246, "top": 248, "symmetry_x": 480, "symmetry_y": 484}),
}


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_meshes_have_the_sizes_their_page_tells(project, name):
    nodes, cells, faces = SHIPPED[name]
    found = statistics(read_mesh(project / "meshes" / f"{name}.msh", ("tetra",)))
    assert (found.nodes, found.cells, found.unused_nodes, found.pieces) == (nodes, cells, 0, 1)
    assert {group: found.groups[group].parts[2] for group in faces} == faces
    page = (project / "meshes" / "README.md").read_text()
    assert f"| `{name}.msh` | {nodes} | {cells} |" in page


def ring_volume() -> float:
    """Quarter ring less a quarter turn of the groove's triangle, by Pappus."""
    ring = np.pi / 4 * (0.095**2 - 0.025**2) * 0.1
    groove = 0.5 * 0.02 * 0.025
    return ring - np.pi / 2 * (0.095 - 0.025 / 3) * groove


def test_the_block_converges_to_its_volume(tmp_path):
    """Chords lie inside the outer arc and outside the inner one: the error is of second order in the size."""
    sizes = np.array([0.02, 0.01])
    meshes = [read_mesh(make_mesh("pvc_block", tmp_path / "m.msh", size=size), ("tetra",)) for size in sizes]
    volumes = np.array([statistics(mesh).volume for mesh in meshes])
    assert (np.abs(volumes / ring_volume() - 1) < sizes**2 / (8 * 0.025**2)).all()
    assert abs(volumes[1] - ring_volume()) < abs(volumes[0] - ring_volume()) / 2


def test_bricks_of_the_block_have_the_volume_of_the_chords(tmp_path):
    """n chords in a right angle: the section sweeps sin(a) / a of the arc's volume, a = pi / 2 n."""
    found = statistics(read_mesh(make_mesh("pvc_block", tmp_path / "m.msh", divisions=(3, 8, 10)), SOLIDS))
    angle = np.pi / 16
    assert found.volume == pytest.approx(ring_volume() * np.sin(angle) / angle, rel=1e-12)


@pytest.mark.parametrize("options", [{"size": 0.01}, {"divisions": (3, 8, 10)}])
def test_the_block_has_the_section_of_the_shipped_one(tmp_path, project, options):
    """Corners of the section on both symmetry planes: bore, wall, and the groove's mouth and root."""
    corners = [(0.025, 0), (0.095, 0), (0.095, 0.04), (0.07, 0.05), (0.095, 0.06), (0.095, 0.1), (0.025, 0.1)]
    for path in (
        make_mesh("pvc_block", tmp_path / "m.msh", **options),
        project / "meshes" / "pvc_block_234.msh",
    ):
        mesh = read_mesh(path, ("tetra",))
        for name, across, along in (("symmetry_y", 1, 0), ("symmetry_x", 0, 1)):
            section = mesh.points[mesh.groups[name].nodes]
            assert np.abs(section[:, across]).max() <= 1e-15
            distance = np.linalg.norm(section[None, :, [along, 2]] - np.array(corners)[:, None], axis=-1)
            assert distance.min(axis=1).max() < 1e-12
            assert statistics(mesh).groups[name].measures[2] == pytest.approx(0.00675, rel=1e-9)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize(
    "options", [{}, {"hexahedra": True}, {"order": 2}], ids=["tetra", "bricks", "quadratic"]
)
def test_every_body_has_its_groups_on_its_boundary(tmp_path, name, options):
    body = BODIES[name]
    mesh = read_mesh(make_mesh(name, tmp_path / "m.msh", **options), SOLIDS)
    found = statistics(mesh)
    assert list(found.groups) == sorted(found.groups, key=[*body.edges, *body.faces, "solid"].index)
    assert mesh.used.all()
    assert found.groups["solid"].measures[3] == pytest.approx(found.volume, rel=1e-12)
    outside = {frozenset(face) for face in boundary_faces(mesh)}
    for group, planes in body.faces.items():
        assert {frozenset(face) for face in mesh.groups[group].parts[2]} <= outside
        heights = [mesh.points[mesh.groups[group].nodes, "xyz".index(axis)] - level for axis, level in planes]
        assert np.abs(heights).max() < 1e-12
    for group in body.edges:
        assert found.groups[group].parts.keys() == {1}


LENGTHS = {("bar", "bottom_edges"): 0.4, ("pendulum", "hinge"): 0.1, ("ellipsograph", "left_edge"): 0.01}


@pytest.mark.parametrize(("name", "group"), LENGTHS)
def test_edges_are_meshed_once_along_their_length(tmp_path, name, group):
    found = statistics(read_mesh(make_mesh(name, tmp_path / "m.msh"), ("tetra",)))
    assert found.groups[group].measures[1] == pytest.approx(LENGTHS[name, group], rel=1e-12)


def test_sizes_near_the_papers_models(tmp_path):
    """About 76 and 69 tetrahedra in the paper; versions of Gmsh differ a little."""
    counts = [
        len(read_mesh(make_mesh(name, tmp_path / "m.msh"), SOLIDS).cells)
        for name in ("ellipsograph", "pendulum")
    ]
    assert counts == [pytest.approx(76, abs=10), pytest.approx(69, abs=10)]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("bat", {}, "NAME: no such body: found 'bat'; did you mean 'bar'?"),
        ("bar", {"size": -1.0}, "--size: found -1.0, expected a length in metres above 0"),
        ("bar", {"size": float("nan")}, "--size: found nan"),
        ("bar", {"divisions": (1, 0, 1)}, "--divisions: found .1, 0, 1., expected three numbers from 1"),
        ("bar", {"size": 1.0, "divisions": (1, 1, 1)}, "bricks have divisions, not a size"),
        ("bar", {"size": 1.0, "hexahedra": True}, "bricks have divisions, not a size"),
        ("bar", {"order": 3}, "--order: found 3, expected 1 or 2"),
        ("bar", {"order": 2, "hexahedra": True}, "--order: found 2, expected 1"),
        ("bar", {"version": "3"}, "--format: found '3', expected 2.2 or 4.1"),
        (
            "pvc_block",
            {"divisions": (1, 1, 5)},
            "divisions over the height: found 5, expected an even number, at least 4",
        ),
    ],
)
def test_what_cannot_be_made_is_an_error(tmp_path, name, options, message):
    with pytest.raises(CaseError, match=message):
        make_mesh(name, tmp_path / "m.msh", **options)
    assert not list(tmp_path.iterdir())


def test_files_that_cannot_be_written_are_errors(tmp_path):
    with pytest.raises(CaseError, match="--out: .* expected a name ending in .msh"):
        make_mesh("bar", tmp_path / "m.vtu")
    with pytest.raises(CaseError, match="--out: there is no such folder"):
        make_mesh("bar", tmp_path / "none" / "m.msh")


def _edges(mesh):
    """Ends (m, 2, 3) and lengths (m,) of the edges of all tetrahedra, shared ones as often as they are shared."""
    pairs = np.array([(a, b) for a in range(4) for b in range(a)])
    ends = mesh.points[mesh.cells[:, pairs].reshape(-1, 2)]
    return ends, np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def test_edges_have_the_length_asked_for_at_rims_and_grow_away_from_them(tmp_path):
    path = make_mesh("cube", tmp_path / "m.msh", size=0.02, rim=0.003)
    ends, lengths = _edges(read_mesh(path, ("tetra",)))
    height, outer = np.ptp(ends[..., 2]), np.abs(ends[..., :2]).max()
    bonded = np.isclose(np.abs(ends[..., 2] - ends[..., 2].min() - height / 2), height / 2)
    at_rim = (bonded & np.isclose(np.abs(ends[..., :2]).max(axis=-1), outer)).all(axis=1)
    middle = (np.abs(ends[..., 2] - ends[..., 2].min() - height / 2) < 0.1 * height).all(axis=1)
    assert 0.7 * 0.003 < np.median(lengths[at_rim]) < 1.3 * 0.003
    assert np.median(lengths[middle]) > 3 * np.median(lengths[at_rim])


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("cube", {"size": 0.02, "rim": 0.0}, r"--rim: found 0.0, expected a length in metres above 0"),
        ("cube", {"size": 0.02, "rim": -0.001}, r"--rim: found -0.001, expected a length in metres above 0"),
        ("cube", {"size": 0.02, "rim": 0.03}, r"--rim: found 0.03, expected .* at most --size 0.02"),
        (
            "cube",
            {"divisions": (1, 1, 1), "rim": 0.001},
            r"--rim: bricks have divisions, not a size.*give --size",
        ),
    ],
)
def test_what_cannot_be_graded_is_told(tmp_path, name, options, words):
    with pytest.raises(CaseError, match=words):
        make_mesh(name, tmp_path / "m.msh", **options)


def test_a_body_without_rims_names_those_that_have_them(tmp_path):
    name = next(name for name, body in BODIES.items() if not body.rims)
    with pytest.raises(CaseError, match=f"--rim: {name} has no bonded face.*expected one of .*cube"):
        make_mesh(name, tmp_path / "m.msh", rim=0.001)


@pytest.mark.parametrize(
    ("name", "width", "thinnest"), [("slender_300", 1 / 300, 1.0), ("thin_layer_100", 0.1, 0.01)]
)
def test_beams_are_slender_or_have_one_thin_layer(tmp_path, name, width, thinnest):
    mesh = read_mesh(
        make_mesh(name, tmp_path / "m.msh", divisions=(5, 1, 1), hexahedra=True), ("hexahedron",)
    )
    assert statistics(mesh).volume == pytest.approx(width**2, rel=1e-12)
    layers = np.diff(np.unique(np.round(mesh.points[:, 0], 12)))
    assert layers / layers.max() == pytest.approx(
        [1, 1, thinnest, 1, 1], abs=1e-9
    )  # coordinates are rounded to 1e-12
