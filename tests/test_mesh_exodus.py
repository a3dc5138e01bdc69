"""Exodus files: blocks, node sets and side sets by their names, numbers, orders of nodes; damage is said."""

from __future__ import annotations

import numpy as np
import pytest
from decks import BAR_KINDS, FORCE, bar, pulled

from ancf_petsc.errors import EnvironmentProblem, MeshError
from ancf_petsc.mesh.exodus import SIDES
from ancf_petsc.mesh.groups import measure
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.read import read_mesh

netCDF4 = pytest.importorskip("netCDF4")


def words(data, name: str, dimension: str, given: list[bytes]) -> None:
    variable = data.createVariable(name, "S1", (dimension, "len_string"))
    for row, word in enumerate(given):
        variable[row] = np.array([bytes([letter]) for letter in word.ljust(33, b"\0")], dtype="S1")


def write(
    path, body, title: str = "TET4", *, names=(b"rubber", b"bottom", b"lid"), sides="top", form="NETCDF4"
):
    """The bar in one block, its lower nodes as a node set, its upper faces as a side set."""
    kind = BAR_KINDS[title]
    rows = np.searchsorted(body.numbers, body.nodes)
    inside = np.isin(body.nodes, body.sets[sides])
    found = [
        (e, s)
        for e in range(len(rows))
        for s, corners in enumerate(SIDES[kind])
        if inside[e, list(corners)].all()
    ]
    with netCDF4.Dataset(path, "w", format=form) as data:
        sizes = {
            "len_string": 33,
            "num_dim": 3,
            "num_nodes": len(body.numbers),
            "num_elem": len(rows),
            "num_el_blk": 1,
        }
        sizes |= {
            "num_el_in_blk1": len(rows),
            "num_nod_per_el1": rows.shape[1],
            "num_node_sets": 1,
            "num_side_sets": 1,
        }
        sizes |= {"num_nod_ns1": len(body.sets["bottom"]), "num_side_ss1": len(found)}
        for name, size in sizes.items():
            data.createDimension(name, size)
        for axis, name in enumerate(("coordx", "coordy", "coordz")):
            data.createVariable(name, "f8", ("num_nodes",))[:] = body.points[:, axis]
        data.createVariable("connect1", "i4", ("num_el_in_blk1", "num_nod_per_el1"))[:] = rows + 1
        data["connect1"].elem_type = title
        data.createVariable("node_num_map", "i4", ("num_nodes",))[:] = body.numbers
        data.createVariable("elem_num_map", "i4", ("num_elem",))[:] = body.elements
        nodes = np.searchsorted(body.numbers, body.sets["bottom"]) + 1
        data.createVariable("node_ns1", "i4", ("num_nod_ns1",))[:] = nodes
        data.createVariable("elem_ss1", "i4", ("num_side_ss1",))[:] = [e + 1 for e, _ in found]
        data.createVariable("side_ss1", "i4", ("num_side_ss1",))[:] = [s + 1 for _, s in found]
        for name, dimension in (
            ("eb_prop1", "num_el_blk"),
            ("ns_prop1", "num_node_sets"),
            ("ss_prop1", "num_side_sets"),
        ):
            data.createVariable(name, "i4", (dimension,))[:] = [10]
        for name, dimension, word in zip(
            ("eb_names", "ns_names", "ss_names"),
            ("num_el_blk", "num_node_sets", "num_side_sets"),
            names,
            strict=True,
        ):
            words(data, name, dimension, [word])
    return path


@pytest.mark.parametrize("form", ["NETCDF4", "NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET"])
@pytest.mark.parametrize("title", ["TET4", "HEX8", "TETRA", "HEX"])
def test_blocks_and_sets_are_groups_with_the_file_s_numbers(tmp_path, title, form):
    body = bar(tetrahedra=title.startswith("TET"))
    mesh = read_mesh(write(tmp_path / "bar.exo", body, title, form=form), (BAR_KINDS[title],))
    assert mesh.node_numbers.tolist() == body.numbers.tolist()
    assert mesh.cell_numbers.tolist() == body.elements.tolist()
    assert mesh.node_numbers[mesh.cells].tolist() == body.nodes.tolist()
    assert mesh.node_numbers[mesh.groups["bottom"].nodes].tolist() == body.sets["bottom"]
    assert mesh.node_numbers[mesh.groups["lid"].nodes].tolist() == body.sets["top"]
    assert measure(mesh, 2, mesh.groups["lid"].parts[2]) == pytest.approx(0.01, rel=1e-12)
    assert len(mesh.groups["rubber"].parts[3]) == len(body.elements)
    assert mesh.notes == []


def test_names_that_are_missing_come_from_the_number(tmp_path):
    path = write(tmp_path / "bar.e", bar(), names=(b"", b"", b""))
    assert list(read_mesh(path, ("tetra",)).groups) == ["block_10", "nodeset_10", "sideset_10"]


@pytest.mark.parametrize("kind", [kind for kind in SIDES if KINDS[kind].dimension == 3])
def test_sides_close_a_cell(kind):
    edges = [(side[k], side[(k + 1) % len(side)]) for side in SIDES[kind] for k in range(len(side))]
    assert sorted(edges) == sorted((b, a) for a, b in edges)
    assert len(set(edges)) == len(edges)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("node_ns1", 99, "node_ns1 names what is not there: found 99, expected 1 to 12"),
        ("elem_ss1", 99, "elem_ss1 names what is not there: found 99, expected 1 to 12"),
        ("side_ss1", 5, "side set lid names side 5 of a tetra"),
        ("connect1", 99, "connect1 names what is not there"),
    ],
)
def test_members_that_are_not_there_are_errors(tmp_path, name, value, message):
    path = write(tmp_path / "bar.exo", bar())
    with netCDF4.Dataset(path, "a") as data:
        data[name][0] = value
    with pytest.raises(MeshError, match=message):
        read_mesh(path, ("tetra",))


def test_files_that_are_no_exodus_and_a_missing_package(tmp_path, monkeypatch):
    path = tmp_path / "bar.exo"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(MeshError, match=r"netCDF4 cannot read it .*; write the mesh again as Exodus"):
        read_mesh(path, ("tetra",))
    with netCDF4.Dataset(path, "w") as data:
        data.createDimension("x", 1)
    with pytest.raises(MeshError, match=r"not a mesh of Exodus \(KeyError: 'num_nodes'\)"):
        read_mesh(path, ("tetra",))
    (tmp_path / "netCDF4.py").write_text("raise ImportError('not installed')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(
        EnvironmentProblem,
        match=r"netCDF4 cannot be loaded \(not installed\); install it: pip install netCDF4",
    ):
        read_mesh(path, ("tetra",))


def test_the_force_on_the_bar_is_the_one_in_closed_form(tmp_path):
    body = bar()
    write(tmp_path / "bar.exo", body)
    groups = {"left": {"plane": "x", "at": "min"}, "front": {"plane": "y", "at": "min"}}
    names = {"top": "lid"}
    assert pulled(tmp_path, tmp_path / "bar.exo", names=names, groups=groups) == pytest.approx(
        FORCE, rel=1e-9
    )
