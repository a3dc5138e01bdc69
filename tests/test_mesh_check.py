"""Statistics of a mesh."""

import numpy as np
import pytest
from tiny_meshes import grid, part, tetrahedra

from ancf_petsc.mesh.check import connected_pieces, statistics
from ancf_petsc.mesh.kinds import KINDS, qualities

REGULAR = np.array([(0, 0, 0), (1, 0, 0), (0.5, np.sqrt(3) / 2, 0), (0.5, np.sqrt(3) / 6, np.sqrt(2 / 3))])


def test_a_regular_cell_has_quality_1_at_any_size_and_place():
    tetra = np.arange(4)[None]
    assert qualities(1e-6 * REGULAR + 1, tetra, KINDS["tetra"]) == pytest.approx(1, abs=1e-8)
    assert qualities(REGULAR, tetra, KINDS["tetra"]) == pytest.approx(1, abs=1e-15)
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)])
    assert qualities(square, np.arange(4)[None], KINDS["quad"]) == pytest.approx(1, abs=1e-15)
    assert qualities(REGULAR, np.arange(3)[None], KINDS["triangle"]) == pytest.approx(1, abs=1e-15)


def test_quality_is_the_mean_ratio():
    """12 (3 V)^(2/3) over the sum of the squares of the edges."""
    points = np.random.default_rng(1).normal(size=(4, 3))
    edges = points[[1, 2, 3, 2, 3, 3]] - points[[0, 0, 0, 1, 1, 2]]
    volume = abs(np.linalg.det(edges[:3])) / 6
    expected = 12 * (3 * volume) ** (2 / 3) / (edges**2).sum()
    assert qualities(points, np.arange(4)[None], KINDS["tetra"]) == pytest.approx(expected, rel=1e-13)


def test_statistics_of_a_box():
    mesh = grid(3, 2, 1)
    found = statistics(mesh)
    assert (found.nodes, found.unused_nodes, found.cells, found.kind, found.pieces) == (24, 0, 36, "tetra", 1)
    assert found.volume == pytest.approx(6, rel=1e-14)
    assert found.box.tolist() == [[0, 0, 0], [3, 2, 1]]
    assert (found.shortest_edge, found.longest_edge) == pytest.approx((1, np.sqrt(3)), rel=1e-15)
    # 12 (3/6)^(2/3) / (3 * 1 + 2 * 2 + 3), each of the six has the same edges.
    assert found.worst_quality == pytest.approx(1.2 * 0.5 ** (2 / 3), rel=1e-13)
    assert found.mean_quality == pytest.approx(found.worst_quality, rel=1e-13)


def test_the_worst_cell_has_its_number_in_the_file():
    points = [*REGULAR, (0.5, np.sqrt(3) / 6, -0.1)]
    found = statistics(tetrahedra(points, [(0, 1, 2, 3), (0, 2, 1, 4)]))
    assert found.worst_cell == 101
    assert found.longest_edge == pytest.approx(1)


def test_statistics_of_groups():
    blocks = [
        part("line", [(10, 11)], "mixed"),
        part("triangle", [(10, 12, 11)], "mixed"),
        part("vertex", [(14,)], "tip"),
    ]
    groups = statistics(tetrahedra(blocks=blocks)).groups
    assert (groups["mixed"].nodes, groups["mixed"].parts) == (3, {1: 1, 2: 1})
    assert groups["mixed"].measures == {1: 1.0, 2: 0.5}
    assert (groups["tip"].nodes, groups["tip"].parts, groups["tip"].measures) == (1, {0: 1}, {})


def test_pieces_are_numbered_by_their_lowest_node():
    cells = np.array([(8, 9, 6, 7), (1, 2, 3, 4), (4, 3, 2, 5)])
    count, label = connected_pieces(cells, 11)
    assert count == 2
    assert label.tolist() == [-1, 0, 0, 0, 0, 0, 1, 1, 1, 1, -1]
