"""Surfaces, edges and points of a mesh as shapes, and whether one shape lies on another.

A polyhedron approximates curved surfaces by chords: two meshes of one curved surface differ by as much as the chords leave
out. What they may differ by is therefore taken from the angles between neighbouring facets; flat surfaces have to agree to
rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ancf_petsc.mesh.groups import boundary_faces, parts_for_load
from ancf_petsc.mesh.mesh import Group, Integers, Mesh

Floats = NDArray[np.float64]
CLOSE = 1e-6
"""Points closer than this times the size of the mesh are the same."""
CREASE = np.radians(40.0)
"""Facets that meet at a larger angle meet at an edge of the body; at a smaller one they approximate a curved surface."""
CHORD = 0.5
"""Of edge times angle: an arc departs by an eighth of it from its chord; facets at odd angles to the arc by more."""
NEAREST, MOST_PAIRS = 12, 1_000_000
BLOCK = MOST_PAIRS // NEAREST


@dataclass(frozen=True)
class Simplices:
    """Parts (m, 1 to 3, 3): corners of triangles, segments or points. slack (m,): what the chords of each may leave out."""

    corners: Floats
    slack: Floats

    def __len__(self) -> int:
        return len(self.corners)

    @property
    def samples(self) -> tuple[Floats, Floats]:
        """Corners and centres of all parts (k, 3), and their slack (k,)."""
        m, c = self.corners.shape[:2]
        points = np.concatenate((self.corners.reshape(-1, 3), self.corners.mean(axis=1)))
        return points, np.concatenate((np.repeat(self.slack, c), self.slack)) if m else np.empty(0)


def triangles(faces: Integers) -> Integers:
    """Triangles (t, 3) of triangles or quadrilaterals (m, 3 or 4)."""
    if faces.shape[1] == 3:
        return faces
    return np.concatenate((faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]))


def normals(points: Floats, facets: Integers) -> Floats:
    """Unit normals (t, 3) of triangles (t, 3)."""
    a, b, c = (points[facets[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    return across / np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]


class BoundarySurface:
    """The boundary of a solid mesh: facets (t, 3), indices of points, counterclockwise from outside; normals (t, 3), slack (t,)."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.facets = triangles(boundary_faces(mesh))
        self.normals = normals(mesh.points, self.facets)
        at_nodes = self._at_nodes(
            self._slack()
        )  # a facet between edges of the body may have no neighbour that says it is curved
        self.slack = at_nodes[self.facets].max(axis=1)

    @property
    def shape(self) -> Simplices:
        """All of it."""
        return Simplices(self.mesh.points[self.facets], self.slack)

    def _slack(self) -> Floats:
        edges = np.stack([self.facets, np.roll(self.facets, -1, axis=1)], axis=-1).reshape(-1, 2)
        length = np.linalg.norm(self.mesh.points[edges[:, 0]] - self.mesh.points[edges[:, 1]], axis=1)
        low, high = edges.min(axis=1), edges.max(axis=1)
        _, which = np.unique(low * len(self.mesh.points) + high, return_inverse=True)
        order = np.argsort(which, kind="stable")
        pairs = np.flatnonzero(which[order][1:] == which[order][:-1])
        one, other = order[pairs], order[pairs + 1]
        cosine = np.einsum("ij,ij->i", self.normals[one // 3], self.normals[other // 3])
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        angle[angle > CREASE] = 0.0
        longest = length.reshape(-1, 3).max(axis=1)
        slack = np.zeros(len(self.facets))
        for side in (one // 3, other // 3):
            np.maximum.at(slack, side, CHORD * angle * longest[side])
        return slack

    def at_nodes(self) -> Floats:
        """(points,) slack of the facets around each node."""
        return self._at_nodes(self.slack)

    def _at_nodes(self, slack: Floats) -> Floats:
        found = np.zeros(len(self.mesh.points))
        for k in range(3):
            np.maximum.at(found, self.facets[:, k], slack)
        return found

    def of_group(self, group: Group) -> Simplices:
        """What a load or a support of a group takes of it: faces, else edges, else points."""
        dimension, parts = parts_for_load(self.mesh, group)
        if dimension == 3:
            dimension, parts = 0, group.nodes
        parts = triangles(parts) if dimension == 2 else parts.reshape(len(parts), -1)[:, :2]
        return Simplices(self.mesh.points[parts], self.at_nodes()[parts].max(axis=1, initial=0.0))


def departure(points: Floats, slack: Floats, target: Simplices, size: float) -> tuple[float, int]:
    """How far points (k, 3) lie off a shape beyond the slack of both, relative to `size`, at most, and which point does."""
    if not len(target):
        return np.inf, 0
    pairs = _candidates(points, target)
    blocks = [slice(k, k + BLOCK) for k in range(0, len(points), BLOCK)]
    excess = np.concatenate([_excess(points[own], slack[own], target, pairs[own]) for own in blocks])
    again = np.flatnonzero(excess > CLOSE * size)
    rows = max(1, MOST_PAIRS // len(target))
    for k in range(0, len(again), rows):  # the nearest centres need not be of the nearest part
        some = again[k : k + rows]
        every = np.broadcast_to(np.arange(len(target)), (len(some), len(target)))
        excess[some] = _excess(points[some], slack[some], target, every)
        if excess[some].max() > CLOSE * size:
            break
    worst = int(excess.argmax())
    return float(excess[worst]) / size, worst


def _candidates(points: Floats, target: Simplices) -> Integers:
    count = min(NEAREST, len(target))
    _, found = cKDTree(target.corners.mean(axis=1)).query(points, k=count)
    return found.reshape(len(points), count)


def _excess(points: Floats, slack: Floats, target: Simplices, candidates: Integers) -> Floats:
    distance = _distances(points[:, None], target.corners[candidates])
    return (distance - target.slack[candidates]).min(axis=1) - slack


def _distances(points: Floats, parts: Floats) -> Floats:
    """Distances of points (k, 1, 3) to parts (k, c, corners, 3)."""
    corners = parts.shape[2]
    if corners == 1:
        return np.linalg.norm(points - parts[:, :, 0], axis=2)
    pairs = [(0, 1)] if corners == 2 else [(0, 1), (1, 2), (2, 0)]
    nearest = np.min([_to_segment(points, parts[:, :, i], parts[:, :, j]) for i, j in pairs], axis=0)
    if corners == 2:
        return nearest
    a, b, c = (parts[:, :, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=2), 1e-300)
    inside = np.ones(nearest.shape, bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= np.einsum("kci,kci->kc", np.cross(end - start, points - start), normal) >= 0
    height = np.abs(np.einsum("kci,kci->kc", points - a, normal)) / length
    return np.where(inside, height, nearest)


def _to_segment(points: Floats, a: Floats, b: Floats) -> Floats:
    along = b - a
    square = np.maximum(np.einsum("kci,kci->kc", along, along), 1e-300)
    place = np.clip(np.einsum("kci,kci->kc", points - a, along) / square, 0.0, 1.0)
    return np.linalg.norm(points - a - place[..., None] * along, axis=2)
