"""Reading through meshio: cells, and the names each format has."""

import re

import meshio
import numpy as np
import pytest
from tiny_meshes import CORNERS

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh import meshio_file
from ancf_petsc.mesh.foreign import by_meshio
from ancf_petsc.mesh.foreign.wire import decode, encode
from ancf_petsc.mesh.read import read_mesh

# meshio's writer of MED calls functions numpy is about to drop.
pytestmark = pytest.mark.filterwarnings("ignore:.product. is deprecated:DeprecationWarning")

TETS = np.array([(0, 1, 2, 3), (1, 2, 3, 4)])
FACES = np.array([(0, 2, 1), (0, 1, 3)])


@pytest.fixture
def hands_over(monkeypatch):
    """hands_over(mesh): meshio's reader, in this process, gives this mesh."""

    def enter(mesh):
        monkeypatch.setattr(meshio, "read", lambda path: mesh)
        monkeypatch.setattr(
            meshio_file,
            "contents",
            lambda path, reader: decode(b"".join(encode(by_meshio.contents(path, [])))),
        )

    return enter


def body(**options) -> meshio.Mesh:
    return meshio.Mesh(np.array(CORNERS, dtype=float), [("triangle", FACES), ("tetra", TETS)], **options)


@pytest.mark.parametrize("name", ["m.vtu", "m.vtk", "m.xdmf", "m.inp", "m.med", "m.bdf", "m.mesh", "m.ugrid"])
def test_cells_and_points_come_through_every_format(tmp_path, name):
    body().write(tmp_path / name)
    if name == "m.ugrid":  # with numpy 2 meshio writes np.int64(5) where it means 5
        said = (tmp_path / name).read_text()
        (tmp_path / name).write_text(re.sub(r"np\.\w+\((.*?)\)", r"\1", said))
    mesh = read_mesh(tmp_path / name, ("tetra",))
    assert np.allclose(mesh.points, CORNERS, atol=1e-15)
    assert mesh.cells.tolist() == TETS.tolist()
    assert mesh.node_numbers.tolist() == [1, 2, 3, 4, 5]
    assert len(mesh.cell_numbers) == 2


@pytest.mark.parametrize("name", ["m.vtu", "m.vtk", "m.xdmf"])
def test_cell_sets_written_as_data_are_groups_again(tmp_path, name):
    sets = {"wall": [[0, 1], []], "lower": [[], [0]], "upper": [[], [1]]}
    mesh = body(cell_sets=sets)
    if name == "m.xdmf":  # meshio would drop the sets
        mesh.cell_sets_to_data()
    mesh.write(tmp_path / name)
    groups = read_mesh(tmp_path / name, ("tetra",)).groups
    assert list(groups) == ["wall", "lower", "upper"]
    assert np.sort(groups["wall"].parts[2]).tolist() == [[0, 1, 2], [0, 1, 3]]
    assert groups["upper"].parts[3].tolist() == [[1, 2, 3, 4]]
    assert groups["upper"].nodes.tolist() == [1, 2, 3, 4]


def test_gmsh_tags_get_their_names_from_the_field_data(tmp_path):
    path = tmp_path / "m.vtu"
    body(cell_data={"gmsh:physical": [np.array([7, 8]), np.array([1, 0])]}).write(path, binary=False)
    array = '<DataArray type="Int64" Name="{}" NumberOfComponents="2" format="ascii">{}</DataArray>'
    names = array.format("wall", "7 2") + array.format("lower", "1 3")
    path.write_text(
        path.read_text().replace("<UnstructuredGrid>", f"<UnstructuredGrid><FieldData>{names}</FieldData>")
    )
    groups = read_mesh(path, ("tetra",)).groups
    assert {name: list(group.parts) for name, group in groups.items()} == {
        "wall": [2],
        "physical_2_8": [2],
        "lower": [3],
    }


def test_sets_of_abaqus_are_groups(tmp_path):
    path = tmp_path / "m.inp"
    path.write_text(
        "*NODE\n10, 0, 0, 0\n20, 1, 0, 0\n30, 0, 1, 0\n40, 0, 0, 1\n50, 1, 1, 1\n"
        "*ELEMENT, TYPE=C3D4, ELSET=body\n1, 10, 20, 30, 40\n2, 20, 30, 40, 50\n"
        "*NSET, NSET=held\n10, 30\n*ELSET, ELSET=upper\n2\n"
    )
    groups = read_mesh(path, ("tetra",)).groups
    assert groups["held"].nodes.tolist() == [0, 2]
    assert groups["held"].parts == {}
    assert groups["upper"].parts[3].tolist() == [[1, 2, 3, 4]]
    assert len(groups["body"].parts[3]) == 2


def test_families_of_med_are_groups(tmp_path):
    mesh = body(cell_data={"cell_tags": [np.array([-6, -6]), np.array([-7, -8])]})
    mesh.cell_tags = {-6: ["wall"], -7: ["body"], -8: ["body", "upper"]}
    mesh.write(tmp_path / "m.med")
    groups = read_mesh(tmp_path / "m.med", ("tetra",)).groups
    assert {name: {d: len(parts) for d, parts in group.parts.items()} for name, group in groups.items()} == {
        "wall": {2: 2},
        "body": {3: 2},
        "upper": {3: 1},
    }


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("m.vtu", "<VTKFile", "meshio cannot read it"),
        ("m.vtk", "# vtk DataFile Version 9.9\n", "meshio cannot read it"),
        ("m.inp", "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n", "the file holds no nodes"),
        ("m.bdf", "nothing\n", "the file holds no GRID"),
        ("m.inp", "*HEADING\n", "the file holds no nodes"),
        ("m.inp", "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4\n", "found no cells, expected tetra cells"),
        ("m.doc", "words", "not a format meshes are read from: found '.doc', expected one of .msh .vtu"),
    ],
)
def test_files_meshio_cannot_read_are_errors_and_nothing_is_printed(tmp_path, capfd, name, text, message):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(MeshError, match=message) as error:
        read_mesh(path, ("tetra",))
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


def test_a_plane_mesh_gets_a_third_coordinate(tmp_path):
    square = meshio.Mesh(np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]), [("quad", [[0, 1, 2, 3]])])
    square.write(tmp_path / "m.xdmf")
    mesh = read_mesh(tmp_path / "m.xdmf", ("quad",), element="2412")
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_cells_in_several_sets_are_counted_once(tmp_path):
    body(cell_sets={"a": [[0, 1], [0, 1]], "b": [[], [0]]}).write(tmp_path / "m.vtu")
    with pytest.raises(MeshError, match="found 2 tetra, expected hexahedron"):
        read_mesh(tmp_path / "m.vtu", ("hexahedron",))


class Foreign:
    """What a reader of meshio might hand over."""

    def __init__(self, **changes):
        mesh = body(**changes.pop("made", {}))
        self.points, self.cells, self.cell_sets, self.point_sets = mesh.points, mesh.cells, {}, {}
        self.cell_data, self.point_data, self.field_data = {}, {}, {}
        self.__dict__.update(changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"point_sets": {"held": np.array([0, 5])}},
            "the set held names 1 members that are not there, first 6: expected 1 to 5",
        ),
        (
            {"point_sets": {"held": np.array([-1])}},
            "the set held names 1 members that are not there, first 0: expected 1 to 5",
        ),
        (
            {"cell_sets": {"half": [[0], [2]]}},
            "the set half names 1 members that are not there, first 3: expected 1 to 2",
        ),
        ({"cell_sets": {"half": [[0], [0], [0]]}}, "the set half speaks of 3 blocks of cells: expected 2"),
        (
            {"cells": [meshio.CellBlock("tetra", TETS + 2)]},
            "tetra 1 refers to node 6, which the file does not hold|to node 7",
        ),
        (
            {"cells": [meshio.CellBlock("tetra", TETS - 1)]},
            "tetra 1 refers to node 0, which the file does not hold",
        ),
        ({"points": np.array(CORNERS) * np.nan}, "5 nodes have coordinates that are not finite"),
    ],
)
def test_what_meshio_hands_over_is_checked(tmp_path, hands_over, changes, message):
    path = tmp_path / "m.vtu"
    path.write_text("as meshio likes it")
    hands_over(Foreign(**changes))
    with pytest.raises(MeshError, match=message):
        read_mesh(path, ("tetra",))


def test_cells_with_other_than_their_number_of_nodes(tmp_path, hands_over):
    cells = [meshio.CellBlock("tetra", TETS)]
    cells[0].data = np.hstack([TETS, TETS[:, :1]])
    (tmp_path / "m.vtu").write_text("as meshio likes it")
    hands_over(Foreign(cells=cells))
    with pytest.raises(MeshError, match="2 tetra cells with 5 nodes: expected 4 nodes"):
        read_mesh(tmp_path / "m.vtu", ("tetra",))


def test_what_meshio_leaves_out_is_an_error_or_a_note(tmp_path):
    """Marks of points that make no group are passed over; a section with cells it does not know is named."""
    path = tmp_path / "m.mesh"
    body().write(path)
    text = path.read_text()
    path.write_text(text.replace("End", "RequiredVertices\n1\n1\nEnd"))
    mesh = read_mesh(path, ("tetra",))
    assert len(mesh.cells) == 2
    assert mesh.notes[0].startswith("left out of the mesh file: ")
    assert "RequiredVertices" in mesh.notes[0]
    path.write_text(text.replace("End", "TetrahedraP2\n0\nEnd"))
    with pytest.raises(
        MeshError, match=r"meshio cannot read it .*; write it again, or in another format such as .msh"
    ) as error:
        read_mesh(path, ("tetra",))
    assert "damaged" not in str(error.value)
    path = tmp_path / "m.su2"
    path.write_text(
        "NDIME= 3\nNPOIN= 4\n0 0 0 0\n1 0 0 1\n0 1 0 2\n0 0 1 3\nNELEM= 1\n10 0 1 2 3 0\nNMARK= 0\nNONSENSE 7\n"
    )
    with pytest.raises(MeshError, match=r"meshio leaves out part of it \(.*NONSENSE"):
        read_mesh(path, ("tetra",))


@pytest.mark.parametrize("name", ["m.vtu", "m.vtk", "m.med", "m.mesh"])
def test_gmsh_or_vtk_read_the_same_volume(tmp_path, name):
    """A second reader of the same file: Gmsh where it reads the format, pyvista elsewhere."""
    from ancf_petsc.mesh.gmsh_session import gmsh_session
    from ancf_petsc.mesh.kinds import KINDS, part_sizes

    body().write(tmp_path / name)
    mesh = read_mesh(tmp_path / name, ("tetra",))
    volume = part_sizes(mesh.points, mesh.cells, KINDS["tetra"]).sum()
    if name in ("m.vtu", "m.vtk"):
        import pyvista

        grid = pyvista.read(tmp_path / name)
        grid = grid.extract_cells(grid.celltypes == 10)
        counts = len(mesh.points), len(mesh.cells), float(grid.volume)
        assert (grid.n_points, grid.n_cells) == counts[:2]
    else:
        with gmsh_session() as gmsh:
            gmsh.merge(str(tmp_path / name))
            tags = gmsh.model.mesh.getElementsByType(4)[0]
            assert len(tags) == len(mesh.cells)
            assert len(gmsh.model.mesh.getNodes()[0]) == len(mesh.points)
            counts = (0, 0, abs(float(gmsh.model.mesh.getElementQualities(tags, "volume").sum())))
    assert volume == pytest.approx(counts[2], rel=1e-12)
