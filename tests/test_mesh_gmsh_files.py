"""Reading Gmsh's files: numbers, names and groups in every version."""

import numpy as np
import pytest
from tiny_meshes import TWO, quadratic_bricks, write_two_bricks

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.groups import cells_of, measure
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.read import read_mesh


def group_table(mesh):
    """name -> (nodes, parts of each dimension)."""
    return {
        name: (len(group.nodes), {dimension: len(parts) for dimension, parts in group.parts.items()})
        for name, group in mesh.groups.items()
    }


@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
@pytest.mark.parametrize(("version", "save_all"), [(2.2, False), (4.1, False), (4.1, True)])
def test_groups_are_the_same_in_every_version(tmp_path, version, binary, save_all):
    path = write_two_bricks(tmp_path / "two.msh", version=version, binary=binary, save_all=save_all)
    mesh = read_mesh(path, ("tetra",))
    cells = len(mesh.cells)
    left = cells_of(mesh, mesh.groups["left"])
    assert np.array_equal(left, np.flatnonzero(mesh.points[mesh.cells].mean(axis=1)[:, 0] < 1))
    assert measure(mesh, 3, mesh.groups["left"].parts[3]) == pytest.approx(1, rel=1e-14)
    assert measure(mesh, 3, mesh.groups["all"].parts[3]) == pytest.approx(2, rel=1e-14)
    assert measure(mesh, 2, mesh.groups["side"].parts[2]) == pytest.approx(1, rel=1e-14)
    assert np.array_equal(mesh.groups["side"].nodes, np.flatnonzero(mesh.points[:, 0] == 0))
    table = group_table(mesh)
    assert table["all"] == (len(mesh.points), {0: 1, 3: cells})
    assert table["physical_2_9"] == table["side"]
    assert mesh.notes == []


def test_nodes_and_cells_are_in_ascending_file_number(tmp_path):
    path = tmp_path / "two.msh"
    path.write_text(TWO)
    mesh = read_mesh(path, ("tetra",))
    assert mesh.node_numbers.tolist() == [10, 11, 20, 30, 41, 99]
    assert mesh.points[[0, 3, 5]].tolist() == [[0, 0, 0], [0, 0, 1], [5, 5, 5]]
    assert mesh.cell_numbers.tolist() == [3, 4]
    assert mesh.node_numbers[mesh.cells].tolist() == [[10, 11, 20, 30], [11, 20, 30, 41]]


def test_a_cell_listed_twice_is_one_cell_in_both_groups(tmp_path):
    """Old files list a cell once for each of its physical groups, here with one entity for all."""
    path = tmp_path / "two.msh"
    path.write_text(TWO)
    mesh = read_mesh(path, ("tetra",))
    assert group_table(mesh) == {
        "body": (5, {2: 1, 3: 2}),
        "upper": (4, {3: 1}),
        "nothing": (0, {}),
        "physical_0_3": (1, {0: 1}),
    }
    assert mesh.node_numbers[mesh.groups["upper"].nodes].tolist() == [11, 20, 30, 41]


@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
def test_unused_nodes_of_old_files_stay_and_are_told(tmp_path, binary):
    """Gmsh itself forgets them."""
    path = tmp_path / "two.msh"
    path.write_bytes(binary_two() if binary else TWO.encode())
    mesh = read_mesh(path, ("tetra",))
    assert mesh.used.tolist() == [True] * 5 + [False]
    assert mesh.points[5].tolist() == [5, 5, 5]
    assert mesh.notes == ["1 of 6 nodes belong to no element: kept, in no group"]


def binary_two() -> bytes:
    """TWO without points and faces, in binary."""
    header, _, rest = TWO.partition("$PhysicalNames")
    names = "$PhysicalNames" + rest.partition("$Nodes")[0]
    nodes = [line.split() for line in TWO.partition("$Nodes\n6\n")[2].partition("$End")[0].splitlines()]
    table = np.array(
        [(int(number), tuple(map(float, point))) for number, *point in nodes],
        dtype=[("n", "i4"), ("x", "f8", 3)],
    )
    cells = np.array(
        [[4, 3, 2], [3, 1, 1], [10, 11, 20], [30, 4, 1], [1, 11, 20], [30, 41, 8], [2, 1, 11], [20, 30, 41]],
        dtype="i4",
    )
    one = np.array([1], dtype="i4").tobytes()
    start = header.replace("2.2 0 8\n", "2.2 1 8\n").encode()
    start = start.replace(b"2.2 1 8\n", b"2.2 1 8\n" + one + b"\n")
    body = (
        b"$Nodes\n6\n"
        + table.tobytes()
        + b"\n$EndNodes\n$Elements\n3\n"
        + cells.tobytes()
        + b"\n$EndElements\n"
    )
    return start + names.encode() + body


def test_quadratic_tetrahedra_have_their_mid_nodes_in_vtk_order(tmp_path):
    from ancf_petsc.mesh.generate import make_mesh

    mesh = read_mesh(make_mesh("bar", tmp_path / "bar.msh", divisions=(1, 1, 2), order=2), ("tetra10",))
    corners, mids = mesh.points[mesh.cells[:, :4]], mesh.points[mesh.cells[:, 4:]]
    edges = np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)])
    assert np.allclose(mids, corners[:, edges].mean(axis=2), atol=1e-15)
    assert mesh.used.all()
    assert group_table(mesh)["top"] == (9, {2: 2})


@pytest.mark.parametrize("version", [2.2, 4.1])
def test_bricks_of_20_nodes_have_their_mid_nodes_in_vtk_order(version, tmp_path):
    """As Gmsh makes them of linear ones; a linear element says what to ask Gmsh for."""
    mesh = read_mesh(quadratic_bricks(tmp_path, version), ("hexahedron20", "hexahedron"))
    corners, mids = mesh.points[mesh.cells[:, :8]], mesh.points[mesh.cells[:, 8:]]
    edges = np.array(KINDS["hexahedron"].edges)
    assert np.allclose(mids, corners[:, edges].mean(axis=2), atol=1e-15)
    assert mesh.used.all()
    assert group_table(mesh)["top"] == (8, {2: 1})
    with pytest.raises(
        MeshError, match=r"found 2 hexahedron20, expected hexahedron .* Mesh.ElementOrder = 1"
    ):
        read_mesh(mesh.source, ("hexahedron",), element="3843")


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
def test_a_truncated_file_is_refused_in_one_line_wherever_it_ends(tmp_path, version, binary):
    whole = write_two_bricks(tmp_path / "whole.msh", version=version, binary=binary).read_bytes()
    path = tmp_path / "cut.msh"
    for end in np.linspace(0, len(whole) - 2, 60).astype(int):
        path.write_bytes(whole[:end])
        with pytest.raises(MeshError) as error:
            read_mesh(path, ("tetra",))
        message = str(error.value)
        assert message.startswith(f"{path}: mesh.file: ")
        assert "write" in message
        assert "\n" not in message


def test_a_file_that_makes_gmsh_crash_is_an_error(tmp_path):
    """A node number one above the highest kills Gmsh 4.15; other versions may refuse it."""
    path = tmp_path / "two.msh"
    text = TWO.replace("4 4 2 1 1 11 20 30 41", "4 4 2 1 1 11 20 30 100").replace("99 5 5 5\n", "43 5 5 5\n")
    path.write_text(text.replace("2.2 0 8", "2.1 0 8"))
    with pytest.raises(MeshError, match="Gmsh (crashes on|cannot read) it .*; the file may be"):
        read_mesh(path, ("tetra",))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("hello\n", "not a Gmsh mesh: it does not begin with \\$MeshFormat"),
        (TWO.replace("2.2 0 8", "two"), "the line after \\$MeshFormat: found 'two', expected like 4.1 0 8"),
        (TWO.partition("$Nodes")[0], "the section \\$Nodes is missing"),
        (TWO.partition("$Elements")[0], "the section \\$Elements is missing"),
        (TWO.replace("$EndElements\n", ""), "the section \\$Elements is not finished"),
        (TWO + "$NodeData\n1\n", "the file ends inside a section"),
        (TWO.replace("99 5 5 5", "41 5 5 5"), "1 node numbers are given twice, first node 41"),
        (
            TWO.replace("30 0 0 1", "30 0 0 nan"),
            "1 nodes have coordinates that are not finite, first node 30",
        ),
        (
            TWO.replace("30 0 0 1", "30 0 0 1e300"),
            "1 nodes have coordinates that are not finite, first node 30",
        ),
    ],
)
def test_damaged_files_are_refused(tmp_path, text, message):
    path = tmp_path / "damaged.msh"
    path.write_text(text)
    with pytest.raises(MeshError, match=message):
        read_mesh(path, ("tetra",))


def test_paths_that_are_no_files_are_refused(tmp_path):
    with pytest.raises(MeshError, match="none.msh: mesh.file: there is no such file; give the path"):
        read_mesh(tmp_path / "none.msh", ("tetra",))
    with pytest.raises(MeshError, match="mesh.file: not a file: expected a mesh file"):
        read_mesh(tmp_path, ("tetra",))
