"""Files of Gmsh with parameters of nodes, in partitions, with names that are not UTF-8: the same mesh and groups as without."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from tiny_meshes import TWO, write_two_bricks

from ancf_petsc import case_from_dict
from ancf_petsc.errors import CaseError, MeshError
from ancf_petsc.mesh.gmsh_session import gmsh_session
from ancf_petsc.mesh.kinds import BY_GMSH
from ancf_petsc.mesh.msh_binary import read_binary
from ancf_petsc.mesh.read import read_mesh


def shape(mesh) -> tuple:
    """What must not depend on how the file is written."""
    places = [tuple(point) for point in mesh.points.round(12)[mesh.used]]
    groups = {
        name: (len(g.nodes), {d: len(p) for d, p in g.parts.items()}) for name, g in mesh.groups.items()
    }
    return sorted(places), len(mesh.cells), groups


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """One box with physical points, lines, faces and two overlapping volumes' names, in every way Gmsh writes it."""
    folder = tmp_path_factory.mktemp("gmsh")
    with gmsh_session(**{"Mesh.MeshSizeMin": 0.6, "Mesh.MeshSizeMax": 0.6}) as gmsh:
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        for dimension, entities, name in (
            (0, [1, 2], "tips"),
            (1, [1, 2], "rim"),
            (2, [5], "bottom"),
            (2, [5, 6], "ends"),
            (3, [1], "body"),
        ):
            gmsh.model.setPhysicalName(
                dimension, tag := gmsh.model.addPhysicalGroup(dimension, entities), name
            )
            assert tag > 0
        gmsh.model.mesh.generate(3)
        before = {
            name: gmsh.option.getNumber(name)
            for name in ("Mesh.MshFileVersion", "Mesh.Binary", "Mesh.SaveParametric")
        }
        try:
            for partition in (0, 3):
                if partition:
                    gmsh.model.mesh.partition(partition)
                for version in (2.2, 4.1):
                    for binary in (0, 1):
                        for parametric in (0, 1):
                            for name, value in zip(before, (version, binary, parametric), strict=True):
                                gmsh.option.setNumber(name, value)
                            gmsh.write(str(folder / f"{version}-{binary}-{parametric}-{partition}.msh"))
        finally:
            for name, value in before.items():
                gmsh.option.setNumber(name, value)
    return folder


def test_every_way_of_writing_gives_the_same_mesh_and_groups(written):
    files = sorted(written.glob("*.msh"))
    assert len(files) == 16
    shapes = {file.stem: shape(read_mesh(file, ("tetra",))) for file in files}
    plain = shapes["2.2-0-0-0"]
    assert plain[2]["ends"][1] == {2: 2 * plain[2]["bottom"][1][2]}
    assert list(plain[2]) == ["tips", "rim", "bottom", "ends", "body"]
    assert {name for name, found in shapes.items() if found != plain} == set()


@pytest.mark.parametrize("name", ["2.2-1-0-0", "2.2-1-1-0", "2.2-1-0-3", "2.2-1-1-3"])
def test_binary_files_that_are_cut_off_are_errors(written, tmp_path, name):
    whole = (written / f"{name}.msh").read_bytes()
    path = tmp_path / "cut.msh"
    for end in np.linspace(60, len(whole) - 15, 40).astype(int):
        path.write_bytes(whole[:end])
        with pytest.raises(MeshError, match="write it again"):
            read_mesh(path, ("tetra",))


@pytest.mark.parametrize("section", [b"$Nodes\n", b"$Elements\n"])
def test_a_count_that_is_too_small_is_an_error(written, tmp_path, section):
    data = (written / "2.2-1-0-0.msh").read_bytes()
    start = data.index(section) + len(section)
    end = data.index(b"\n", start)
    path = tmp_path / "count.msh"
    path.write_bytes(data[:start] + str(int(data[start:end]) - 1).encode() + data[end:])
    with pytest.raises(MeshError, match="a section is cut off"):
        read_mesh(path, ("tetra",))


def test_the_other_byte_order(tmp_path):
    """Two tetrahedra with numbers of the highest byte first."""
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]
    nodes = b"".join(struct.pack(">i3d", k + 1, *p) for k, p in enumerate(points))
    rows = struct.pack(">3i", 4, 2, 2) + b"".join(
        struct.pack(">7i", k, 5, 1, *row) for k, row in ((1, (1, 2, 3, 4)), (2, (2, 3, 4, 5)))
    )
    data = (
        b"$MeshFormat\n2.2 1 8\n"
        + struct.pack(">i", 1)
        + b"\n$EndMeshFormat\n$Nodes\n5\n"
        + nodes
        + b"\n$EndNodes\n"
    )
    path = tmp_path / "swapped.msh"
    path.write_bytes(data + b"$Elements\n2\n" + rows + b"\n$EndElements\n")
    raw = read_binary(path)
    assert raw.points.tolist() == [list(map(float, p)) for p in points]
    assert raw.blocks[0].nodes.tolist() == [[1, 2, 3, 4], [2, 3, 4, 5]]
    assert raw.names == ["physical_3_5"]


def test_a_kind_that_is_not_known_is_left_to_gmsh(written, tmp_path):
    data = (written / "2.2-1-0-0.msh").read_bytes()
    start = data.index(b"$Elements\n")
    at = data.index(b"\n", start + 10) + 1
    path = tmp_path / "odd.msh"
    assert 99 not in BY_GMSH
    path.write_bytes(data[:at] + struct.pack("<i", 99) + data[at + 4 :])
    assert read_binary(path) is None


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("version", [2.2, 4.1])
def test_names_that_are_not_utf_8_stay_apart(tmp_path, version, binary):
    path = write_two_bricks(tmp_path / "two.msh", version=version, binary=binary)
    data = path.read_bytes().replace(b'"left"', b'"fl\xe4che_\xe4"').replace(b'"side"', b'"fl\xe4che_\xf6"')
    path.write_bytes(data)
    mesh = read_mesh(path, ("tetra",))
    assert {"fläche_ä", "fläche_ö"} <= set(mesh.groups)
    assert list(mesh.groups["fläche_ö"].parts) == [2]
    assert mesh.notes == [
        next(note for note in mesh.notes if note.startswith("names are not UTF-8: read as Latin-1, as in "))
    ]


def test_names_that_would_be_one_in_either_encoding_stay_apart(tmp_path):
    """The bytes of one name read as UTF-8 are the letter of the other read as Latin-1."""
    path = tmp_path / "two.msh"
    path.write_bytes(TWO.encode().replace(b'"upper"', b'"\xc3\xa4"').replace(b'"nothing"', b'"\xe4"'))
    assert list(read_mesh(path, ("tetra",)).groups) == ["body", "Ã¤", "ä", "physical_0_3"]


def test_a_path_with_a_zero_byte(tmp_path):
    with pytest.raises(MeshError, match="a path cannot hold a zero byte"):
        read_mesh(f"{tmp_path}/a\0b.msh", ("tetra",))


def test_a_case_whose_mesh_has_a_zero_byte_in_its_path(tmp_path):
    data = {
        "title": "zero",
        "mesh": {"file": "a\0b.msh", "element": "3413"},
        "material": {"law": "svk", "young": 1.0, "poisson": 0.3},
        "statics": {},
    }
    with pytest.raises(CaseError, match="mesh.file: a NUL character"):
        case_from_dict(data, tmp_path)
