"""Nodes that lie on one another."""

from __future__ import annotations

import numpy as np

from ancf_petsc.mesh.mesh import Floats, Integers

TOLERANCE = 1e-9
"""Nodes closer than this times the mesh size coincide."""

# An irrational direction: nodes of regular meshes do not share its planes.
DIRECTION = np.array([1.0, np.sqrt(2) / 3, np.sqrt(5) / 7]) / np.sqrt(1 + 2 / 9 + 5 / 49)


def coincident_pairs(points: Floats, distance: float) -> Integers:
    """Pairs (p, 2) of points (n, 3) not farther than `distance` apart, the smaller index first."""
    along = points @ DIRECTION
    order = np.argsort(along, kind="stable")
    along = along[order]
    pairs = [np.empty((0, 2), dtype=np.int64)]
    left = np.arange(len(points))
    step = 0
    while len(left):
        step += 1
        left = left[left + step < len(points)]
        left = left[along[left + step] - along[left] <= distance]
        first, second = order[left], order[left + step]
        near = np.linalg.norm(points[first] - points[second], axis=1) <= distance
        pairs.append(np.sort(np.stack([first[near], second[near]], axis=1), axis=1))
    return np.concatenate(pairs)


def representatives(pairs: Integers, count: int) -> Integers:
    """For each of `count` points the lowest of those it coincides with, directly or through others (n,)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs), dtype=bool), pairs.T), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    _, lowest = np.unique(label, return_index=True)
    return lowest[label]
