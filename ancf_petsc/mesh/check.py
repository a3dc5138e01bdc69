"""What `ancf check` and `ancf mesh` tell about a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ancf_petsc.mesh.groups import measure
from ancf_petsc.mesh.kinds import KINDS, edge_lengths, part_sizes, qualities
from ancf_petsc.mesh.mesh import Floats, Integers, Mesh


@dataclass(frozen=True)
class GroupStatistics:
    """Sizes of a group.

    parts: dimension -> number of parts. measures: dimension -> their length, area or volume.
    """

    nodes: int
    parts: dict[int, int]
    measures: dict[int, float]


@dataclass(frozen=True)
class MeshStatistics:
    """Sizes of a mesh. Quality is the mean ratio: 1 for a regular cell, 0 for a flat one.

    box: (2, 3) lowest and highest coordinates of the nodes in use. volume: area or length of a plane body
    or of lines. worst_cell: number in the file. pieces: how many unconnected bodies.
    """

    nodes: int
    unused_nodes: int
    cells: int
    kind: str
    volume: float
    box: Floats
    worst_quality: float
    mean_quality: float
    worst_cell: int
    shortest_edge: float
    longest_edge: float
    pieces: int
    groups: dict[str, GroupStatistics]


def statistics(mesh: Mesh) -> MeshStatistics:
    """Sizes, quality and groups of a mesh."""
    kind = KINDS[mesh.kind]
    corners = mesh.cells[:, : kind.corners]
    quality = qualities(mesh.points, corners, kind)
    shortest, longest = edge_lengths(mesh.points, corners, kind)
    body = mesh.points[mesh.used]
    worst = int(quality.argmin())
    return MeshStatistics(
        nodes=len(mesh.points),
        unused_nodes=int(np.count_nonzero(~mesh.used)),
        cells=len(mesh.cells),
        kind=mesh.kind,
        volume=float(part_sizes(mesh.points, corners, kind).sum()),
        box=np.stack([body.min(axis=0), body.max(axis=0)]),
        worst_quality=float(quality[worst]),
        mean_quality=float(quality.mean()),
        worst_cell=int(mesh.cell_numbers[worst]),
        shortest_edge=float(shortest.min()),
        longest_edge=float(longest.max()),
        pieces=connected_pieces(mesh.cells, len(mesh.points))[0],
        groups={name: _group_statistics(mesh, name) for name in mesh.groups},
    )


def _group_statistics(mesh: Mesh, name: str) -> GroupStatistics:
    group = mesh.groups[name]
    return GroupStatistics(
        nodes=len(group.nodes),
        parts={dimension: len(parts) for dimension, parts in group.parts.items()},
        measures={
            dimension: measure(mesh, dimension, parts)
            for dimension, parts in group.parts.items()
            if dimension
        },
    )


def connected_pieces(cells: Integers, n_points: int) -> tuple[int, Integers]:
    """How many pieces cells (e, k) form through shared nodes, and the piece of each point (n,).

    Pieces are numbered by their lowest point; points no cell uses are in piece -1.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    first = np.repeat(cells[:, 0], cells.shape[1] - 1)
    others = cells[:, 1:].ravel()
    graph = coo_matrix((np.ones(len(first), dtype=bool), (first, others)), shape=(n_points, n_points))
    _, label = connected_components(graph.tocsr(), directed=False)
    used = np.zeros(n_points, dtype=bool)
    used[cells] = True
    _, first_point, piece = np.unique(label[used], return_index=True, return_inverse=True)
    rank = np.empty(len(first_point), dtype=np.int64)
    rank[np.argsort(first_point)] = np.arange(len(first_point))
    labels = np.full(n_points, -1, dtype=np.int64)
    labels[used] = rank[piece]
    return len(first_point), labels
