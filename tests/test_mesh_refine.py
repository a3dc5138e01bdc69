"""Uniform refinement: the body, its surface and its groups stay what they were, at every level and for every kind of cell."""

import meshio
import numpy as np
import pytest

from ancf_petsc.mesh.check import statistics
from ancf_petsc.mesh.groups import boundary_faces, cells_of, measure, parts_for_support
from ancf_petsc.mesh.kinds import KINDS, determinants, qualities
from ancf_petsc.mesh.made import Request, made_mesh
from ancf_petsc.mesh.mesh import Group
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.mesh.refine import refine

MESHES = {
    "tetra": Request("pvc_block", size=0.03),
    "tetra10": Request("bar", size=0.08, order=2),
    "hexahedron": Request("pvc_block", divisions=(2, 3, 4), hexahedra=True),
    "quad": Request("cantilever", divisions=(4, 2, 1), flat="quad"),
    "line": Request("pendulum", divisions=(3, 1, 1), flat="line"),
}


@pytest.fixture(params=MESHES)
def mesh(request, monkeypatch, tmp_path_factory):
    monkeypatch.setattr(
        "ancf_petsc.mesh.made.cache_folder", lambda: tmp_path_factory.getbasetemp() / "meshes"
    )
    return read_mesh(made_mesh(MESHES[request.param]), (request.param,))


@pytest.mark.parametrize("times", [1, 2])
def test_body_surface_and_groups_keep_their_sizes(mesh, times):
    before, kind = statistics(mesh), KINDS[KINDS[mesh.kind].linear or mesh.kind]
    surface = len(boundary_faces(mesh)) if kind.dimension > 1 else 0
    refine(mesh, times)
    after = statistics(mesh)
    factor = 2**kind.dimension
    assert after.cells == before.cells * factor**times
    assert after.volume == pytest.approx(before.volume, rel=1e-12)
    assert after.pieces == before.pieces
    if kind.dimension > 1:  # neighbours fit: no more sides belong to one cell only than those of the surface
        assert len(boundary_faces(mesh)) == surface * (factor // 2) ** times
    assert (determinants(mesh.points, mesh.cells, kind) > 0).all()
    for name, group in before.groups.items():
        for dimension, size in group.measures.items():
            assert after.groups[name].measures[dimension] == pytest.approx(size, rel=1e-12), name
            assert after.groups[name].parts[dimension] == group.parts[dimension] * (2**dimension) ** times
        own = mesh.groups[name]
        on_parts = np.unique(np.concatenate([rows.ravel() for rows in own.parts.values()]))
        assert np.isin(on_parts, own.nodes).all()


def test_old_nodes_keep_their_numbers_and_cells_count_parent_by_parent(mesh):
    points, numbers = mesh.points.copy(), mesh.node_numbers.copy()
    kind = KINDS[KINDS[mesh.kind].linear or mesh.kind]
    centres = mesh.points[mesh.cells[:, : kind.nodes]].mean(axis=1)
    refine(mesh, 2)
    assert np.array_equal(mesh.points[: len(points)], points)
    assert np.array_equal(mesh.node_numbers[: len(numbers)], numbers)
    assert (np.diff(mesh.node_numbers) > 0).all()
    children = (2**kind.dimension) ** 2
    parent = (mesh.cell_numbers - 1) // children
    volumes = np.abs(determinants(mesh.points, mesh.cells, kind)[:, 0])
    inside = mesh.points[mesh.cells].mean(axis=1)
    means = np.stack([np.bincount(parent, volumes * inside[:, i]) for i in range(3)], 1)
    means /= np.bincount(parent, volumes)[:, None]
    if kind.name in ("tetra", "line"):  # of other cells the centre is not the mean of the corners
        assert np.allclose(means, centres, atol=1e-12)


def test_tetrahedra_stay_as_good_as_they_were():
    """At most three shapes come of one by Bey's choice; the shortest diagonal gives none worse than half the parent's quality."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        points = rng.normal(size=(4, 3))
        points[[0, 1]] = points[[0, 1]] if np.linalg.det(points[1:] - points[0]) > 0 else points[[1, 0]]
        mesh = _of_cells(points, np.array([[0, 1, 2, 3]]), "tetra")
        worst = qualities(points, mesh.cells, KINDS["tetra"]).min()
        refine(mesh, 4)
        assert qualities(mesh.points, mesh.cells, KINDS["tetra"]).min() > 0.4 * worst


@pytest.mark.parametrize("mesh", ["tetra", "tetra10", "hexahedron"], indirect=True)
def test_a_set_of_nodes_takes_the_nodes_of_the_faces_it_covers_and_no_others(mesh):
    low = mesh.points.min(axis=0)
    faces = np.abs(mesh.points[:, 2] - low[2]) < 1e-9 * mesh.size
    mesh.groups["set"] = Group("set", np.flatnonzero(faces))
    corner = np.flatnonzero(faces)[:1]
    mesh.groups["one"] = Group("one", corner)
    area = measure(mesh, 2, parts_for_support(mesh, mesh.groups["set"])[2])
    refine(mesh, 2)
    found = mesh.groups["set"]
    assert np.array_equal(found.nodes, np.flatnonzero(np.abs(mesh.points[:, 2] - low[2]) < 1e-9 * mesh.size))
    assert measure(mesh, 2, parts_for_support(mesh, found)[2]) == pytest.approx(area, rel=1e-12)
    assert np.array_equal(mesh.groups["one"].nodes, corner)


def test_a_set_over_two_faces_does_not_hold_what_lies_between_them():
    """One tetrahedron in the corner of two held faces: its edge across the body is none of theirs."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    mesh = _of_cells(points, np.array([[0, 1, 2, 3], [1, 2, 3, 4]]), "tetra")
    mesh.groups["set"] = Group("set", np.array([0, 1, 2, 3]))
    refine(mesh, 1)
    inside = np.isclose(mesh.points[mesh.groups["set"].nodes], [0.5, 0.5, 0.5]).all(axis=1)
    assert not inside.any()


def test_materials_follow_their_cells(mesh):
    kind = KINDS[KINDS[mesh.kind].linear or mesh.kind]
    chosen = np.arange(0, len(mesh.cells), 2)
    volume = measure(mesh, kind.dimension, mesh.cells[chosen, : kind.nodes])
    mesh.groups["soft"] = Group("soft", np.unique(mesh.cells[chosen]), {}, chosen)
    refine(mesh, 1)
    cells = cells_of(mesh, mesh.groups["soft"])
    assert len(cells) == len(chosen) * 2**kind.dimension
    assert measure(mesh, kind.dimension, mesh.cells[cells]) == pytest.approx(volume, rel=1e-12)


def test_a_crack_stays_open(tmp_path):
    """Coincident nodes that are kept apart have no common middles."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]])
    twice = np.vstack([points, points[:3]])
    cells = np.array([[0, 1, 2, 3], [5, 7, 6, 4]])
    meshio.Mesh(twice, [("tetra", cells)]).write(tmp_path / "crack.vtu")
    mesh = read_mesh(tmp_path / "crack.vtu", ("tetra",), duplicates="keep")
    refine(mesh, 2)
    assert statistics(mesh).pieces == 2


def _of_cells(points, cells, kind):
    from ancf_petsc.mesh.mesh import Mesh

    return Mesh(
        points=points.copy(),
        kind=kind,
        cells=cells,
        groups={},
        node_numbers=1 + np.arange(len(points)),
        cell_numbers=1 + np.arange(len(cells)),
        used=np.ones(len(points), bool),
    )
