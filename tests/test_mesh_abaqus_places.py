"""Where a deck puts its nodes: coordinate systems, parts and instances, nodes and elements made from others."""

from __future__ import annotations

import numpy as np
import pytest
from decks import FORCE, abaqus, assert_is, bar, element_lines, node_lines, pulled
from hypothesis import given, settings
from hypothesis import strategies as st

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.abaqus.place import rotation_about
from ancf_petsc.mesh.groups import measure
from ancf_petsc.mesh.kinds import KINDS, part_sizes
from ancf_petsc.mesh.read import read_mesh

BAR = bar()
TOP = ", ".join(map(str, BAR.sets["top"]))
FINITE = st.floats(-10, 10, allow_nan=False).map(lambda value: round(value, 3))


def read(folder, text: str, kinds=("tetra",), **options):
    path = folder / "bar.inp"
    path.write_text(text)
    return read_mesh(path, kinds, **options)


def part(name: str, *more: str) -> str:
    """The bar as a part."""
    lines = [
        f"*PART, NAME={name}",
        "*NODE",
        *node_lines(BAR),
        "*ELEMENT, TYPE=C3D4",
        *element_lines(BAR),
        *more,
    ]
    return "\n".join([*lines, "*END PART"])


def assembled(*lines: str, parts: str | None = None) -> str:
    return "\n".join([parts or part("P"), "*ASSEMBLY, NAME=A", *lines, "*END ASSEMBLY", ""])


def turned(points, shift, a, b, angle):
    """Moved, then turned about the axis from a to b: by the formula, point for point."""
    axis = (np.array(b) - a) / np.linalg.norm(np.array(b) - a)
    arm = np.asarray(points) + shift - a
    cosine, sine = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    along = arm @ axis
    return a + cosine * arm + sine * np.cross(axis, arm) + (1 - cosine) * along[:, None] * axis


# --- coordinates


@pytest.mark.parametrize("system", ["C", "cylindrical"])
def test_cylindrical_coordinates(tmp_path, system):
    x, y, z = BAR.points.T
    angle = np.degrees(np.arctan2(y, x))
    lines = [
        f"{n}, {r!r}, {t!r}, {h!r}"
        for n, r, t, h in zip(BAR.numbers, np.hypot(x, y).tolist(), angle.tolist(), z.tolist(), strict=True)
    ]
    mesh = read(tmp_path, abaqus(BAR, nodes="\n".join([f"*NODE, SYSTEM={system}", *lines])))
    assert np.allclose(mesh.points, BAR.points, rtol=0, atol=1e-15)


def test_spherical_coordinates_have_their_second_angle_from_the_equator(tmp_path):
    x, y, z = BAR.points.T
    radius = np.linalg.norm(BAR.points, axis=1)
    theta, phi = np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y)))
    rows = zip(BAR.numbers, radius.tolist(), theta.tolist(), phi.tolist(), strict=True)
    lines = [f"{n}, {r!r}, {t!r}, {p!r}" for n, r, t, p in rows]
    mesh = read(tmp_path, abaqus(BAR, nodes="\n".join(["*NODE, SYSTEM=S", *lines])))
    assert np.allclose(mesh.points, BAR.points, rtol=0, atol=1e-15)


SYSTEMS = {
    "moved": ("1., 2., 3.", [1, 2, 3], np.eye(3)),
    "turned in its plane": ("1., 2., 3., 1., 5., 3.", [1, 2, 3], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "the x axis is projected": ("0., 0., 0., 0., 5., 7.", [0, 0, 0], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "three points": ("1., 0., 0., 1., 0., 4.\n1., 3., 9.", [1, 0, 0], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]),
}


@pytest.mark.parametrize(("text", "origin", "axes"), SYSTEMS.values(), ids=SYSTEMS.keys())
def test_a_system_moves_the_nodes_that_follow_until_the_next(tmp_path, text, origin, axes):
    first, rest = node_lines(BAR)[:5], node_lines(BAR)[5:]
    nodes = "\n".join([f"*SYSTEM\n{text}", "*NODE", *first, "*SYSTEM", "*NODE", *rest])
    mesh = read(
        tmp_path,
        abaqus(
            BAR,
            nodes=nodes,
            elements="*ELEMENT, TYPE=T3D2, ELSET=e\n1, 7, 10\n2, 13, 16\n3, 19, 40\n4, 22, 25\n5, 28, 31\n6, 34, 37",
        ),
        ("line",),
        element="1221",
    )
    expected = BAR.points.copy()
    expected[:5] = BAR.points[:5] @ np.array(axes) + origin
    assert np.allclose(mesh.points, expected, rtol=0, atol=1e-14)


@given(
    st.tuples(FINITE, FINITE, FINITE).filter(lambda axis: np.linalg.norm(axis) > 0.1), st.floats(-720, 720)
)
def test_rotations_are_rigid_and_keep_their_axis(axis, degrees):
    unit = np.array(axis) / np.linalg.norm(axis)
    rotation = rotation_about(unit, degrees)
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1, abs=1e-14)
    assert np.allclose(rotation @ unit, unit, atol=1e-14)
    assert np.trace(rotation) == pytest.approx(1 + 2 * np.cos(np.radians(degrees)), abs=1e-12)


# --- parts and instances


def test_one_instance_keeps_the_numbers_of_its_part(tmp_path):
    sets = [
        f"*NSET, NSET={name}, INSTANCE=p-1\n" + ",\n".join(map(str, own)) for name, own in BAR.sets.items()
    ]
    lower = "*ELSET, ELSET=lower, INSTANCE=P-1\n" + "\n".join(map(str, BAR.lower))
    mesh = read(tmp_path, assembled("*INSTANCE, NAME=P-1, PART=p", "*END INSTANCE", *sets, lower))
    assert_is(mesh, BAR)
    assert mesh.notes == []


@settings(max_examples=25)
@given(
    st.tuples(FINITE, FINITE, FINITE),
    st.tuples(FINITE, FINITE, FINITE),
    st.tuples(FINITE, FINITE, FINITE),
    FINITE,
)
def test_an_instance_is_moved_and_then_turned(tmp_path_factory, shift, a, b, angle):
    if np.linalg.norm(np.subtract(a, b)) < 0.1:
        b = (a[0] + 1.0, a[1], a[2])
    line = ", ".join(map(repr, (*a, *b, 20 * angle)))
    text = assembled("*INSTANCE, NAME=I, PART=P", ", ".join(map(repr, shift)), line, "*END INSTANCE")
    mesh = read(tmp_path_factory.mktemp("deck"), text)
    assert np.allclose(mesh.points, turned(BAR.points, shift, np.array(a), b, 20 * angle), rtol=0, atol=1e-12)


def test_a_rotation_may_stand_on_two_lines(tmp_path):
    whole = assembled("*INSTANCE, NAME=I, PART=P", "0, 0, 1", "0, 0, 0, 0, 1, 0, 90.", "*END INSTANCE")
    broken = assembled("*INSTANCE, NAME=I, PART=P", "0, 0, 1", "0, 0, 0,", "0, 1, 0, 90.", "*END INSTANCE")
    assert np.array_equal(read(tmp_path, whole).points, read(tmp_path, broken).points)


def two(*lines: str) -> str:
    """Two instances of one part, a metre apart."""
    first = ("*INSTANCE, NAME=I-1, PART=P", "*END INSTANCE")
    return assembled(
        *first,
        "*INSTANCE, NAME=I-2, PART=P",
        "1., 0., 0.",
        "*END INSTANCE",
        *lines,
        parts=part("P", f"*NSET, NSET=top\n{TOP}"),
    )


def test_two_instances_are_two_bodies_with_numbers_of_their_own(tmp_path):
    both = f"*NSET, NSET=both, INSTANCE=I-1\n{TOP}\n*NSET, NSET=both, INSTANCE=I-2\n{TOP}"
    more = "*NSET, NSET=mixed\nI-2.7, I-1.top\n*NSET, NSET=second, INSTANCE=I-2\ntop"
    mesh = read(tmp_path, two(both, more))
    assert len(mesh.cells) == 2 * len(BAR.elements)
    assert part_sizes(mesh.points, mesh.cells, KINDS["tetra"]).sum() == pytest.approx(2 * 0.002, rel=1e-12)
    assert mesh.node_numbers.tolist() == [*BAR.numbers, *(BAR.numbers + 100)]
    assert mesh.notes == ["instances number their nodes alike: added 100 to those of I-2"]
    assert mesh.points[len(BAR.numbers) :] == pytest.approx(BAR.points + (1, 0, 0))
    found = {name: mesh.node_numbers[group.nodes].tolist() for name, group in mesh.groups.items()}
    assert found["both"] == [*BAR.sets["top"], *(n + 100 for n in BAR.sets["top"])]
    assert found["I-1.top"] == BAR.sets["top"]
    assert found["I-2.top"] == found["second"] == [n + 100 for n in BAR.sets["top"]]
    assert found["mixed"] == [*BAR.sets["top"], 107]
    assert "top" not in found


def test_a_set_of_a_part_has_its_name_alone_where_one_instance_has_it(tmp_path):
    text = assembled(
        "*INSTANCE, NAME=I-1, PART=P", "*END INSTANCE", parts=part("P", f"*NSET, NSET=top\n{TOP}")
    )
    groups = read(tmp_path, text).groups
    assert groups["top"].nodes.tolist() == groups["I-1.top"].nodes.tolist()


def test_an_instance_may_have_a_mesh_of_its_own(tmp_path):
    own = ("*NODE", *node_lines(BAR), "*ELEMENT, TYPE=C3D4", *element_lines(BAR), f"*NSET, NSET=top\n{TOP}")
    text = assembled(
        "*INSTANCE, NAME=I, PART=P", "0., 0., 5.", *own, "*END INSTANCE", parts="*PART, NAME=P\n*END PART"
    )
    mesh = read(tmp_path, text)
    assert mesh.points == pytest.approx(BAR.points + (0, 0, 5))
    assert mesh.node_numbers[mesh.groups["top"].nodes].tolist() == BAR.sets["top"]


def test_surfaces_of_parts_and_of_the_assembly(tmp_path):
    from test_mesh_abaqus import faces_on

    faces = [f"{number}, {face}" for number, face in faces_on(BAR, "tetra", "top")]
    own = part(
        "P",
        "*SURFACE, NAME=lid",
        *faces,
        *(f"*ELSET, ELSET=f_{k}\n{line.split(',')[0]}" for k, line in enumerate(faces)),
    )
    lines = [f"I-1.f_{k}, {line.split(', ')[1]}" for k, line in enumerate(faces)]
    text = assembled("*INSTANCE, NAME=I-1, PART=P", "*END INSTANCE", "*SURFACE, NAME=all", *lines, parts=own)
    mesh = read(tmp_path, text)
    for name in ("all", "I-1.lid", "lid"):
        assert measure(mesh, 2, mesh.groups[name].parts[2]) == pytest.approx(0.01, rel=1e-12)
        assert mesh.node_numbers[mesh.groups[name].nodes].tolist() == BAR.sets["top"]


def test_parts_without_instances_are_said(tmp_path):
    mesh = read(
        tmp_path, assembled("*INSTANCE, NAME=I, PART=P", "*END INSTANCE", parts=part("P") + "\n" + part("Q"))
    )
    assert mesh.notes == ["parts without an instance are no part of the model: Q"]
    mesh = read(tmp_path, part("P") + "\n")
    assert mesh.notes == ["the deck has parts and no instance of them: taken as they stand: P"]
    assert len(mesh.cells) == len(BAR.elements)


def test_reference_points_of_the_assembly_are_nodes_of_no_element(tmp_path):
    text = assembled(
        "*INSTANCE, NAME=I, PART=P", "*END INSTANCE", "*NODE", "1, 9., 9., 9.", "*NSET, NSET=rp", "1"
    )
    mesh = read(tmp_path, text)
    assert len(mesh.points) == len(BAR.numbers) + 1
    assert not len(mesh.groups["rp"].nodes)
    assert "1 of 13 nodes belong to no element: kept, in no group" in mesh.notes


WRONG = {
    "no such part": (
        "*INSTANCE, NAME=I, PART=Q",
        "there is no such part: found 'Q', expected one of P; add the",
    ),
    "no such instance": (
        "*NSET, NSET=a, INSTANCE=J\n1",
        "there is no such instance: found 'J', expected one of none",
    ),
    "no end": ("*INSTANCE, NAME=I, PART=P\n*PART, NAME=R", "a part within 'I', which is not ended"),
    "half a rotation": (
        "*INSTANCE, NAME=I, PART=P\n0,0,0\n0,0,0,0,1",
        "a rotation: found '5 numbers', expected two points",
    ),
    "no axis": ("*INSTANCE, NAME=I, PART=P\n0,0,0\n1,2,3,1,2,3,90", "the axis of rotation has no length"),
    "a rotation first": (
        "*INSTANCE, NAME=I, PART=P\n0,0,0,0,1,0,90",
        "the first data line: found '7 numbers', expected a tr",
    ),
    "twice": (
        "*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n*INSTANCE, NAME=I, PART=P",
        "a second instance of this name",
    ),
    "an old run": ("*INSTANCE, NAME=I, INSTANCE=P", r"\*INSTANCE: the parameter INSTANCE is not read"),
    "an end alone": ("*END INSTANCE", "there is no instance to end"),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG.keys())
def test_what_is_wrong_with_instances_is_said(tmp_path, text, message):
    with pytest.raises(MeshError, match=rf"line \d+, \*[A-Z]+: .*{message}|{message}"):
        read(tmp_path, assembled(text))


# --- made from others


def test_a_brick_mesh_from_two_nodes_and_one_element(tmp_path):
    """Lines of nodes, planes between them, a body copied: 3 x 2 x 2 bricks."""
    text = (
        "*NODE\n1, 0, 0, 0\n4, 3, 0, 0\n21, 0, 2, 0\n24, 3, 2, 0\n*NGEN, NSET=low\n1, 4\n*NGEN, NSET=high\n21, 24, 1\n"
        "*NFILL, NSET=plane\nlow, high, 2, 10\n*NCOPY, OLD SET=plane, CHANGE NUMBER=100, NEW SET=lid, SHIFT, MULTIPLE=2\n0, 0, 1\n"
        "*ELEMENT, TYPE=C3D8\n1, 1, 2, 12, 11, 101, 102, 112, 111\n*ELGEN, ELSET=floor\n1, 3, 1, 1, 2, 10, 10\n"
        "*ELCOPY, OLD SET=floor, ELEMENT SHIFT=100, SHIFT NODES=100, NEW SET=attic\n"
    )
    mesh = read(tmp_path, text, ("hexahedron",))
    assert len(mesh.points) == 4 * 3 * 3
    assert mesh.used.all()
    assert mesh.cell_numbers.tolist() == [1, 2, 3, 11, 12, 13, 101, 102, 103, 111, 112, 113]
    assert part_sizes(mesh.points, mesh.cells, KINDS["hexahedron"]) == pytest.approx(np.ones(12))
    assert len(mesh.groups["floor"].parts[3]) == len(mesh.groups["attic"].parts[3]) == 6
    assert mesh.points[mesh.groups["plane"].nodes][:, 2].tolist() == [0.0] * 12
    assert sorted(set(mesh.points[mesh.groups["lid"].nodes][:, 2])) == [1.0, 2.0]
    assert mesh.notes == []


def test_copied_nodes_are_turned(tmp_path):
    text = "*NODE\n1, 1, 0, 0\n2, 2, 0, 0\n*NSET, NSET=a\n1, 2\n*NCOPY, OLD SET=a, CHANGE NUMBER=10, SHIFT\n"
    text += "0,0,0\n0,0,0, 0,0,1, 90.\n*ELEMENT, TYPE=T3D2\n1, 1, 11\n2, 2, 12\n"
    assert read(tmp_path, text, ("line",), element="1221").points.tolist() == [
        [1, 0, 0],
        [2, 0, 0],
        [0, 1, 0],
        [0, 2, 0],
    ]


MADE = {
    "nodes that are not there": ("*NGEN\n7, 999, 1", "node 999 is not there yet"),
    "a step that does not divide": ("*NGEN\n7, 13, 4", "a data line: found '7, 13, 4', expected first < last, and a step"),
    "too many": ("*NGEN\n7, 999999999999", "makes more nodes than fit: found 999999999992, expected at most 5000000 in a deck"),
    "sets of other sizes": ("*NSET, NSET=a\n7\n*NFILL\na, top, 3, 1", r"the two sets: found \[1, 4\], expected equally many"),
    "no set": ("*NFILL\na, top, 3, 1", "there is no node set of this name: found 'a'"),
    "an order": ("*NSET, NSET=u, UNSORTED\n10, 7\n*NFILL\nu, u, 2, 1", "the set u is UNSORTED, which is not read here"),
    "a mirror": ("*NCOPY, OLD SET=top, CHANGE NUMBER=9, REFLECT=MIRROR", "the parameter REFLECT is not read"),
    "a pole": ("*NCOPY, OLD SET=top, CHANGE NUMBER=9", "only SHIFT is read"),
    "a bias": ("*NFILL, BIAS=0.5\nbottom, top, 3, 1", "the parameter BIAS is not read"),
    "no element": ("*ELGEN\n999, 2", "element 999 is not there yet"),
    "words": ("*ELGEN\n11, two", "a data line: found '11, two', expected 2 to 10 whole numbers"),
    "no number": ("*ELCOPY, OLD SET=lower, ELEMENT SHIFT=x, SHIFT NODES=1", "ELEMENTSHIFT=: found 'x', expected a whole number"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), MADE.values(), ids=MADE.keys())
def test_what_cannot_be_made_is_said(tmp_path, text, message):
    with pytest.raises(MeshError, match=message):
        read(tmp_path, abaqus(BAR) + text + "\n")


# --- the answer


def test_two_bars_pull_twice_as_hard(tmp_path):
    sets = [
        f"*NSET, NSET={name}, INSTANCE=I-{k}\n" + ",\n".join(map(str, own))
        for name, own in BAR.sets.items()
        for k in (1, 2)
    ]
    (tmp_path / "bar.inp").write_text(two(*sets))
    assert pulled(tmp_path, tmp_path / "bar.inp") == pytest.approx(2 * FORCE, rel=1e-9)


def test_a_turned_bar_is_pulled_along_its_turned_axis(tmp_path):
    """The bar along z, turned by 90 degrees about y, lies along x: its left is at z = 0 then."""
    sets = [f"*NSET, NSET={name}, INSTANCE=I\n" + ",\n".join(map(str, own)) for name, own in BAR.sets.items()]
    turn = ("*INSTANCE, NAME=I, PART=P", "0., 0., 0.", "0., 0., 0., 0., 1., 0., 90.", "*END INSTANCE")
    (tmp_path / "bar.inp").write_text(assembled(*turn, *sets))
    assert pulled(tmp_path, tmp_path / "bar.inp", axes="zyx") == pytest.approx(FORCE, rel=1e-9)
