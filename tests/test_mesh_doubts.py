"""What is said about meshes that can be computed with and look wrong, and what is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny_meshes import CORNERS, grid, part, tetrahedra

from ancf_petsc.mesh.assemble import assemble
from ancf_petsc.mesh.faces import sharing
from ancf_petsc.mesh.generate import bricks
from ancf_petsc.mesh.inside import other_cells
from ancf_petsc.mesh.kinds import KUHN
from ancf_petsc.mesh.msh_text import read_ordinary
from ancf_petsc.mesh.parts import row_keys
from ancf_petsc.mesh.raw import Block, RawMesh
from ancf_petsc.mesh.read import read_mesh


def box(nx, ny, nz, low=(0, 0, 0), high=(1, 1, 1)):
    """Points and bricks."""
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, (nx, ny, nz), strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    return bricks(np.stack([x, y, z], axis=-1))


def halves(cells):
    return cells[:, np.array(KUHN)].reshape(-1, 4)


def mesh_of(*bodies, kind="hexahedron", join=True, duplicates="error"):
    """Several bodies as one mesh; with `join`, nodes at one place are one."""
    first = np.cumsum([0, *(len(points) for points, _ in bodies)])
    points = np.concatenate([points for points, _ in bodies])
    cells = np.concatenate([cells + start for (_, cells), start in zip(bodies, first, strict=False)])
    if join:
        points, which = np.unique(points.round(12), axis=0, return_inverse=True)
        cells = which.reshape(-1)[cells]
    raw = RawMesh(1 + np.arange(len(points)), points, [Block(kind, 1 + np.arange(len(cells)), 1 + cells)])
    return assemble(raw, "tiny.msh", (kind,), duplicates, "3813")


def as_tetrahedra(body):
    return body[0], halves(body[1])


@pytest.mark.parametrize("kind", ["hexahedron", "tetra"])
def test_nothing_is_said_about_sound_bodies(kind):
    change = as_tetrahedra if kind == "tetra" else lambda body: body
    assert mesh_of(change(box(3, 2, 4)), kind=kind).notes == []
    apart = [change(box(2, 2, 2)), change(box(1, 2, 3, (1.01, 0, 0), (2, 1, 1)))]
    assert mesh_of(*apart, kind=kind).notes == []


def test_nothing_is_said_about_curved_and_twisted_bodies():
    """A thick ring and a twisted bar: bent faces, concave corners, long thin cells."""
    points, cells = box(3, 12, 4, (0.05, 0, 0), (0.1, 1.5 * np.pi, 0.01))
    ring = np.stack(
        [points[:, 0] * np.cos(points[:, 1]), points[:, 0] * np.sin(points[:, 1]), points[:, 2]], axis=1
    )
    assert mesh_of((ring, cells)).notes == []
    assert mesh_of((ring, halves(cells)), kind="tetra").notes == []
    points, cells = box(3, 3, 8, (-1, -1, 0), (1, 1, 6))
    turn = 0.3 * points[:, 2]
    bar = np.stack(
        [
            points[:, 0] * np.cos(turn) - points[:, 1] * np.sin(turn),
            points[:, 0] * np.sin(turn) + points[:, 1] * np.cos(turn),
            points[:, 2],
        ],
        axis=1,
    )
    assert mesh_of((bar, cells)).notes == []


@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_nothing_is_said_about_any_rotation_of_a_distorted_grid(seed):
    random = np.random.default_rng(seed)
    points, cells = box(3, 3, 3)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    moved = (points + random.uniform(-0.08, 0.08, points.shape)) @ (turn * np.sign(np.linalg.det(turn)))
    assert (
        mesh_of((moved * 10.0 ** random.integers(-6, 6), halves(cells)), kind="tetra", join=False).notes == []
    )


def test_a_face_of_three_elements_is_said():
    mesh = tetrahedra([*CORNERS, (-1, -1, -1), (1, 1, 2)], [(0, 1, 2, 3), (1, 2, 3, 4), (1, 2, 3, 6)])
    assert mesh.notes[0].startswith(
        "1 faces belong to more than two elements, first face at (0.333333, 0.333333, 0.333333) of el"
    )


@pytest.mark.parametrize("kind", ["hexahedron", "tetra"])
def test_elements_within_others_are_said(kind):
    change = as_tetrahedra if kind == "tetra" else lambda body: body
    inner = change(box(1, 1, 1, (0.3, 0.3, 0.3), (0.45, 0.45, 0.45)))
    mesh = mesh_of(change(box(2, 2, 2)), inner, kind=kind)
    per_brick = 6 if kind == "tetra" else 1
    number = 8 * per_brick + 1
    notes = [note for note in mesh.notes if "lie in others" in note]
    assert len(notes) == 1
    assert notes[0].startswith(f"{per_brick} elements lie in others, first element {number} at (0.")
    assert notes[0].endswith("bodies overlap")


def test_overlapping_bodies_are_said():
    mesh = mesh_of(box(2, 2, 2), box(2, 2, 2, (0.7, 0.1, 0.1), (1.7, 1.1, 1.1)))
    assert any("elements lie in others" in note for note in mesh.notes)


@pytest.mark.parametrize("kind", ["hexahedron", "tetra"])
@pytest.mark.parametrize("way", [1, -1])
def test_faces_that_lie_on_others_and_do_not_match_are_said(kind, way):
    """One brick on four: they share corners of the plane between them, no faces."""
    change = as_tetrahedra if kind == "tetra" else lambda body: body
    bodies = [change(box(2, 2, 1)), change(box(1, 1, 1, (0, 0, 1), (1, 1, 2)))]
    mesh = mesh_of(*bodies[::way], kind=kind)
    faces = 10 if kind == "tetra" else 5
    found = [note for note in mesh.notes if "lie on others that they do not match" in note]
    assert len(found) == 1
    assert found[0].startswith(f"{faces} faces of the boundary lie on others")
    assert "the body is not joined there" in found[0]


def test_a_crack_of_matching_faces_is_not_doubted():
    """mesh.duplicates = "keep" says that bodies lie against each other; faces that do not match are said even then."""
    bodies = [box(2, 2, 1), box(2, 2, 1, (0, 0, 1), (1, 1, 2))]
    assert mesh_of(*bodies, join=False, duplicates="keep").notes == [
        '9 coincident nodes kept separate (mesh.duplicates = "keep")'
    ]
    bodies[1] = box(1, 1, 1, (0, 0, 1), (1, 1, 2))
    notes = mesh_of(*bodies, join=False, duplicates="keep").notes
    assert any("lie on others that they do not match" in note for note in notes)


def test_pieces_joined_by_an_edge_are_said():
    mesh = mesh_of(box(1, 1, 1), box(2, 1, 2, (1, 0, 1), (2, 1, 2)))
    assert mesh.notes == [
        "2 pieces of the body are joined by edges or corners only, the smallest around (0.5, 0.5, 0.5): joints may turn there"
    ]


def test_a_group_within_the_body_is_said():
    mesh = grid(1, 1, 1, blocks=[part("triangle", [(10, 11, 13), (10, 11, 17)], "walls")])
    inner = [note for note in mesh.notes if note.startswith("walls")]
    assert inner == ["walls: 1 of its 2 faces lie within the body, not on its boundary"]


def test_plane_bodies(tmp_path):
    """Edges in place of faces, in a plane that is not x-y."""
    points, quads = box(2, 2, 1)
    flat = np.unique(points[:, :2], axis=0)
    from itertools import product

    number = {tuple(p): k for k, p in enumerate(flat)}
    cells = [
        [number[x, y], number[x + 0.5, y], number[x + 0.5, y + 0.5], number[x, y + 0.5]]
        for x, y in product((0, 0.5), (0, 0.5))
    ]
    plane = np.stack([np.full(len(flat), 3.0), *flat.T], axis=1)
    beside = np.array([[3.0, 1, 0], [3, 2, 0], [3, 2, 1], [3, 1, 1]])
    assert mesh_of((plane, np.array(cells)), kind="quad").notes == []
    notes = mesh_of((plane, np.array(cells)), (beside, np.array([[0, 1, 2, 3]])), kind="quad").notes
    assert any(
        note.startswith("3 edges of the boundary lie on others that they do not match") for note in notes
    )
    inner = beside * 0.1 + (2.7, 0.1, 0.1)
    notes = mesh_of((plane, np.array(cells)), (inner, np.array([[0, 1, 2, 3]])), kind="quad").notes
    assert any(note.startswith("1 elements lie in others, first element 5") for note in notes)


# --- the loops behind it


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.sampled_from([2, 3, 4]))
def test_sharing_counts_equal_rows(seed, corners):
    """Against a sort of all rows."""
    random = np.random.default_rng(seed)
    n = 6
    sides = np.stack([random.permutation(n)[:corners] for _ in range(40)])
    count, other = sharing(sides, n)
    keys = row_keys(sides, n)
    assert count.tolist() == [(keys == key).sum() for key in keys]
    for side, partner in enumerate(other):
        same = [k for k in np.flatnonzero(keys == keys[side]) if k != side]
        assert partner == (same[0] if same else -1)


def test_many_sides_of_one_point_are_matched_in_no_time():
    """A fan: with all sides of a point compared with each other it would be 10^10 comparisons."""
    k = np.arange(50_000)
    fan = np.stack([np.zeros_like(k), 1 + k, 2 + k], axis=1)
    sides = np.vstack([fan, fan[::2, [2, 0, 1]]])
    count, other = sharing(sides, 50_003)
    assert count[:50_000].tolist() == [2, 1] * 25_000
    assert other[50_000:].tolist() == list(range(0, 50_000, 2))


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.sampled_from(["tetra", "hexahedron", "triangle"]))
def test_cells_are_found_as_by_trying_all(seed, kind):
    random = np.random.default_rng(seed)
    points, cells = box(3, 3, 3)
    if kind == "tetra":
        cells = halves(cells)
    if kind == "triangle":
        cells = np.array([[0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [4, 5, 9]])
        points = points * (1, 1, 0)
    places = random.uniform(-0.2, 1.2, (50, 3)) * ((1, 1, 0) if kind == "triangle" else 1)
    owners = random.integers(0, len(cells), 50)
    found = other_cells(points, kind, cells, places, owners)
    corners = points[cells]
    for place, owner, cell in zip(places, owners, found, strict=True):
        if kind == "hexahedron":
            inside = ((place > corners.min(axis=1)) & (place < corners.max(axis=1))).all(axis=1)
        else:
            d = 2 if kind == "triangle" else 3
            edges = np.swapaxes(corners[:, 1:, :d] - corners[:, :1, :d], 1, 2)
            share = np.linalg.solve(edges, (place - corners[:, 0])[:, :d, None])[..., 0]
            inside = (share > 0).all(axis=1) & (share.sum(axis=1) < 1)
        inside[owner] = False
        assert cell == (np.flatnonzero(inside)[0] if inside.any() else -1)


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parent.parent / "meshes").glob("*.msh")), ids=lambda path: path.stem
)
def test_meshes_of_the_project_are_not_doubted(path):
    raw = read_ordinary(path)
    kinds = {block.kind for block in raw.blocks}
    kind = next(kind for kind in ("tetra10", "hexahedron", "tetra", "quad", "line") if kind in kinds)
    assert [note for note in read_mesh(path, (kind,)).notes if "belong to no element" not in note] == []
