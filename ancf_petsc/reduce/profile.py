"""The section of a body of revolution: where a half-plane through the axis meets its surface, as closed lines of radius and height.

Facets are chords: the line is taken in cylindrical coordinates, in which a chord between nodes at one radius stays at it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.groups import parts_for_support
from ancf_petsc.mesh.mesh import Integers
from ancf_petsc.mesh.parts import rows_in
from ancf_petsc.reduce.revolution import WHOLE, Ring, on_walls
from ancf_petsc.reduce.shape import CLOSE, Floats, triangles
from ancf_petsc.reduce.symmetry import SceneModel

PLACES = np.linspace(0.31, 0.69, 39)
"""Parts of the sector at which it may be cut; the one farthest from all nodes is taken."""


@dataclass
class Profile:
    """points (n, 2): radius and height. segments (m, 2). sizes (n,): length of edges of the body there.

    lines: group -> which segments (m,). marks: group -> indices of points.
    """

    points: Floats
    segments: Integers
    sizes: Floats
    lines: dict[str, Floats] = field(default_factory=dict)
    marks: dict[str, Integers] = field(default_factory=dict)


def profile_of(scene: SceneModel, ring: Ring) -> Profile:
    """The section of a scene that is a sector of a ring."""
    return _Cut(scene, ring).profile()


class _Cut:
    """A half-plane through the axis among the facets (t, 3) of the surface that are not on the planes bounding the sector.

    radius, height, beyond (n,): of the mesh's points; the last is the angle from the half-plane, in (-pi, pi].
    """

    def __init__(self, scene: SceneModel, ring: Ring) -> None:
        self.scene, self.ring, self.mesh = scene, ring, scene.mesh
        self.facets = scene.surface.facets[~on_walls(scene, ring)]
        self.radius, angle, self.height = ring.coordinates(self.mesh.points)
        self.on_axis = self.radius <= CLOSE * scene.size
        off = np.unique(self.facets)
        off = off[~self.on_axis[off]]
        apart = [np.abs(_wrapped(angle[off] - part * ring.angle)).min() for part in PLACES]
        self.beyond = _wrapped(angle - PLACES[int(np.argmax(apart))] * ring.angle)

    def profile(self) -> Profile:
        """Closed lines; those that begin and end on the axis are closed along it."""
        edges = np.stack([self.facets, np.roll(self.facets, -1, axis=1)], axis=-1).reshape(-1, 2)
        crosses = self._crosses(edges)
        keys = edges.min(axis=1) * len(self.mesh.points) + edges.max(axis=1)
        known, first = np.unique(keys[crosses], return_index=True)
        points, sizes = self._points(edges[crosses][first])
        place = np.full(len(edges), -1)
        place[crosses] = np.searchsorted(known, keys[crosses])
        ends = place.reshape(-1, 3)
        count = (ends >= 0).sum(axis=1)
        whole = np.flatnonzero(count == 2)
        segments = np.stack(
            [ends[whole].max(axis=1), np.where(ends[whole] >= 0, ends[whole], len(known)).min(axis=1)], axis=1
        )
        last = np.flatnonzero(count == 1)
        tips, heights = self._tips(last)
        names, which = np.unique(tips, return_inverse=True)
        tip_points = np.zeros((len(names), 2))
        tip_points[which, 1] = heights
        tip_sizes = np.zeros(len(names))
        tip_sizes[which] = sizes[ends[last].max(axis=1)]
        segments = np.concatenate((segments, np.stack([ends[last].max(axis=1), len(known) + which], axis=1)))
        points, sizes = np.concatenate((points, tip_points)), np.concatenate((sizes, tip_sizes))
        along = self._along_axis(tip_points[:, 1], len(known))
        result = Profile(points, np.concatenate((segments, along)), sizes)
        self._name(result, np.concatenate((whole, last)), known, len(along))
        result.points[:, 1] += float(self.ring.point @ self.ring.axis)
        return result

    def _crosses(self, edges: Integers) -> Floats:
        a, b = self.beyond[edges[:, 0]], self.beyond[edges[:, 1]]
        off = ~self.on_axis[edges].any(axis=1)
        return off & ((a > 0) != (b > 0)) & (np.abs(a - b) < np.pi)

    def _points(self, edges: Integers) -> tuple[Floats, Floats]:
        """Radius and height (k, 2) where edges cross the half-plane, and their lengths."""
        a, b = self.beyond[edges[:, 0]], self.beyond[edges[:, 1]]
        part = (a / (a - b))[:, None]
        ends = np.stack((self.radius, self.height), axis=1)[edges]
        length = np.linalg.norm(self.mesh.points[edges[:, 0]] - self.mesh.points[edges[:, 1]], axis=1)
        return ends[:, 0] + part * (ends[:, 1] - ends[:, 0]), length

    def _tips(self, rows: Integers) -> tuple[Integers, Floats]:
        """Where facets meet the axis: a number for each place (k,), and its height."""
        facets = self.facets[rows]
        has_node = self.on_axis[facets].any(axis=1)
        node = facets[np.arange(len(rows)), self.on_axis[facets].argmax(axis=1)]
        a, b, c = (self.mesh.points[facets[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        slope = np.where(np.abs(normal @ self.ring.axis) > 0, normal @ self.ring.axis, 1.0)
        pierced = np.einsum("ki,ki->k", normal, a - self.ring.point) / slope
        return np.where(has_node, node, len(self.mesh.points) + rows), np.where(
            has_node, self.height[node], pierced
        )

    def _along_axis(self, heights: Floats, first: int) -> Integers:
        """Segments on the axis that are in the body: between the first and the second place from below, and so on."""
        if len(heights) % 2:
            raise CaseError("the surface meets the axis an odd number of times", key="--to", got="section")
        order = first + np.argsort(heights)
        return order.reshape(-1, 2)

    def _name(self, result: Profile, facets: Integers, known: Integers, more: int) -> None:
        """Enter the groups: faces as lines, edges around the axis and nodes on it as points."""
        bound, rows = len(self.mesh.points), self.facets[facets]
        for name, group in self.mesh.groups.items():
            parts = parts_for_support(self.mesh, group)
            if 2 in parts:
                inside = rows_in(rows, triangles(parts[2]), bound) >= 0
                if inside.any():
                    result.lines[name] = np.concatenate((inside, np.zeros(more, bool)))
            elif 1 in parts:
                pairs = np.sort(parts[1][:, :2], axis=1)
                pairs = pairs[self._crosses(pairs)]
                place = np.searchsorted(known, pairs[:, 0] * bound + pairs[:, 1])
                if len(pairs):
                    result.marks[name] = np.unique(place)


def _wrapped(angle: Floats) -> Floats:
    """Angles in (-pi, pi]."""
    return np.pi - (np.pi - angle) % WHOLE
