"""Choosing groups by geometry, and the surfaces, lines and cells groups stand for."""

import numpy as np
import pytest
from tiny_meshes import grid, part, tetrahedra

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.groups import (
    boundary_faces,
    cells_of,
    choose_groups,
    find_group,
    measure,
    parts_for_load,
    surface_of,
)
from ancf_petsc.mesh.kinds import part_kind, part_sizes
from ancf_petsc.mesh.mesh import Group
from ancf_petsc.mesh.parts import row_keys, rows_in, unique_rows


@pytest.fixture(scope="module")
def box():
    """3 x 2 x 1 unit bricks with an unused node far off, which no group may hold."""
    mesh = grid(3, 2, 1)
    points = np.concatenate([mesh.points, [[100.0, 0, 0]]])
    return tetrahedra(points, mesh.cells)


def choose(mesh, **specifications):
    return choose_groups(mesh, specifications, file="case.toml")


def chosen_points(mesh, specification):
    return mesh.points[choose(mesh, it=specification)["it"].nodes]


@pytest.mark.parametrize(
    ("specification", "test"),
    [
        ({"plane": "x", "at": "min"}, lambda x, y, z: x == 0),
        ({"plane": "x", "at": "max"}, lambda x, y, z: x == 3),
        ({"plane": "y", "at": 1}, lambda x, y, z: y == 1),
        ({"plane": [0, 0, -2], "at": "min"}, lambda x, y, z: z == 1),
        ({"plane": [1, 1, 0], "at": np.sqrt(2)}, lambda x, y, z: x + y == 2),
        ({"plane": "z", "at": 1 + 3e-6}, lambda x, y, z: z == 1),
        ({"box": [[0, 0, 0], [1, 2, 0.5]]}, lambda x, y, z: (x <= 1) & (z == 0)),
        ({"box": [[1, 2, 0.5], [0, 0, 0]]}, lambda x, y, z: (x <= 1) & (z == 0)),
        ({"nearest": [0.1, 0.2, 1.3]}, lambda x, y, z: (x == 0) & (y == 0) & (z == 1)),
        ({"nearest": [[3, 2, 1], [0, 0, 0]]}, lambda x, y, z: (x + y + z == 6) | (x + y + z == 0)),
    ],
)
def test_nodes_are_chosen_by_geometry(box, specification, test):
    expected = np.flatnonzero(test(*box.points.T) & box.used)
    assert np.array_equal(choose(box, it=specification)["it"].nodes, expected)


def test_a_plane_takes_nodes_within_a_millionth_of_the_mesh_size(box):
    """The mesh's size is the diagonal of its box, sqrt(14)."""
    near, far = 1 + 0.99e-6 * np.sqrt(14), 1 + 1.01e-6 * np.sqrt(14)
    assert len(chosen_points(box, {"plane": "z", "at": near})) == 12
    with pytest.raises(CaseError, match="the group is empty"):
        choose(box, it={"plane": "z", "at": far})


def test_unions_do_not_depend_on_order(box):
    a, b = {"plane": "x", "at": 0}, {"plane": "x", "at": 3}
    for union in (["a", "b", "c"], ["c", "b", "a"]):
        groups = choose(box, all={"union": union}, c={"union": ["a"]}, a=a, b=b)
        assert list(groups) == ["all", "c", "a", "b"]
        assert np.array_equal(groups["all"].nodes, np.union1d(groups["a"].nodes, groups["b"].nodes))


def test_a_union_of_file_groups_has_each_part_once():
    faces = part("triangle", [(10, 12, 11)], "one", "two"), part("triangle", [(10, 11, 13)], "two")
    mesh = tetrahedra(blocks=faces)
    first, second = (choose(mesh, u={"union": names})["u"] for names in (["one", "two"], ["two", "one"]))
    assert np.array_equal(first.parts[2], second.parts[2])
    assert np.sort(first.parts[2]).tolist() == [[0, 1, 2], [0, 1, 3]]


def test_a_union_with_file_groups_takes_the_boundary_of_sets_of_nodes():
    mesh = tetrahedra(blocks=[part("triangle", [(10, 12, 11)], "floor")])
    group = choose(mesh, both={"union": ["floor", "wall"]}, wall={"plane": "y", "at": 0})["both"]
    assert np.sort(group.parts[2]).tolist() == [[0, 1, 2], [0, 1, 3]]


@pytest.mark.parametrize(
    ("specifications", "message"),
    [
        (
            {"far": {"plane": "z", "at": 0.3}},
            "case.toml: groups.far: the group is empty: no node at 0.3 along z, where the mesh .* 0 to 1;",
        ),
        (
            {"far": {"plane": [0, 1, 1], "at": 9}},
            "no node at 9 along .0, 1, 1., where the mesh goes from 0 to 2.12",
        ),
        (
            {"far": {"box": [[5, 5, 5], [6, 6, 6]]}},
            r"no node between \(5, 5, 5\) and \(6, 6, 6\); the mesh lies between \(0, 0, 0\) and \(3, 2, 1\)",
        ),
        (
            {"far": {"nearest": [[0, 0, 0], [99, 0, 0]]}},
            r"groups.far.nearest: no node near \(99, 0, 0\): .* is 96 away, farther than its longest edge",
        ),
        ({"far": {"plane": [0, 0, 0], "at": 0}}, "groups.far.plane: the normal has no length"),
        (
            {"far": {"union": ["fat"]}, "fast": {"plane": "x", "at": 0}},
            "groups.far.union: .*'fat'; did you mean 'fast'?",
        ),
        ({"a": {"union": ["a"]}}, "groups.a: a union of itself: found 'a -> a'; break the circle"),
        ({"a": {"union": ["b"]}, "b": {"union": ["a"]}}, "a union of itself: found 'a -> b -> a'"),
    ],
)
def test_choices_that_find_nothing_say_what_was_sought(box, specifications, message):
    with pytest.raises(CaseError, match=message):
        choose(box, **specifications)


def test_a_name_that_file_and_case_define_is_an_error():
    mesh = tetrahedra(blocks=[part("triangle", [(10, 12, 11)], "floor")])
    with pytest.raises(
        CaseError, match="case.toml: groups.floor: the mesh file has a group of this name too"
    ):
        choose(mesh, floor={"plane": "z", "at": 0})


def test_groups_are_found_by_name_or_the_others_are_listed():
    mesh = tetrahedra(
        blocks=[part("triangle", [(10, 12, 11)], "floor"), part("triangle", np.empty((0, 3)), "void")]
    )
    assert find_group(mesh, "floor", "constraint.floor", "c.toml").nodes.tolist() == [0, 1, 2]
    message = r"c.toml: constraint.flor: no such group: .*; did you mean 'floor'\? \(there are: floor, void\)"
    with pytest.raises(CaseError, match=message):
        find_group(mesh, "flor", "constraint.flor", "c.toml")
    with pytest.raises(CaseError, match="c.toml: load.0: the group is empty: .*: found 'void'"):
        find_group(mesh, "void", "load.0", "c.toml")


def test_boundary_faces_enclose_the_body_and_look_outwards(box):
    """Divergence theorem: the flux of x through the boundary is three times the volume."""
    faces = box.points[boundary_faces(box)]
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]) / 2
    assert np.einsum("fi,fi->", faces.mean(axis=1), normals) == pytest.approx(18, rel=1e-14)
    assert np.allclose(normals.sum(axis=0), 0, atol=1e-14)
    assert len(faces) == 2 * 2 * (3 * 2 + 2 * 1 + 1 * 3)


def test_boundary_faces_of_a_brick():
    unit = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    mesh = tetrahedra(unit, [range(8)], kind="hexahedron")
    faces = mesh.points[boundary_faces(mesh)]
    normals = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1]) / 2
    assert np.einsum("fi,fi->", faces.mean(axis=1), normals) == pytest.approx(3, rel=1e-15)
    assert measure(mesh, 2, boundary_faces(mesh)) == pytest.approx(6, rel=1e-15)
    assert measure(mesh, 3, mesh.cells) == pytest.approx(1, rel=1e-15)


def test_a_load_acts_on_the_groups_own_parts_of_the_highest_dimension():
    blocks = [part("line", [(10, 11)], "mixed", "edge"), part("triangle", [(10, 12, 11)], "mixed")]
    mesh = tetrahedra(blocks=[*blocks, part("vertex", [(14,)], "point")])
    assert parts_for_load(mesh, mesh.groups["mixed"])[0] == 2
    assert parts_for_load(mesh, mesh.groups["mixed"])[1].tolist() == [[0, 2, 1]]
    assert parts_for_load(mesh, mesh.groups["edge"])[0] == 1
    dimension, nodes = parts_for_load(mesh, mesh.groups["point"])
    assert (dimension, nodes.tolist()) == (0, [4])


def test_a_load_on_a_set_of_nodes_acts_on_the_boundary_between_them(box):
    groups = choose(box, end={"plane": "x", "at": "max"}, corners={"nearest": [[0, 0, 0], [3, 2, 1]]})
    dimension, faces = parts_for_load(box, groups["end"])
    assert (dimension, len(faces), measure(box, 2, faces)) == (2, 4, pytest.approx(2, rel=1e-14))
    dimension, nodes = parts_for_load(box, groups["corners"])
    assert dimension == 0
    assert np.array_equal(nodes, groups["corners"].nodes)


def test_surfaces_of_groups(box):
    every = Group("body", np.arange(24), {3: box.cells})
    edge = Group("edge", np.array([0, 1]), {1: np.array([[0, 1]])})
    end = choose(box, end={"plane": "z", "at": 0})["end"]
    assert surface_of(box, every) is None
    assert surface_of(box, edge) is None
    assert measure(box, 2, surface_of(box, end)) == pytest.approx(6, rel=1e-14)
    assert measure(box, 1, edge.parts[1]) == pytest.approx(1, rel=1e-15)


def test_cells_of_a_group_are_its_parts_else_those_between_its_nodes(box):
    some = np.array([7, 3, 20])
    parts = box.cells[some][:, [2, 0, 3, 1]]
    assert cells_of(box, Group("some", np.unique(parts), {3: parts})).tolist() == [3, 7, 20]
    left = choose(box, left={"box": [[0, 0, 0], [1, 2, 1]]})["left"]
    centres = box.points[box.cells].mean(axis=1)
    assert np.array_equal(cells_of(box, left), np.flatnonzero(centres[:, 0] < 1))


@pytest.mark.parametrize("bound", [60, 2**20, 2**31])
def test_rows_are_equal_whatever_the_order_of_their_nodes(bound):
    """Also where a row's key would not fit into a word."""
    random = np.random.default_rng(5)
    rows = random.integers(bound - 5, bound, size=(200, 8))
    expected = np.unique(np.sort(rows, axis=1), axis=0, return_inverse=True)[1]
    found = np.unique(row_keys(rows, bound), return_inverse=True)[1]
    assert np.array_equal(found[:, None] == found, expected[:, None] == expected)
    unique = unique_rows(rows, bound)
    assert len(unique) == expected.max() + 1
    places = rows_in(random.permuted(rows, axis=1), unique, bound)
    assert np.array_equal(np.sort(unique[places], axis=1), np.sort(rows, axis=1))
    assert rows_in(np.zeros((1, 8), dtype=int), unique, bound).tolist() == [-1]


def test_a_skew_quadrilaterals_area_is_the_mean_over_both_diagonals():
    points = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (0.5, 3, 0.0)])
    assert part_sizes(points, np.array([[0, 1, 2, 3]]), part_kind(2, 4)).tolist() == [2.0]
    triangle = part_sizes(points, np.array([[0, 1, 4]]), part_kind(2, 3))
    assert triangle.tolist() == [3.0]
