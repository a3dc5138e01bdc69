"""Input files of Abaqus: one mesh in many styles, sets, surfaces, types of elements, what is refused and how it is said."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from decks import FORCE, Style, abaqus, assert_is, bar, element_lines, node_lines, pulled
from hypothesis import given, settings
from hypothesis import strategies as st

from ancf_petsc.errors import CaseError, MeshError
from ancf_petsc.mesh.abaqus.types import FACES, element_type
from ancf_petsc.mesh.groups import find_group, measure
from ancf_petsc.mesh.kinds import KINDS, part_sizes
from ancf_petsc.mesh.read import read_mesh

BAR = bar()
BRICKS = bar(tetrahedra=False)


def read(folder: Path, text: str, kinds=("tetra",), **options):
    path = folder / "bar.inp"
    path.write_text(text, newline="")
    return read_mesh(path, kinds, **options)


def numbers(mesh, name: str) -> list[int]:
    return mesh.node_numbers[mesh.groups[name].nodes].tolist()


@settings(max_examples=60)
@given(st.randoms(use_true_random=False))
def test_every_style_of_deck_gives_the_same_mesh(random: Random):
    with TemporaryDirectory() as folder:
        assert_is(read(Path(folder), Style(random, Path(folder)).text(BAR)), BAR)


@settings(max_examples=15)
@given(st.randoms(use_true_random=False))
def test_every_style_of_deck_with_bricks(random: Random):
    with TemporaryDirectory() as folder:
        assert_is(
            read(Path(folder), Style(random, Path(folder)).text(BRICKS, "C3D8R"), ("hexahedron",)), BRICKS
        )


def listed(name: str) -> str:
    return ", ".join(map(str, BAR.sets[name]))


BOTTOM = BAR.sets["bottom"]
SETS = {
    "two pieces": f"*NSET, NSET=bottom\n{BOTTOM[0]}\n*Nset,nset=BOTTOM\n{', '.join(map(str, BOTTOM[1:]))}",
    "names and numbers": f"*NSET, NSET=a\n{BOTTOM[0]}, {BOTTOM[1]}\n*NSET, NSET=bottom\na, {BOTTOM[2]}\n {BOTTOM[3]}",
    "a set of sets": f"*NSET, NSET=a\n{BOTTOM[0]}\n*NSET, NSET=b\n{', '.join(map(str, BOTTOM[1:]))}\n*NSET, NSET=bottom\na, b",
    "sets that come later": f"*NSET, NSET=bottom\nb, a\n*NSET, NSET=a\n{BOTTOM[0]}\n*NSET, NSET=b\n{listed('bottom')}",
    "blanks before commas": "*NSET, NSET=bottom\n" + " , ".join(map(str, BOTTOM)),
    "a comment within": f"*NSET, NSET=bottom\n{BOTTOM[0]}, {BOTTOM[1]}\n** 99999\n{BOTTOM[2]}, {BOTTOM[3]}",
    "a range": f"*NSET, NSET=bottom, GENERATE\n{BOTTOM[0]}, {BOTTOM[-1]}, 3",
    "a range without step": f"*NSET, NSET=bottom, GEN\n{BOTTOM[0]}, {BOTTOM[-1]}",
    "parameters over lines": f"*NSET,\n** a comment\n  NSET = bottom,\n GENERATE\n{BOTTOM[0]}, {BOTTOM[-1]}, 3",
    "unsorted": f"*NSET, NSET=bottom, UNSORTED\n{', '.join(map(str, BOTTOM[::-1]))}",
    "a name in quotes": f'*NSET, NSET="bottom"\n{listed("bottom")}\n*NSET, NSET="Bottom"\n{BAR.numbers[-1]}',
    "blanks in a name": f"*NSET, NSET=bot tom\n{listed('bottom')}",
}


@pytest.mark.parametrize("text", SETS.values(), ids=SETS.keys())
def test_a_set_of_nodes_however_it_is_written(tmp_path, text):
    assert_is(read(tmp_path, abaqus(BAR, bottom=text)), BAR)
    first = abaqus(BAR, bottom="")
    assert_is(read(tmp_path, text + "\n" + first), BAR)


def test_a_set_takes_what_another_holds_at_its_place(tmp_path):
    """As in CalculiX: what is added to the member afterwards is not added to the set."""
    text = f"*NSET, NSET=a\n{BOTTOM[0]}\n*NSET, NSET=b\na, {BOTTOM[1]}\n*NSET, NSET=a\n{BOTTOM[2]}"
    mesh = read(tmp_path, abaqus(BAR, bottom=text))
    assert numbers(mesh, "b") == BOTTOM[:2]
    assert numbers(mesh, "a") == [BOTTOM[0], BOTTOM[2]]


def test_nodes_of_an_element_set(tmp_path):
    mesh = read(tmp_path, abaqus(BAR, bottom="*NSET, NSET=n, ELSET=lower"))
    assert numbers(mesh, "n") == np.unique(BAR.nodes[np.isin(BAR.elements, BAR.lower)]).tolist()


def test_one_name_for_nodes_and_for_other_elements(tmp_path):
    """Supports take the nodes, materials the elements, as Abaqus does; both are the same group where they agree."""
    from ancf_petsc.mesh.groups import cells_of

    both = f"*ELSET, ELSET=top\n{', '.join(map(str, BAR.lower))}"
    mesh = read(tmp_path, abaqus(BAR, bottom=both))
    assert numbers(mesh, "top") == BAR.sets["top"]
    assert mesh.groups["top"].parts == {}
    assert mesh.cell_numbers[cells_of(mesh, mesh.groups["top"])].tolist() == BAR.lower
    assert (
        "top: sets of nodes or faces, and sets of other elements, of one name: materials take the elements"
        in mesh.notes
    )
    mesh = read(tmp_path, abaqus(BAR, bottom="*NSET, NSET=LOWER, ELSET=lower"))
    assert len(mesh.groups["lower"].parts[3]) == len(BAR.lower)
    assert mesh.groups["lower"].cells is None


# --- surfaces


def faces_on(body, kind: str, name: str) -> list[tuple[int, str]]:
    """Element and face, for every face whose corners are all in a set."""
    inside = set(body.sets[name])
    return [
        (int(number), face)
        for number, row in zip(body.elements, body.nodes.tolist(), strict=True)
        for face, corners in FACES[kind].items()
        if {row[corner] for corner in corners} <= inside
    ]


@pytest.mark.parametrize("kind", ["tetra", "hexahedron"])
@pytest.mark.parametrize("way", ["numbers", "sets", "free", "nodes"])
def test_a_surface_is_the_faces_it_names(tmp_path, kind, way):
    body, title = (BAR, "C3D4") if kind == "tetra" else (BRICKS, "C3D8")
    faces = faces_on(body, kind, "top")
    if way == "numbers":
        text = "*SURFACE, NAME=lid\n" + "\n".join(f"{number}, {face.lower()}" for number, face in faces)
    elif way == "sets":
        names = sorted({face for _, face in faces})
        sets = [
            f"*ELSET, ELSET=_lid_{f}, INTERNAL\n" + ",\n".join(str(n) for n, face in faces if face == f)
            for f in names
        ]
        text = "\n".join([*sets, "*SURFACE, TYPE=ELEMENT, NAME=lid", *(f"_lid_{f}, {f}" for f in names)])
    elif way == "free":
        text = "*ELSET, ELSET=upper\n" + ", ".join(str(n) for n, _ in faces) + "\n*SURFACE, NAME=lid\nupper,"
    else:
        text = "*SURFACE, TYPE=NODE, NAME=lid\ntop, 1."
    mesh = read(tmp_path, abaqus(body, title, bottom=text), (kind,))
    lid = mesh.groups["lid"]
    if way == "nodes":
        assert lid.parts == {}
        assert numbers(mesh, "lid") == body.sets["top"]
    elif way == "free":
        assert set(body.sets["top"]) <= set(numbers(mesh, "lid"))
        assert measure(mesh, 2, lid.parts[2]) > 0.01
    else:
        assert numbers(mesh, "lid") == body.sets["top"]
        assert measure(mesh, 2, lid.parts[2]) == pytest.approx(0.01, rel=1e-12)
    assert not mesh.refused


def test_a_surface_of_the_whole_body_is_its_boundary(tmp_path):
    mesh = read(tmp_path, abaqus(BAR, bottom="*SURFACE, NAME=skin\n, "))
    assert measure(mesh, 2, mesh.groups["skin"].parts[2]) == pytest.approx(2 * 0.01 + 4 * 0.02, rel=1e-12)


def test_a_surface_within_the_body_is_refused_where_it_is_used(tmp_path):
    number = BAR.elements[2]
    mesh = read(
        tmp_path,
        abaqus(BAR, bottom=f"*SURFACE, NAME=cut\n{number}, S1\n{number}, S2\n{number}, S3\n{number}, S4"),
    )
    with pytest.raises(
        CaseError, match=r"\d of the 4 faces of this surface lie within the body: found 'cut'"
    ):
        find_group(mesh, "cut", "constraint.cut.group", None)


def test_a_surface_that_is_no_faces_is_refused_where_it_is_used(tmp_path):
    text = "*SURFACE, NAME=tool, TYPE=REVOLUTION\n0, 0, 0, 0, 0, 1\n*SURFACE, NAME=sum, COMBINE=UNION\ntop, bottom"
    mesh = read(tmp_path, abaqus(BAR, bottom=text))
    for name, what in (("tool", "TYPE=REVOLUTION"), ("sum", "COMBINE=UNION")):
        with pytest.raises(CaseError, match=f"a surface with {what}, which is not read"):
            find_group(mesh, name, "load.0.group", None)


def test_a_surface_with_the_name_of_other_nodes_gets_another_name(tmp_path):
    number, face = faces_on(BAR, "tetra", "top")[0]
    mesh = read(tmp_path, abaqus(BAR, bottom=f"*SURFACE, NAME=top\n{number}, {face}"))
    assert numbers(mesh, "top") == BAR.sets["top"]
    assert len(mesh.groups["top.surface"].parts[2]) == 1
    assert "top is a node set and a surface of other nodes: the surface is top.surface" in mesh.notes


# --- types


@pytest.mark.parametrize(
    ("title", "kind"),
    [
        *((name, "tetra") for name in ("C3D4", "C3D4H", "C3D4T", "DC3D4"[1:])),
        *(
            (name, "tetra10")
            for name in ("C3D10", "C3D10M", "C3D10H", "C3D10MH", "C3D10HS", "C3D10I", "C3D10MT")
        ),
        *((name, "hexahedron") for name in ("C3D8", "C3D8R", "C3D8I", "C3D8H", "C3D8RH", "C3D8IH", "C3D8T")),
        *((name, "hexahedron20") for name in ("C3D20", "C3D20R", "C3D20RH", "C3D20H")),
        *(("C3D6", "wedge"), ("C3D15", "wedge15"), ("C3D5", "pyramid")),
        *(
            (name, "quad")
            for name in ("CPS4", "CPE4R", "CPS4I", "CPE4RH", "CAX4", "S4R", "S4", "M3D4R", "R3D4", "SFM3D4R")
        ),
        *((name, "triangle") for name in ("CPS3", "CPE3H", "CAX3", "S3", "S3R", "R3D3", "STRI3", "CPEG3")),
        *((name, "quad8") for name in ("CPS8R", "CPE8RH", "CAX8", "S8R5")),
        *((name, "triangle6") for name in ("CPS6M", "CPE6", "CAX6MH", "STRI65")),
        *(
            (name, "line")
            for name in ("B21", "B31", "B33", "B23H", "T3D2", "T2D2H", "B31OS", "RAX2", "SAX1", "R2D2")
        ),
        *((name, "line3") for name in ("B22", "B32H", "T3D3", "SAX2")),
    ],
)
def test_the_type_says_the_kind_of_cell(title, kind):
    found = element_type(title)
    assert found is not None
    assert found.shape is not None
    assert found.shape.kind == kind


@pytest.mark.parametrize(
    "title", ["SPRINGA", "SPRING1", "DASHPOT2", "MASS", "ROTARYI", "CONN3D2", "GAPUNI", "JOINTC"]
)
def test_springs_and_masses_are_no_cells(title):
    assert element_type(title).shape is None


@pytest.mark.parametrize("title", ["C3D27", "C3D15V", "U1", "COH3D8", "CIN3D8", "C4D4", "GK3D8", "X", "C3D"])
def test_unknown_types_are_refused_by_name(tmp_path, title):
    with pytest.raises(
        MeshError, match=rf"bar.inp: mesh.file: line \d+, \*ELEMENT: the element type {title} is not known"
    ):
        read(tmp_path, abaqus(BAR, title))


@pytest.mark.parametrize("kind", [kind for kind in FACES if KINDS[kind].dimension == 3])
def test_faces_are_all_sides_of_a_cell_each_once(kind):
    """Every edge of a closed surface is in two faces, run through in opposite directions, or every face is turned alike."""
    edges = [(face[k], face[(k + 1) % len(face)]) for face in FACES[kind].values() for k in range(len(face))]
    assert sorted(edges) == sorted((b, a) for a, b in edges)
    assert len(set(edges)) == len(edges)


def test_faces_of_bricks_and_tetrahedra_are_those_of_the_kinds():
    for kind in ("tetra", "hexahedron"):
        assert {frozenset(face) for face in FACES[kind].values()} == {
            frozenset(side) for side in KINDS[kind].sides
        }


def test_elements_beside_the_body_are_parts_of_groups_or_said(tmp_path):
    """Faces as Gmsh and others write them, a skin of shells, a spring, a mass."""
    top = [row for row in BAR.nodes.tolist() if len(set(row) & set(BAR.sets["top"])) == 3]
    face = [node for node in top[0] if node in BAR.sets["top"]]
    more = (
        f"*ELEMENT, TYPE=CPS3, ELSET=lid\n901, {', '.join(map(str, face))}\n*ELEMENT, TYPE=S3R, ELSET=skin\n902, "
        f"{', '.join(map(str, face))}\n*ELEMENT, TYPE=SPRINGA, ELSET=s\n903, {face[0]}, {face[1]}\n"
        f"*ELEMENT, TYPE=MASS, ELSET=m\n904, {face[0]}"
    )
    mesh = read(tmp_path, abaqus(BAR, bottom=more))
    assert len(mesh.cells) == len(BAR.elements)
    assert sorted(numbers(mesh, "lid")) == sorted(face)
    assert list(mesh.groups["skin"].parts) == [2]
    notes = "\n".join(mesh.notes)
    assert "1 S3R elements: beside solids they are faces of groups, without stiffness" in notes
    assert "elements that are no part of the body are skipped: 1 MASS, 1 SPRINGA" in notes


def test_elements_of_many_nodes_over_several_lines(tmp_path):
    """20 nodes, 15 of them on the first line with a comma at its end, and all kinds of lengths without."""
    unit = np.array(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float
    )
    mids = unit[np.array(KINDS["hexahedron"].edges)].mean(axis=1)
    nodes = "\n".join(f"{k + 1}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(np.vstack([unit, mids])))
    for broken in ((16, ",\n"), (16, "\n"), (3, ",\n"), (20, "\n")):
        words = [str(k) for k in (5, *range(1, 21))]
        line = ", ".join(words[: broken[0]]) + broken[1] + ", ".join(words[broken[0] :])
        mesh = read(tmp_path, f"*NODE\n{nodes}\n*ELEMENT, TYPE=C3D20R\n{line}\n", ("hexahedron20",))
        edges = np.array(KINDS["hexahedron"].edges)
        assert np.allclose(
            mesh.points[mesh.cells[:, 8:]], mesh.points[mesh.cells[:, :8]][:, edges].mean(axis=2)
        )


def test_the_middle_of_a_beam_is_its_second_node(tmp_path):
    text = (
        "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n4, 0, 1, 0\n*ELEMENT, TYPE=B22, ELSET=rim\n9, 1, 2, 3\n"
    )
    text += "*ELEMENT, TYPE=CPE3\n1, 1, 3, 4\n"
    mesh = read(tmp_path, text, ("triangle",))
    assert mesh.groups["rim"].parts[1].tolist() == [[0, 2]]


def test_axisymmetric_elements_are_said(tmp_path):
    text = "*NODE\n1, 0, 0\n2, 1, 0\n3, 1, 1\n4, 0, 1\n*ELEMENT, TYPE=CAX4RH\n1, 1, 2, 3, 4\n"
    mesh = read(tmp_path, text, ("quad",), element="2412")
    assert mesh.notes == [
        '1 CAX4RH elements are axisymmetric in the deck: [section] plane = "axisymmetric" computes them so'
    ]
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


# --- what else a deck says


def test_what_does_not_describe_the_mesh_is_skipped_and_said_once(tmp_path):
    more = (
        "*MATERIAL, NAME=m\n*HYPERELASTIC, NEO HOOKE\n1., 2.\n*SOLID SECTION, ELSET=lower, MATERIAL=m\n,\n*TIE, NAME=t\na, b\n"
        "*EQUATION\n2\n7, 1, 1., 10, 1, -1.\n*TRANSFORM, NSET=top\n1, 0, 0, 0, 1, 0\n*STEP\n*STATIC\n*BOUNDARY\ntop, 3\n"
        "*NODE PRINT, NSET=top\nU\n*NODE FILE\nU\n*ELEMENT OUTPUT\nS\n*END STEP\n*material, name=n"
    )
    mesh = read(tmp_path, abaqus(BAR, bottom=more))
    assert mesh.notes == [
        "not taken over from the deck, though it changes how the body moves: *TIE, *EQUATION",
        "keywords of the deck that do not describe the mesh are skipped: *MATERIAL, *HYPERELASTIC, *SOLIDSECTION, *TRANSFORM, "
        "*STEP, *STATIC, *BOUNDARY, *NODEPRINT, *NODEFILE, *ELEMENTOUTPUT, *ENDSTEP",
    ]


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_line_ends_and_encodings(tmp_path, ending, encoding):
    path = tmp_path / "bar.inp"
    path.write_bytes(
        abaqus(BAR, bottom=f"** é\n*NSET, NSET=bottom\n{listed('bottom')}")
        .replace("\n", ending)
        .encode(encoding)
    )
    mesh = read_mesh(path, ("tetra",))
    assert_is(mesh, BAR)
    assert mesh.notes == (
        ["names are not UTF-8: read as Latin-1, as in '** é'"] if encoding == "latin-1" else []
    )


def test_names_that_differ_in_a_byte_that_is_not_utf_8_stay_apart(tmp_path):
    path = tmp_path / "bar.inp"
    text = abaqus(BAR, bottom=f"*NSET, NSET=fläche_ä\n{BOTTOM[0]}\n*NSET, NSET=fläche_ö\n{BOTTOM[1]}")
    path.write_bytes(text.encode("latin-1"))
    mesh = read_mesh(path, ("tetra",))
    assert numbers(mesh, "fläche_ä") == BOTTOM[:1]
    assert numbers(mesh, "fläche_ö") == BOTTOM[1:2]


def test_missing_members_are_counted(tmp_path):
    mesh = read(
        tmp_path,
        abaqus(
            BAR, bottom=f"*NSET, NSET=bottom\n{BOTTOM[0]}, 1000, 1001\n*NSET, NSET=bottom, GENERATE\n7, 13"
        ),
    )
    assert numbers(mesh, "bottom") == [7, 10, 13]
    assert mesh.notes == ["the set bottom lists 6 numbers that the deck does not hold, first 1000: left out"]


def test_a_range_of_billions_costs_nothing(tmp_path):
    mesh = read(tmp_path, abaqus(BAR, bottom="*NSET, NSET=all, GENERATE\n1, 999999999, 1"))
    assert numbers(mesh, "all") == BAR.numbers.tolist()


WRONG = {
    "a word among coordinates": (
        "nodes",
        "*NODE\n1, 0, zero, 0",
        r"line 2, \*NODE: not a number: found 'zero'",
    ),
    "a parameter": (
        "nodes",
        "*NODE\n1, 0, <x>, 0",
        "not a number: found '<x>', expected numbers below 1e100; write the deck without",
    ),
    "a lonely sign": ("nodes", "*NODE\n1, 0, -, 0", "not a number: found '-'"),
    "a broken number": ("nodes", "*NODE\n1, 0, 1.0.0, 0", "not a number: found '1.0.0'"),
    "a number beyond all": (
        "nodes",
        "*NODE\n1, 0, 1e400, 0",
        "not a number: found '1e400', expected numbers below 1e100",
    ),
    "half a node": ("nodes", "*NODE\n1.5, 0, 0, 0", r"line 2, \*NODE: not a whole number: found 1.5"),
    "node 0": ("nodes", "*NODE\n0, 0, 0, 0", r"a number of a node: found 0, expected 1 or more"),
    "a node twice": (
        "nodes",
        "*NODE\n7, 0, 0, 0\n7, 0, 0, 1",
        r"\*NODE: 1 nodes are given again at other places, first node 7",
    ),
    "a strange system": ("nodes", "*NODE, SYSTEM=Q\n1, 0, 0, 0", "SYSTEM: found 'Q', expected R, C or S"),
    "an unknown parameter": (
        "nodes",
        "*NODE, NSETT=a\n1, 0, 0, 0",
        "the parameter NSETT is not read; did you mean 'NSET'",
    ),
    "three nodes": (
        "elements",
        "*ELEMENT, TYPE=C3D4\n1, 7, 10, 13",
        r"line 15, \*ELEMENT: element 1: found '3 nodes', expected 4 n",
    ),
    "five nodes": (
        "elements",
        "*ELEMENT, TYPE=C3D4\n1, 7, 10, 13, 16, 19",
        "found '5 nodes', expected 4 nodes",
    ),
    "no type": (
        "elements",
        "*ELEMENT, ELSET=a\n1, 7, 10, 13, 16",
        r"\*ELEMENT: the parameter TYPE= is missing",
    ),
    "an element twice": (
        "elements",
        "*ELEMENT, TYPE=C3D4\n1, 7, 10, 13, 19\n1, 7, 10, 13, 22",
        "1 element numbers are given twice, f",
    ),
    "a node that is not there": (
        "elements",
        "*ELEMENT, TYPE=C3D4\n1, 7, 10, 13, 999",
        "tetra 1 refers to node 999, which the file",
    ),
    "no set": (
        "top",
        "*NSET, NSET=top\nnone",
        r"line \d+, \*NSET: there is no node set of this name: found 'none'; there are: b",
    ),
    "itself": (
        "top",
        "*NSET, NSET=a\nb\n*NSET, NSET=b\na",
        "the set [AaBb] contains itself; break the circle",
    ),
    "a real number": ("top", "*NSET, NSET=top\n1.5", "a member of a node set: found '1.5'"),
    "a range backwards": (
        "top",
        "*NSET, NSET=top, GENERATE\n9, 7, 1",
        r"GENERATE: found '9, 7, 1', expected first <= last",
    ),
    "a range of names": (
        "top",
        "*NSET, NSET=top, GENERATE\na, b",
        "GENERATE: found 'a, b', expected first, last, step",
    ),
    "no name": ("top", "*NSET\n1, 2", r"\*NSET: the parameter NSET= is missing"),
    "no such face": (
        "top",
        "*SURFACE, NAME=s\n11, S5",
        r"\*SURFACE: face S5 of C3D4: expected one of S1, S2, S3, S4",
    ),
    "no such element set": (
        "top",
        "*SURFACE, NAME=s\nnone, S1",
        "there is no element set of this name: found 'none'",
    ),
    "no such element": ("top", "*SURFACE, NAME=s\n12, S1", "there is no element 12"),
    "a changed mesh": ("top", "*NMAP, NSET=a\n1, 2, 3", r"\*NMAP: changes the mesh and is not read"),
    "no file": (
        "top",
        "*INCLUDE, INPUT=none.inp",
        r"\*INCLUDE: there is no such file: found 'none.inp', expected a file in",
    ),
    "no input": ("top", "*INCLUDE", r"\*INCLUDE: the parameter INPUT= is missing"),
    "itself again": ("top", "*INCLUDE, INPUT=bar.inp", r"bar.inp includes itself; take the \*INCLUDE out"),
    "a curve": ("top", "*NGEN, LINE=C\n7, 13, 1, 9", r"\*NGEN: LINE=C is not read"),
    "an odd keyword line": (
        "top",
        "*NSET, =3",
        r"\*NSET: this keyword line is not understood: found '\*NSET, =3'",
    ),
}


@pytest.mark.parametrize(("where", "text", "message"), WRONG.values(), ids=WRONG.keys())
def test_what_is_wrong_is_said_in_one_line_with_file_and_line(tmp_path, where, text, message):
    with pytest.raises(MeshError, match=message) as error:
        read(tmp_path, abaqus(BAR, **{where: text}))
    assert str(error.value).startswith(f"{tmp_path / 'bar.inp'}: mesh.file: ")
    assert "\n" not in str(error.value)
    assert "damaged" not in str(error.value)


def test_files_that_are_no_decks(tmp_path):
    for data, message in (
        (b"1, 2, 3\n*NODE\n", "line 1: data before the first keyword: found '1, 2, 3'"),
        (b"*NODE\n1, 0, 0, 0\0\n", "not a text file: it holds zero bytes"),
        (b"*HEADING\n", "the file holds no nodes"),
    ):
        (tmp_path / "bar.inp").write_bytes(data)
        with pytest.raises(MeshError, match=message):
            read_mesh(tmp_path / "bar.inp", ("tetra",))


# --- other readers, and the answer


def test_files_that_include_files(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mesh.inp").write_text(
        "*INCLUDE, INPUT=nodes.txt\n" + "\n".join(["*ELEMENT, TYPE=C3D4", *element_lines(BAR)])
    )
    (tmp_path / "parts" / "nodes.txt").write_text("*NODE\n" + "\n".join(node_lines(BAR)[:4]) + "\n")
    (tmp_path / "more.txt").write_text("** nodes\n" + "\n".join(node_lines(BAR)[4:]))
    text = abaqus(BAR, nodes="*Include, input=parts/mesh.inp", elements="*NODE, INPUT=more.txt")
    assert_is(read(tmp_path, text), BAR)


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
@pytest.mark.parametrize("seed", range(2))
def test_calculix_finds_the_same_sets_in_the_same_deck(tmp_path, seed):
    """Volume, and the number of nodes of each set, from its printed results; without what it does not read."""
    text = Style(Random(seed), tmp_path, plain=True).text(BAR).replace("\r\n", "\n")
    mesh = read(tmp_path, text)
    nodes, elements = (",\n".join(map(str, own)) for own in (BAR.numbers, BAR.elements))
    prints = "".join(f"*NODE PRINT, NSET={name}\nU\n" for name in BAR.sets)
    step = (
        f"*NSET, NSET=everything\n{nodes}\n*ELSET, ELSET=whole_body\n{elements}\n*MATERIAL, NAME=M\n*ELASTIC\n"
        "5e6, 0.4\n*SOLID SECTION, ELSET=whole_body, MATERIAL=M\n*STEP\n*STATIC\n*BOUNDARY\neverything, 1, 3\n"
        f"{prints}*EL PRINT, ELSET=lower, TOTALS=ONLY\nEVOL\n*EL PRINT, ELSET=whole_body, TOTALS=ONLY\nEVOL\n*END STEP\n"
    )
    (tmp_path / "job.inp").write_text(
        "\n".join(line for line in text.split("\n") if line.strip()) + "\n" + step
    )
    said = subprocess.run(["ccx", "-i", "job"], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    found = (tmp_path / "job.dat").read_text().upper() if (tmp_path / "job.dat").exists() else said.stdout
    for name in BAR.sets:
        block = found.partition(f"FOR SET {name.upper()} ")[2].split("\n\n")[1].strip().split("\n")
        assert sorted(int(line.split()[0]) for line in block) == numbers(mesh, name), name
    volumes = [
        float(line.split()[-1]) for line in found.split("\n") if line.strip() and len(line.split()) == 1
    ]
    kind = KINDS["tetra"]
    lower = part_sizes(mesh.points, mesh.groups["lower"].parts[3], kind).sum()
    whole = part_sizes(mesh.points, mesh.cells, kind).sum()
    assert volumes == pytest.approx([lower, whole], rel=1e-6)


def test_the_force_on_the_bar_is_the_one_in_closed_form(tmp_path):
    """To the tolerance of the equilibrium, 1e-10, and what it leaves in a force."""
    path = tmp_path / "bar.inp"
    path.write_text(Style(Random(5), tmp_path).text(BAR), newline="")
    assert pulled(tmp_path, path) == pytest.approx(FORCE, rel=1e-9)


def test_the_documents_list_every_keyword_that_is_read_or_refused(project):
    from ancf_petsc.mesh.abaqus.cards import HANDLERS

    text = (project / "docs" / "case-format.md").read_text()
    listed = {word.replace(" ", "") for word in re.findall(r"`\*([A-Z ]+)`", text)}
    assert set(HANDLERS) <= listed
