"""What a mesh must be to be computed with: kinds, orientation, coincident nodes, groups."""

from pathlib import Path

import numpy as np
import pytest
from tiny_meshes import CORNERS, grid, part, tetrahedra

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.assemble import assemble
from ancf_petsc.mesh.coincident import coincident_pairs
from ancf_petsc.mesh.kinds import KINDS, determinants
from ancf_petsc.mesh.raw import Block, RawMesh

POINTS = np.array(CORNERS, dtype=float)


def with_blocks(*blocks: Block, kinds=("tetra",), element="3413"):
    raw = RawMesh(10 + np.arange(27), np.zeros((27, 3)), list(blocks))
    return assemble(raw, Path("m.msh"), kinds, "error", element)


def cells_of_kind(kind: str) -> Block:
    return part(kind, [10 + np.arange(KINDS[kind].nodes)])


@pytest.mark.parametrize(
    ("kinds", "message"),
    [
        (
            ["tetra10"],
            'found 1 tetra10, expected tetra cells for element 3413; ask for mesh.element = "3-10-1-3"',
        ),
        (["hexahedron"], 'found 1 hexahedron, expected tetra cells .*; ask for mesh.element = "3813"'),
        (
            ["hexahedron20"],
            "found 1 hexahedron20, expected tetra cells .*; mesh with linear bricks: Mesh.Elem",
        ),
        (["tetra", "hexahedron"], "mixed cells: found 1 hexahedron, 1 tetra, expected only tetra"),
        (["tetra", "tetra10"], "mixed cells: found 1 tetra, 1 tetra10"),
        (["triangle", "vertex"], "found only 1 triangle, 1 vertex, expected tetra .*; mesh the body in 3D"),
        (["wedge"], "found 1 wedge, expected tetra cells for element 3413; mesh with tetra cells"),
        ([], "found no cells, expected tetra cells"),
    ],
)
def test_cells_the_element_cannot_use_are_named_with_the_cure(kinds, message):
    with pytest.raises(MeshError, match="m.msh: mesh.file: " + message):
        with_blocks(*map(cells_of_kind, kinds))


def test_a_solid_offered_to_a_plane_element_is_refused():
    with pytest.raises(MeshError, match="found 1 tetra, expected quad cells for element 2412"):
        with_blocks(cells_of_kind("tetra"), kinds=("quad",), element="2412")


def test_faces_that_cells_cannot_have_are_refused():
    quad = part("quad", [(10, 11, 12, 13)], "lid")
    with pytest.raises(
        MeshError, match="found 1 quad parts in groups, expected triangle parts on tetra cells"
    ):
        tetrahedra(blocks=[quad])


def test_a_node_the_file_does_not_hold_is_an_error():
    with pytest.raises(MeshError, match="tetra 101 refers to node 77, which the file does not hold"):
        tetrahedra(cells=[(0, 1, 2, 3), (1, 2, 3, 67)])


def test_all_negative_cells_are_turned_and_told():
    turned = tetrahedra(cells=[(0, 2, 1, 3), (2, 1, 3, 4)])
    assert turned.notes == ["all 2 elements were inverted: order of their nodes reversed"]
    assert (determinants(turned.points, turned.cells, KINDS["tetra"]) > 0).all()


@pytest.mark.parametrize("kind", ["triangle", "quad", "tetra", "hexahedron", "tetra10", "hexahedron20"])
def test_turning_a_cell_changes_the_sign_of_every_determinant(kind):
    row = KINDS[kind]
    unit = np.array(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=float
    )
    corners = {"tetra": [0, 1, 3, 4], "tetra10": [0, 1, 3, 4], "triangle": [0, 1, 3]}.get(
        kind, range(row.corners)
    )
    points = unit[list(corners)]
    if row.nodes > row.corners:
        points = np.concatenate([points, [points[list(edge)].mean(axis=0) for edge in row.edges]])
    cell = np.arange(row.nodes)[None]
    turned = cell[:, row.mirrored]
    assert (determinants(points, cell, row) > 0).all()
    assert np.allclose(determinants(points, turned, row), -determinants(points, cell, row))
    if row.nodes > row.corners:
        middles = [points[turned[0, list(edge)]].mean(axis=0) for edge in row.edges]
        assert np.allclose(points[turned[0, row.corners :]], middles)


def test_some_negative_cells_are_an_error_with_number_and_centroid():
    message = r"1 inverted of 2 elements, first element 101 with centroid \(0.5, 0.5, 0.5\); mend the mesh"
    with pytest.raises(MeshError, match=message):
        tetrahedra(cells=[(0, 1, 2, 3), (2, 1, 3, 4)])


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_flat_cells_are_an_error_at_any_size(size):
    """A cell 1e-13 of its length thick is flat, one of 1e-9 is only thin."""
    flat = POINTS.copy()
    flat[4] = [1, 1, -1 + 1e-13]
    message = "1 flat or twisted of 2 elements, first element 101 with centroid"
    with pytest.raises(MeshError, match=message):
        tetrahedra(size * flat)
    flat[4] = [1, 1, -1 + 1e-9]
    assert len(tetrahedra(size * flat).cells) == 2


def test_a_mesh_that_is_partly_a_twisted_brick_is_an_error():
    points = np.array(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0.2, 0.2, 0.1), (0, 1, 1)]
    )
    with pytest.raises(MeshError, match="1 flat or twisted of 1 elements, first element 100"):
        tetrahedra(points, [range(8)], kind="hexahedron")


SPLIT = np.array([*CORNERS, (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
APART = [(0, 1, 2, 3), (5, 6, 7, 4)]


def test_coincident_nodes_are_an_error_that_names_a_pair_and_the_cure():
    message = (
        r"3 nodes coincide with others, first nodes 11 and 15 at \(1, 0, 0\); "
        r'set mesh.duplicates = "merge" to join them or "keep"'
    )
    with pytest.raises(MeshError, match=message):
        tetrahedra(SPLIT, APART)


def test_coincident_nodes_are_kept_on_demand():
    mesh = tetrahedra(SPLIT, APART, duplicates="keep")
    assert len(mesh.points) == 8
    assert mesh.notes == ['3 coincident nodes kept separate (mesh.duplicates = "keep")']


def test_merging_joins_cells_parts_and_groups():
    faces = part("triangle", [(11, 12, 13), (15, 16, 17)], "seam")
    mesh = tetrahedra(SPLIT, APART, duplicates="merge", blocks=[faces])
    assert mesh.node_numbers.tolist() == [10, 11, 12, 13, 14]
    assert mesh.cells.tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    assert mesh.groups["seam"].nodes.tolist() == [1, 2, 3]
    assert mesh.groups["seam"].parts[2].tolist() == [[1, 2, 3]]
    assert mesh.notes == [
        "3 nodes lay on others: merged",
        "seam: 1 of its 1 faces lie within the body, not on its boundary",
    ]


def test_merging_may_not_collapse_a_cell_or_lay_cells_on_others():
    sliver = np.array([*CORNERS, (1e-10, 0, 0)])
    with pytest.raises(MeshError, match="merging nodes collapses 1 elements, first element 101"):
        tetrahedra(sliver, [(0, 1, 2, 3), (5, 0, 2, 3)], duplicates="merge")
    twice = np.concatenate([POINTS[:4], POINTS[:4]])
    with pytest.raises(MeshError, match="merging nodes lays 1 elements on others"):
        tetrahedra(twice, [(0, 1, 2, 3), (4, 5, 6, 7)], duplicates="merge")


def test_coincident_pairs_are_those_a_search_of_all_pairs_finds():
    random = np.random.default_rng(3)
    points = np.round(random.uniform(size=(400, 3)) * 6) / 6
    distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
    expected = np.argwhere(np.triu(distance <= 1e-9, 1))
    found = coincident_pairs(points, 1e-9)
    assert np.array_equal(found[np.lexsort(found.T[::-1])], expected)


def test_a_regular_mesh_has_no_coincident_nodes():
    assert grid(4, 4, 4).notes == []


def test_unused_nodes_belong_to_no_group_and_drop_their_parts():
    points = np.array([*CORNERS, (9, 9, 9)], dtype=float)
    mesh = tetrahedra(points, blocks=[part("triangle", [(10, 11, 12), (10, 11, 15)], "wall")])
    assert mesh.groups["wall"].nodes.tolist() == [0, 1, 2]
    assert mesh.groups["wall"].parts[2].tolist() == [[0, 1, 2]]
    assert mesh.notes == [
        "parts of groups whose corners belong to no element are left out: 1 of wall",
        "1 of 6 nodes belong to no element: kept, in no group",
    ]


def test_a_part_listed_twice_counts_once():
    faces = [part("triangle", [(10, 11, 12)], "wall"), part("triangle", [(12, 10, 11)], "wall", "other")]
    mesh = tetrahedra(blocks=faces)
    assert mesh.groups["wall"].parts[2].tolist() == [[0, 1, 2]]
    assert mesh.groups["other"].parts[2].tolist() == [[2, 0, 1]]
