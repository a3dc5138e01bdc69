"""Ordinary text files read in this process are what Gmsh reads in them; all others are left to Gmsh."""

from pathlib import Path

import numpy as np
import pytest
from tiny_meshes import TWO, write_two_bricks

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.assemble import assemble
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.mesh.gmsh_file import read_gmsh
from ancf_petsc.mesh.msh_text import read_ordinary

MESHES = sorted((Path(__file__).parent.parent / "meshes").glob("*.msh"))
BODIES = ("tetra10", "hexahedron", "tetra", "quad", "triangle", "line")


def assert_as_gmsh_reads_it(path):
    """Numbers, points, cells and groups, to the last bit."""
    ours, theirs = read_ordinary(path), read_gmsh(path)
    assert ours is not None
    kinds = {block.kind for block in theirs.blocks}
    body = next(kind for kind in BODIES if kind in kinds)
    one, other = (assemble(raw, path, (body,), "keep", "3413") for raw in (ours, theirs))
    for name in ("points", "cells", "node_numbers", "cell_numbers", "used"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert list(one.groups) == list(other.groups)
    for name, group in one.groups.items():
        assert np.array_equal(group.nodes, other.groups[name].nodes), name
        assert list(group.parts) == list(other.groups[name].parts)
        for dimension, parts in group.parts.items():
            assert np.array_equal(parts, other.groups[name].parts[dimension]), name


@pytest.mark.parametrize("path", MESHES, ids=lambda path: path.stem)
def test_meshes_of_the_project(path):
    assert_as_gmsh_reads_it(path)


@pytest.mark.parametrize(("version", "save_all"), [(2.2, False), (2.2, True), (4.1, False), (4.1, True)])
def test_cells_in_several_groups_and_in_none(tmp_path, version, save_all):
    assert_as_gmsh_reads_it(
        write_two_bricks(tmp_path / "two.msh", version=version, binary=False, save_all=save_all)
    )


@pytest.mark.parametrize("version", ["2.2", "4.1"])
@pytest.mark.parametrize(
    "how", [{"size": 0.03}, {"size": 0.04, "order": 2}, {"divisions": (2, 2, 3), "hexahedra": True}]
)
def test_every_kind_of_cell(tmp_path, version, how):
    assert_as_gmsh_reads_it(make_mesh("cube", tmp_path / "cube.msh", version=version, **how))


def test_numbers_with_gaps_and_unused_nodes(tmp_path):
    path = tmp_path / "two.msh"
    path.write_text(TWO.replace("99 5 5 5", "99 5 5 5e0"))
    mesh = read_ordinary(path)
    assert mesh is not None
    assert mesh.node_numbers.tolist() == read_gmsh(path).node_numbers.tolist()
    path.write_bytes(TWO.replace("\n", "\r\n").encode())
    assert read_ordinary(path).node_numbers.tolist() == mesh.node_numbers.tolist()


@pytest.mark.parametrize("version", [2.2, 4.1])
def test_what_is_not_ordinary_is_left_to_gmsh(tmp_path, version):
    binary = write_two_bricks(tmp_path / "binary.msh", version=version, binary=True)
    assert read_ordinary(binary) is None
    whole = write_two_bricks(tmp_path / "whole.msh", version=version, binary=False).read_bytes()
    path = tmp_path / "cut.msh"
    for end in np.linspace(0, len(whole) - 2, 60).astype(int):
        path.write_bytes(whole[:end])
        assert read_ordinary(path) is None
    path.write_bytes(whole.replace(b"$EndNodes", b"$EndNodes\n$Unheard\n1\n$EndUnheard"))
    assert read_ordinary(path) is None


@pytest.mark.parametrize("version", [2.2, 4.1])
def test_sections_that_say_nothing_of_the_mesh_are_passed_over(tmp_path, version):
    path = write_two_bricks(tmp_path / "whole.msh", version=version, binary=False)
    cells = len(read_ordinary(path).blocks)
    path.write_text(path.read_text() + "$Periodic\n0\n$EndPeriodic\n$NodeData\n1\n\xe4\n$EndNodeData\n")
    assert len(read_ordinary(path).blocks) == cells


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize(
    ("mark", "line"),
    [("$EndNodes", "900 0 0 0"), ("$EndElements", "900 4 2 1 1 1 2 3 4"), ("$EndElements", "7")],
)
def test_a_line_too_many_is_an_error_with_the_count(tmp_path, version, mark, line):
    """Gmsh would drop the last cell without a word."""
    path = write_two_bricks(tmp_path / "whole.msh", version=version, binary=False)
    path.write_text(path.read_text().replace(mark, f"{line}\n{mark}"))
    with pytest.raises(
        MeshError, match=rf"\{mark.replace('End', '')} holds \d+ lines: expected \d+ as its first line"
    ):
        read_ordinary(path)


@pytest.mark.parametrize("section", ["Nodes", "Elements"])
@pytest.mark.parametrize("version", [2.2, 4.1])
def test_a_count_that_is_wrong_is_an_error(tmp_path, version, section):
    path = write_two_bricks(tmp_path / "whole.msh", version=version, binary=False)
    head, mark, tail = path.read_text().partition(f"${section}\n")
    counts, _, rest = tail.partition("\n")
    words = counts.split()
    place = 1 if version > 4 else 0
    words[place] = str(int(words[place]) + 1)
    path.write_text(f"{head}{mark}{' '.join(words)}\n{rest}")
    with pytest.raises(MeshError, match=rf"\${section} holds \d+ lines: expected \d+"):
        read_ordinary(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("99 5 5 5", "41 5 5 5", "1 node numbers are given twice, first node 41"),
        ("8 4 2 2 1", "4 4 2 2 1", "1 element numbers are given twice, first element 4"),
        ("9 15 2 3", "3 15 2 3", "1 element numbers are given twice, first element 3"),
    ],
)
def test_a_number_given_twice_is_an_error(tmp_path, old, new, message):
    assert old in TWO
    path = tmp_path / "odd.msh"
    path.write_text(TWO.replace(old, new))
    with pytest.raises(MeshError, match=message):
        read_ordinary(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("4 4 2 1 1", "4 4 0 1 1"),
        ("4 4 2", "4 99 2"),
    ],
)
def test_what_does_not_fit_is_left_to_gmsh(tmp_path, old, new):
    """An element without tags, a kind nobody knows."""
    assert old in TWO
    path = tmp_path / "odd.msh"
    path.write_text(TWO.replace(old, new))
    assert read_ordinary(path) is None
