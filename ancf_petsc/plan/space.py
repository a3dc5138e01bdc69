"""Nodes and nodal vectors of an element on a mesh: tables of the root rank."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.element.shape import ElementTables
from ancf_petsc.errors import MeshError
from ancf_petsc.kernel.revolution import Revolution, linear, radii_of
from ancf_petsc.kernel.tables import map_functions, nodes_with_slopes, slope_maps
from ancf_petsc.mesh.kinds import part_kind, part_sizes
from ancf_petsc.mesh.mesh import Mesh
from ancf_petsc.mesh.parts import rows_in

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
STRAIGHT = 1e-9
"""A body farther than this times its size from the plane or line it should lie in is refused."""


class Space:
    """n nodes in use, v nodal vectors, e cells of a mesh that is complete (`mesh.complete`).

    nodes (n,): index of each node in the mesh's points; compact (points,): the inverse, -1 for nodes not in use.
    cells (e, k): nodes of the cells. first (n + 1,): first nodal vector of each node, its position; its slopes follow.
    axes (3, d): directions the body lies along. frames (n, 3, 3): columns are the directions of the slopes of each node.
    lengths (n,): what a slope is multiplied with to be a nodal vector: the size of the cells around the node, so that
    all nodal vectors are lengths and all that works on them forces. revolution: of a body whose section the mesh is.
    """

    def __init__(self, mesh: Mesh, element: Element) -> None:
        self.mesh, self.element = mesh, element
        self.nodes = np.flatnonzero(mesh.used)
        self.compact = np.full(len(mesh.points), -1, np.int64)
        self.compact[self.nodes] = np.arange(len(self.nodes))
        self.cells = self.compact[mesh.cells]
        counts = np.ones(len(self.nodes), np.int64)
        if element.has_slopes:
            counts[self.cells[:, : len(element.cell.corners)]] = element.corner
        self.first = np.concatenate(([0], np.cumsum(counts)))
        self.axes = self._axes()
        self.revolution: Revolution | None = None
        self.frames = self._default_frames() if element.has_slopes else None
        self.lengths = self._lengths() if element.has_slopes else None

    @property
    def vectors(self) -> int:
        """How many nodal vectors there are."""
        return int(self.first[-1])

    @property
    def positions(self) -> Integers:
        """(n,) the nodal vector that is the position of each node."""
        return self.first[:-1]

    @property
    def points(self) -> Floats:
        """(n, 3) undeformed positions of the nodes."""
        return self.mesh.points[self.nodes]

    def node_of(self) -> Integers:
        """(v,) the node of each nodal vector."""
        return np.repeat(np.arange(len(self.nodes)), np.diff(self.first))

    def slots(self) -> NDArray[np.int8]:
        """(v,) 0 for a position, j for the j-th slope."""
        return (np.arange(self.vectors) - self.first[self.node_of()]).astype(np.int8)

    def reference(self) -> Floats:
        """(v, 3) nodal vectors of the undeformed body."""
        values = np.empty((self.vectors, 3))
        values[self.positions] = self.points
        if self.frames is not None and self.lengths is not None:
            with_slopes = np.flatnonzero(np.diff(self.first) > 1)
            for j in range(self.axes.shape[1]):
                slopes = self.lengths[with_slopes, None] * self.frames[with_slopes, :, j]
                values[self.first[with_slopes] + 1 + j] = slopes
        return values

    def shares(self, dimension: int, parts: Integers) -> Floats:
        """Share (v,) of each nodal vector in a sum spread evenly over parts (m, corners) of a dimension."""
        shares = np.zeros(self.vectors)
        if dimension == 0:
            shares[self.first[self.compact[parts]]] = 1.0 / len(parts)
            return shares
        sizes = self.sizes(dimension, parts)
        for cells, rows, tables in self._places_of(dimension, parts):
            weights = tables.weights / tables.weights.sum()
            means = map_functions(
                self._densities(cells, tables) * weights @ tables.values, self._maps(cells), self.element
            )
            vectors = self.first[self.cells[cells][:, self.element.node]] + self.element.slot
            np.add.at(shares, vectors, sizes[rows, None] / sizes.sum() * means)
        return shares

    def sizes(self, dimension: int, parts: Integers) -> Floats:
        """Undeformed length, area or volume (m,) of parts (m, corners); of a body of revolution of what they sweep."""
        sizes = np.abs(part_sizes(self.mesh.points, parts, part_kind(dimension, parts.shape[1])))
        if self.revolution is None:
            return sizes
        radii = self.mesh.points[parts, self.revolution.radial].mean(axis=1)
        return self.revolution.angle * radii * sizes

    def _densities(self, cells: Integers, tables: ElementTables) -> Floats:
        """(m, q) what points of cells count, 1 on the mean: in a body of revolution their radii."""
        if self.revolution is None:
            return np.ones((1, len(tables.weights)))
        radii = radii_of(self._geometry(cells), self.axes, self.revolution.radial) @ linear(tables.points).T
        means = radii @ tables.weights / tables.weights.sum()
        return radii / np.where(means > 0.0, means, 1.0)[:, None]

    def _places_of(self, dimension: int, parts: Integers) -> list[tuple[Integers, Integers, ElementTables]]:
        """Where parts lie in cells: (cells, rows of parts, shape functions on that place of the cell), place by place."""
        cell = self.element.cell
        corners = self.mesh.cells[:, : len(cell.corners)]
        places = {cell.dimension: [tuple(range(len(cell.corners)))], cell.dimension - 1: cell.facets}.get(
            dimension, cell.edges
        )
        marked = np.zeros(len(self.mesh.points), bool)
        marked[parts] = True
        inside = marked[corners]
        candidates = [np.flatnonzero(inside[:, place].all(axis=1)) for place in places]
        rows = np.concatenate(
            [corners[cells][:, place] for cells, place in zip(candidates, places, strict=True)]
        )
        found = rows_in(parts, rows, len(self.mesh.points))
        if (found < 0).any():
            raise MeshError(
                f"{int((found < 0).sum())} of the group's {len(parts)} facets are not a face or edge of any element",
                file=self.mesh.source,
                key="mesh.file",
                cure="mesh the group and the body together",
            )
        starts = np.cumsum([0, *(len(cells) for cells in candidates)])
        answer = []
        for k, place in enumerate(places):
            here = np.flatnonzero((found >= starts[k]) & (found < starts[k + 1]))
            if len(here):
                answer.append((candidates[k][found[here] - starts[k]], here, self._tables(place)))
        return answer

    def _tables(self, place: tuple[int, ...]) -> ElementTables:
        """Shape functions on the whole cell or on a part of it."""
        if len(place) == len(self.element.cell.corners):
            return self.element.tables("mass")
        return self.element.part_tables(place, self.element.degree + (self.revolution is not None))

    def _maps(self, cells: Integers) -> Floats:
        """(e, s, 3, 3) of some cells; see `slope_maps`."""
        s, d = nodes_with_slopes(self.element), self.axes.shape[1]
        if not s:
            return np.zeros((len(cells), 0, 3, 3))
        nodes = self.cells[cells, :s]
        assert self.frames is not None
        assert self.lengths is not None
        directions = self.lengths[nodes, None, None] * np.swapaxes(self.frames[nodes], 2, 3)[:, :, :d]
        return slope_maps(self._geometry(cells).jacobian, self.axes, directions)

    def _geometry(self, cells: Integers | slice):
        corners = self.mesh.points[self.mesh.cells[cells, : len(self.element.cell.corners)]]
        return self.element.geometry(corners @ self.axes, self.mesh.cell_numbers[cells])

    def _lengths(self) -> Floats:
        """(n,) mean over the cells around of the d-th root of det J."""
        sizes = self._geometry(slice(None)).determinant ** (1.0 / self.element.cell.dimension)
        corners = self.cells[:, : len(self.element.cell.corners)]
        repeated = np.repeat(sizes, corners.shape[1])
        n = len(self.nodes)
        count = np.bincount(corners.ravel(), minlength=n)
        return np.bincount(corners.ravel(), repeated, minlength=n) / np.maximum(count, 1)

    def _default_frames(self) -> Floats:
        """The axes, and what is perpendicular to them after."""
        frame = np.eye(3)
        if self.axes.shape[1] < 3:
            full, _ = np.linalg.qr(np.hstack((self.axes, np.eye(3))))
            frame = np.hstack((self.axes, full[:, self.axes.shape[1] : 3]))
        return np.tile(frame, (len(self.nodes), 1, 1))

    def _axes(self) -> Floats:
        """(3, d): all axes; the two of a plane body, right-handed about its normal; the direction of a line."""
        d = self.element.cell.dimension
        if d == 3:
            return np.eye(3)
        arms = self.points - self.points.mean(axis=0)
        tolerance = STRAIGHT * self.mesh.size
        if d == 2:
            normal = int(np.ptp(arms, axis=0).argmin())
            off, where = np.ptp(arms[:, normal]), "in a plane x-y, y-z or z-x"
            axes = np.eye(3)[:, [(normal + 1) % 3, (normal + 2) % 3]]
        else:
            ends = self.points[self.cells[0, :2]]
            axes = ((ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0]))[:, None]
            off, where = np.abs(arms - arms @ axes @ axes.T).max(), "on a straight line"
        if off > tolerance:
            raise MeshError(
                f"the body leaves its {'plane' if d == 2 else 'line'} by {off:.3g}",
                file=self.mesh.source,
                key="mesh.file",
                expected=f"all nodes {where} for element {self.element.code}",
                cure="turn the mesh",
            )
        return axes


def nearby_origin(points: Floats, size: float) -> Floats:
    """(3,) a point about which bodies far from the file's origin are computed; the origin itself for those near it.

    Its coordinates are multiples of a power of two of at least the body's size, so that those of the body pass through
    the shift without rounding. points (n, 3) in use.
    """
    grid = 2.0 ** np.ceil(np.log2(size))
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.round(centre / grid) * grid
