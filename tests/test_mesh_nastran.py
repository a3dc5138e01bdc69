"""Bulk data of Nastran: fields, continuations, coordinate systems, sets; what is refused; pyNastran as a second reader."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from decks import FORCE, Bar, bar, pulled
from hypothesis import given, settings
from hypothesis import strategies as st

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.kinds import KINDS, part_sizes
from ancf_petsc.mesh.read import read_mesh

BAR = bar()
BRICKS = bar(tetrahedra=False)


def read(folder, text: str, kinds=("tetra",), name: str = "bar.bdf", **options):
    path = folder / name
    path.write_text(text, newline="")
    return read_mesh(path, kinds, **options)


def small(*fields) -> str:
    """A card in fields of 8 columns, its continuations without marks."""
    lines = [fields[0].ljust(8) + "".join(str(f).rjust(8) for f in fields[1:9])]
    lines += [
        "        " + "".join(str(f).rjust(8) for f in fields[at : at + 8]) for at in range(9, len(fields), 8)
    ]
    return "\n".join(lines)


def marked(*fields) -> str:
    lines = [fields[0].ljust(8) + "".join(str(f).rjust(8) for f in fields[1:9]).ljust(64)]
    for number, at in enumerate(range(9, len(fields), 8)):
        lines[-1] += f"+A{number}"
        lines.append(f"+A{number}".ljust(8) + "".join(str(f).rjust(8) for f in fields[at : at + 8]).ljust(64))
    return "\n".join(lines)


def large(*fields) -> str:
    words = [str(f) for f in fields]
    lines = [f"{words[0]}*".ljust(8) + "".join(w.rjust(16) for w in words[1:5])]
    lines += [
        "*".ljust(8) + "".join(w.rjust(16) for w in words[at : at + 4]) for at in range(5, len(words), 4)
    ]
    return "\n".join(lines)


def free(*fields) -> str:
    words = [str(f) for f in fields]
    lines = [",".join(words[:9])] + ["," + ",".join(words[at : at + 8]) for at in range(9, len(words), 8)]
    return "\n".join(lines)


def free_marked(*fields) -> str:
    words = [str(f) for f in fields]
    lines = [", ".join(words[:9])] + ["+, " + ", ".join(words[at : at + 8]) for at in range(9, len(words), 8)]
    return ",+\n".join(lines)


WAYS = {way.__name__: way for way in (small, marked, large, free, free_marked)}


def deck(body: Bar, way=small, name: str = "CTETRA", *more: str, points=None, frame="") -> str:
    points = body.points if points is None else points
    grids = [
        way("GRID", n, frame, *(f"{value:.6g}" if value % 1 else f"{value:.0f}." for value in p))
        for n, p in zip(body.numbers, points.tolist(), strict=True)
    ]
    cells = [way(name, n, 7, *row) for n, row in zip(body.elements, body.nodes.tolist(), strict=True)]
    return "\n".join(["SOL 101", "CEND", "BEGIN BULK", *grids, *cells, *more, "ENDDATA", ""])


def assert_is(mesh, body: Bar) -> None:
    assert mesh.node_numbers.tolist() == body.numbers.tolist()
    assert np.allclose(mesh.points, body.points, rtol=0, atol=1e-12)
    assert mesh.cell_numbers.tolist() == body.elements.tolist()
    assert mesh.node_numbers[mesh.cells].tolist() == body.nodes.tolist()
    assert len(mesh.groups["physical_3_7"].parts[3]) == len(body.elements)


@pytest.mark.parametrize("ending", ["bdf", "nas", "fem", "BDF"])
@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS.keys())
def test_every_kind_of_field_and_continuation(tmp_path, way, ending):
    assert_is(read(tmp_path, deck(BAR, way), name=f"bar.{ending}"), BAR)
    assert_is(read(tmp_path, deck(BRICKS, way, "CHEXA"), ("hexahedron",)), BRICKS)


@settings(max_examples=25)
@given(st.randoms(use_true_random=False))
def test_lines_of_all_kinds_mixed(tmp_path_factory, random: Random):
    """In any order, with comments, empty lines and cards that do not describe the mesh between them."""
    ways = list(WAYS.values())
    cards = [
        random.choice(ways)("GRID", n, "", *(f"{v:.6f}" for v in p))
        for n, p in zip(BRICKS.numbers, BRICKS.points.tolist(), strict=True)
    ]
    cards += [
        random.choice(ways)("CHEXA", n, 7, *row)
        for n, row in zip(BRICKS.elements, BRICKS.nodes.tolist(), strict=True)
    ]
    cards += ["PSOLID,7,1", "MAT1    1       5.+6            .4", "$ a comment", ""]
    random.shuffle(cards)
    text = "\n".join(cards) + random.choice(["\n", "\nENDDATA\n", "\nENDDATA\nGRID,1\n"])
    text = random.choice(["", "BEGIN BULK\n", "SOL 101\nCEND\nTITLE=GRID 1\nBEGIN BULK\n"]) + text
    mesh = read(
        tmp_path_factory.mktemp("deck"), text.replace("\n", random.choice(["\n", "\r\n"])), ("hexahedron",)
    )
    assert_is(mesh, BRICKS)
    assert mesh.notes == [
        "cards of the deck that do not describe the mesh are skipped: " + mesh.notes[0].rpartition(": ")[2]
    ]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.5-3", 1.5e-3),
        ("1.5+3", 1.5e3),
        (".5", 0.5),
        ("2", 2.0),
        ("1.D1", 10.0),
        ("-7.E-1", -0.7),
        ("+4.-1", 0.4),
        ("", 0.0),
    ],
)
def test_numbers_as_nastran_writes_them(tmp_path, text, value):
    more = f"GRID,1,,{text},1.,1."
    mesh = read(tmp_path, deck(BAR, small, "CTETRA", more))
    assert mesh.points[0].tolist() == [value, 1, 1]


def frame_of(kind: str, points: np.ndarray) -> np.ndarray:
    """Coordinates of points (n, 3) in a cylindrical or spherical system of the basic axes."""
    x, y, z = points.T
    if kind == "R":
        return points
    if kind == "C":
        return np.stack([np.hypot(x, y), np.degrees(np.arctan2(y, x)), z], axis=1)
    radius = np.linalg.norm(points, axis=1)
    theta = np.degrees(np.arccos(np.divide(z, radius, out=np.ones_like(z), where=radius > 0)))
    return np.stack([radius, theta, np.degrees(np.arctan2(y, x))], axis=1)


def full(name: str, *fields) -> str:
    return large(
        name,
        *(
            word if isinstance(word, str) else f"{word:.10g}" if word % 1 else f"{word:.0f}."
            for word in fields
        ),
    )


@pytest.mark.parametrize("kind", "RCS")
def test_nodes_in_a_system_that_is_itself_in_another(tmp_path, kind):
    """System 5 lies in system 3, which is turned by a right angle about z and moved."""
    third = full("CORD2R", "3", "0", 1.0, 2.0, 3.0, 1.0, 2.0, 4.0, 1.0, 3.0, 3.0)
    fifth = full(f"CORD2{kind}", "5", "3", 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 1.0, 0.0, 1.0)
    given = frame_of(kind, BAR.points)
    grids = [full("GRID", str(n), "5", *map(float, p)) for n, p in zip(BAR.numbers, given, strict=True)]
    cells = deck(BAR).partition("CTETRA")
    mesh = read(tmp_path, "\n".join(["BEGIN BULK", third, *grids, fifth, cells[1] + cells[2]]))
    expected = (BAR.points + (0, 0, 1)) @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + (1, 2, 3)
    assert np.allclose(mesh.points, expected, rtol=0, atol=1e-9)


def test_a_system_by_three_nodes_and_a_default_system(tmp_path):
    """The nodes of CORD1R are in the basic system, by their own 0; all others in that of GRDSET."""
    frame = "\n".join(
        ["GRID,1,0,1.,0.,0.", "GRID,2,0,1.,0.,1.", "GRID,3,0,1.,1.,0.", "CORD1R,9,1,2,3", "GRDSET,,9"]
    )
    mesh = read(tmp_path, deck(BAR, small, "CTETRA", frame))
    expected = BAR.points @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + (1, 0, 0)
    assert np.allclose(mesh.points[3:], expected, rtol=0, atol=1e-12)


def test_bricks_and_wedges_of_second_order_have_vtk_s_order(tmp_path):
    unit = np.array(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float
    )
    edges = np.array(KINDS["hexahedron"].edges)
    nastran = edges[[0, 1, 2, 3, 8, 9, 10, 11, 4, 5, 6, 7]]  # bottom, upright, top
    points = np.vstack([unit, unit[nastran].mean(axis=1)])
    text = (
        "\n".join(free("GRID", k + 1, "", *map(str, p)) for k, p in enumerate(points))
        + "\n"
        + small("CHEXA", 1, 1, *range(1, 21))
    )
    mesh = read(tmp_path, text + "\n", ("hexahedron20",))
    assert np.allclose(mesh.points[mesh.cells[:, 8:]], mesh.points[mesh.cells[:, :8]][:, edges].mean(axis=2))


def test_sets_names_and_faces_are_groups(tmp_path):
    top = BAR.sets["top"]
    row = next(row for row in BAR.nodes.tolist() if len(set(row) & set(top)) == 3)
    face = [node for node in row if node in top]
    lower = [small("SET3", 21, "ELEM", *BAR.lower)]
    thru = f"SET1,22,{top[0]},THRU,{top[0]},{top[1]},{top[2]},{top[3]}"
    optistruct = f"SET,23,GRID,LIST\n+,{top[0]},{top[1]}"
    more = (
        *lower,
        thru,
        optistruct,
        free("CTRIA3", 900, 8, *face),
        '$HMNAME PROP        7"rubber" 4',
        "RBE2,901,7,123,10",
        "CONM2,902,7,,1.",
    )
    mesh = read(tmp_path, deck(BAR, small, "CTETRA", *more))
    found = {name: mesh.node_numbers[group.nodes].tolist() for name, group in mesh.groups.items()}
    assert found["set_22"] == top
    assert found["set_23"] == top[:2]
    assert found["physical_2_8"] == sorted(face)
    assert len(mesh.groups["set_21"].parts[3]) == len(BAR.lower)
    assert len(mesh.groups["rubber"].parts[3]) == len(BAR.elements)
    assert mesh.notes == ["not taken over from the deck, though it changes how the body moves: RBE2, CONM2"]


def test_included_files(tmp_path):
    text = deck(BAR)
    head, _, tail = text.partition("CTETRA")
    (tmp_path / "cells.bdf").write_text("CTETRA" + tail.replace("ENDDATA", ""))
    assert_is(read(tmp_path, head + "INCLUDE 'cells.bdf'\nENDDATA\n"), BAR)
    assert_is(read(tmp_path, head + "include 'cel\nls.bdf'\n"), BAR)


WRONG = {
    "no system": ("GRID,1,4,1.,0.,0.", r"line \d+: GRID: there is no coordinate system 4"),
    "a system by itself": ("GRID,1,4,1.,0.,0.\nCORD2R,4,4,0.,0.,0.,0.,0.,1.\n,1.,0.,0.", "system 4 is defined by itself"),
    "points on a line": ("GRID,1,4,1.,0.,0.\nCORD2R,4,,0.,0.,0.,0.,0.,1.\n,0.,0.,2.", "CORD2R: its three points lie on one line"),
    "a system twice": ("CORD2R,4,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nCORD1R,4,7,10,13", "coordinate system 4 is given twice"),
    "a word": ("GRID,1,,one,0.,0.", r"line \d+: GRID: field 4 is not a number: found 'one'"),
    "a grid twice": ("GRID,7,,9.,0.,0.", "GRID: 1 GRIDs are given again at other places, first 7"),
    "three nodes": ("CTETRA,999,1,7,10,13", r"CTETRA: element 999 lacks nodes: 3: expected 4 or 10"),
    "nine nodes": ("CTETRA,999,1,7,10,13,19,22,25\n,28,31,34", "CTETRA: element 999 lacks nodes: 9: expected 4 or 10"),
    "an element twice": ("CTETRA,11,1,7,10,13,19", "1 element numbers are given twice, first 11"),
    "no grid": ("CTETRA,999,1,7,10,13,998", "tetra 999 refers to node 998, which the file does not hold"),
    "an element of another kind": ("CTRIAX6,9,1,7,10,13", "CTRIAX6: this element is not read; write the body with"),
    "replicated": ("GRID,1,=,*(1),=,=", "replicated fields are not read: found '='"),
    "marks out of order": ("GRID    1".ljust(72) + "+A\n+B      1", r"continuation \+B follows one"),
    "a set that is not there": ("SET1,5,998", "SET1: 1 grid points of the set are not there, first 998"),
    "a set of words": ("SET1,5,A", "SET1: a list of numbers: found 'A', expected whole numbers"),
    "backwards": ("SET1,5,9,THRU,7", "THRU: found '9 THRU 7'"),
    "too many fields": ("GRID,1,,1.,1.,1.,,,,,,,,1", "13 fields: expected at most 8 and a marker"),
    "no file": ("INCLUDE 'none.bdf'", "INCLUDE: there is no such file: found 'none.bdf'"),
    "no end": ("INCLUDE 'none.bdf", "INCLUDE: the name of the file has no end"),
    "itself": ("INCLUDE 'bar.bdf'", "INCLUDE: bar.bdf includes itself"),
    "a second body": ("BEGIN SUPER=1", "a second BEGIN, as of superelements, is not read"),
    "half a number": ("GRID,1.5,,1.,0.,0.", "field 2 is not a whole number: found '1.5'"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG.keys())
def test_what_is_wrong_is_said_in_one_line(tmp_path, text, message):
    with pytest.raises(MeshError, match=message) as error:
        read(tmp_path, deck(BAR, small, "CTETRA", text))
    assert "\n" not in str(error.value)
    assert "damaged" not in str(error.value)


def test_files_that_are_no_decks(tmp_path):
    for text, message in (
        ("+A\n", "a continuation without a card"),
        ("123\n", "not bulk data"),
        ("nothing\n", "holds no GRID"),
    ):
        with pytest.raises(MeshError, match=message):
            read(tmp_path, text)


@pytest.mark.parametrize("way", [small, large, free], ids=lambda way: way.__name__)
def test_pynastran_reads_the_same(tmp_path, way):
    """Places in the basic system, elements, volume."""
    bdf = pytest.importorskip("pyNastran.bdf.bdf")
    frame = full("CORD2C", "5", "0", 1.0, 2.0, 3.0, 1.0, 2.0, 4.0, 1.0, 3.0, 3.0)
    given = frame_of("C", BAR.points)
    mesh = read(
        tmp_path, deck(BAR, way, "CTETRA", frame, "PSOLID,7,1", "MAT1,1,5.+6,,.4", points=given, frame="5")
    )
    theirs = bdf.BDF(debug=None)
    theirs.read_bdf(str(tmp_path / "bar.bdf"), validate=False)
    assert mesh.points == pytest.approx(
        np.array([theirs.nodes[n].get_position() for n in mesh.node_numbers]), abs=1e-12
    )
    nodes = [theirs.elements[n].node_ids for n in mesh.cell_numbers]
    assert mesh.node_numbers[mesh.cells].tolist() == nodes
    volume = sum(element.Volume() for element in theirs.elements.values())
    assert part_sizes(mesh.points, mesh.cells, KINDS["tetra"]).sum() == pytest.approx(volume, rel=1e-12)


def test_the_force_on_the_bar_is_the_one_in_closed_form(tmp_path):
    sets = [small("SET1", 10 + k, *own) for k, own in enumerate(BAR.sets.values())]
    (tmp_path / "bar.bdf").write_text(deck(BAR, marked, "CTETRA", *sets))
    names = {name: f"set_{10 + k}" for k, name in enumerate(BAR.sets)}
    assert pulled(tmp_path, tmp_path / "bar.bdf", names=names) == pytest.approx(FORCE, rel=1e-9)
