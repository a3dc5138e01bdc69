"""Rigid motions that supports leave free, against the rank of the motions at the driven degrees of freedom."""

from __future__ import annotations

import numpy as np
import pytest

from ancf_petsc.plan.free_motion import free_motions


def freedom(points: np.ndarray, driven: np.ndarray) -> int:
    """How many rigid motions move no driven degree of freedom: 6 less the rank of u = t + w x r there."""
    rows = []
    for point, held in zip(points - points.mean(axis=0), driven, strict=True):
        turning = np.array([np.cross(axis, point) for axis in np.eye(3)]).T
        rows += list(np.hstack((np.eye(3), turning))[held])
    return 6 - (np.linalg.matrix_rank(np.array(rows), tol=1e-9) if rows else 0)


@pytest.mark.parametrize("seed", range(40))
def test_as_many_are_free_as_the_rank_leaves(seed):
    """Some degrees of freedom of nodes at random, on one plane or edge in half of the cases."""
    generator = np.random.default_rng(seed)
    points = generator.uniform(-1.0, 1.0, (12, 3))
    driven = np.zeros((12, 3), bool)
    chosen = generator.choice(12, generator.integers(1, 4), replace=False)
    driven[chosen] = generator.random((len(chosen), 3)) < 0.7
    if seed % 2:
        points[chosen, generator.integers(3)] = 0.25
    found = free_motions(points, driven, np.zeros(12, int), 1)
    assert len(found.get(0, [])) == freedom(points, driven)


def test_three_components_at_three_nodes_leave_nothing():
    """The classic support: a node held, a second one across an edge, a third one out of the plane."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.2, 1.0]])
    driven = np.array([[1, 1, 1], [0, 1, 1], [0, 0, 1], [0, 0, 0]], bool)
    assert free_motions(points, driven, np.zeros(4, int), 1) == {}
    driven[2, 2] = False
    (name,) = free_motions(points, driven, np.zeros(4, int), 1)[0]
    words, _, place = name.partition(" through ")
    assert words == "rotation about the axis along x"
    assert [float(word) for word in place.strip("()").split(",")][1:] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_each_piece_is_looked_at_alone():
    """Two bodies, one hinged along an edge parallel to y, the other free to slide along z."""
    points = np.array(
        [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1], [5, 0, 0], [6, 0, 0], [5, 1, 0], [5, 0, 1]], float
    )
    driven = np.zeros((8, 3), bool)
    driven[:2] = True
    driven[4:, :2] = True
    found = free_motions(points, driven, np.repeat([0, 1], 4), 2)
    assert list(found) == [0, 1]
    assert [name.partition(" through")[0] for name in found[0]] == ["rotation about the axis along y"]
    assert found[1] == ["translation along z"]
