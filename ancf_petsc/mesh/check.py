"""What `ancf check` and `ancf mesh` tell about a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
from ancf_petsc.mesh.groups import measure
from ancf_petsc.mesh.kinds import KINDS, edge_lengths, part_sizes, qualities
from ancf_petsc.mesh.mesh import Floats, Integers, Mesh

MEASURES = {1: "length", 2: "area", 3: "volume"}  # by dimension


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

    dimension: of the cells. volume: of a plane body its area, of lines their length; `measure` names it.
    box: (2, 3) lowest and highest coordinates of the nodes in use. worst_cell: number in the file. pieces: how
    many unconnected bodies.
    """

    nodes: int
    unused_nodes: int
    cells: int
    kind: str
    dimension: int
    volume: float
    box: Floats
    worst_quality: float
    mean_quality: float
    worst_cell: int
    shortest_edge: float
    longest_edge: float
    pieces: int
    groups: dict[str, GroupStatistics]

    @property
    def measure(self) -> str:
        """What `volume` is."""
        return MEASURES[self.dimension]


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
        dimension=kind.dimension,
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
    return number_pieces(np.ascontiguousarray(cells), n_points)


@kernel
def number_pieces(cells, n_points):
    """Union and find over cells (e, k): every point points to a lower one of its piece, its lowest to itself."""
    lower = np.full(n_points, -1, np.int64)
    for e in range(cells.shape[0]):
        for a in range(cells.shape[1]):
            point = cells[e, a]
            if lower[point] < 0:
                lower[point] = point
            top, other = root(lower, cells[e, 0]), root(lower, point)
            lower[max(top, other)] = min(top, other)
    count = 0
    labels = np.full(n_points, -1, np.int64)
    for point in range(n_points):
        if lower[point] == point:
            labels[point] = count
            count += 1
        elif lower[point] >= 0:
            labels[point] = labels[root(lower, point)]
    return count, labels


@register_jitable
def root(lower, point):
    """The lowest point of the piece; the way there is halved for the next who asks."""
    while lower[point] != point:
        lower[point] = lower[lower[point]]
        point = lower[point]
    return point
