"""The boundary of a body as triangles that know their groups, cut by planes and closed again."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.mesh.groups import parts_for_load, parts_for_support
from ancf_petsc.mesh.mesh import Integers, Mesh
from ancf_petsc.mesh.parts import rows_in, unique_rows
from ancf_petsc.reduce.caps import cap
from ancf_petsc.reduce.shape import CLOSE, CREASE, BoundarySurface, Floats, normals, triangles
from ancf_petsc.reduce.symmetry import MirrorPlane

SNAP = 0.45
"""Nodes nearer to the plane than this part of an edge move along it onto the plane, so that no slivers are left."""
ALONG = float(np.sin(CREASE))
"""A node moves only in the surface: not by more than this part of its way out of any of the facets around it."""


@dataclass
class Skin:
    """points (n, 3); facets (t, 3), seen from outside counterclockwise; group -> which facets (t,), lines (m, 2), nodes (k,)."""

    points: Floats
    facets: Integers
    faces: dict[str, NDArray[np.bool_]] = field(default_factory=dict)
    lines: dict[str, Integers] = field(default_factory=dict)
    nodes: dict[str, Integers] = field(default_factory=dict)

    @property
    def volume(self) -> float:
        """What it encloses."""
        a, b, c = (self.points[self.facets[:, k]] for k in range(3))
        return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def skin_of(mesh: Mesh) -> Skin:
    """The boundary of a mesh with its groups: as the faces a support or a load takes, else as lines, else as nodes."""
    surface = BoundarySurface(mesh)
    skin = Skin(mesh.points.copy(), surface.facets)
    for name, group in mesh.groups.items():
        parts = dict(group.parts)
        if not parts:
            dimension, rows = parts_for_load(mesh, group)
            parts = {dimension: rows} if dimension else parts_for_support(mesh, group)
        if 2 in parts:
            own = triangles(parts[2])
            inside = np.zeros(len(surface.facets), bool)
            places = rows_in(own, surface.facets, len(mesh.points))
            inside[places[places >= 0]] = True
            skin.faces[name] = inside
        if 1 in parts:
            skin.lines[name] = parts[1][:, :2]
        covered = np.concatenate([np.empty(0, np.int64), *(rows.ravel() for d, rows in parts.items() if d)])
        alone = np.intersect1d(np.setdiff1d(group.nodes, covered), surface.facets)
        if len(alone) and not {1, 2} & set(parts):
            skin.nodes[name] = alone
    return skin


def clip(skin: Skin, plane: MirrorPlane, name: str) -> Skin:
    """What of a skin is on the side of a plane's normal, closed by a cap in the plane, whose facets are the group `name`."""
    size = float(np.ptp(skin.points[skin.facets].reshape(-1, 3), axis=0).max())
    points = _snapped(skin, plane, size)
    heights = plane.heights(points)
    heights[np.abs(heights) <= CLOSE * size] = 0.0
    points -= np.where(heights == 0.0, plane.heights(points), 0.0)[:, None] * plane.normal
    points, made = _with_crossings(points, heights, skin.facets)
    heights = np.concatenate((heights, np.zeros(len(points) - len(heights))))
    facets, parent = _kept_facets(skin.facets, heights, made)
    covers, corners = cap(points, facets, plane)
    points = np.concatenate((points, corners))
    result = Skin(points, np.concatenate((facets, covers)))
    for group, inside in skin.faces.items():
        result.faces[group] = np.concatenate((inside[parent], np.zeros(len(covers), bool)))
    result.faces[name] = np.arange(len(result.facets)) >= len(facets)
    for group, lines in skin.lines.items():
        result.lines[group] = _kept_lines(lines, heights, made)
    for group, nodes in skin.nodes.items():
        result.nodes[group] = nodes[heights[nodes] >= 0]
    return result


def _edges(facets: Integers) -> Integers:
    """(3 t, 2) edges of facets, the lower node first."""
    return np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)


def _snapped(skin: Skin, plane: MirrorPlane, size: float) -> Floats:
    """Points with those near the plane moved onto it, along edges of the surface and of its features."""
    points, heights = skin.points, plane.heights(skin.points)
    edges = unique_rows(_edges(skin.facets), len(points))
    crossing = edges[heights[edges].prod(axis=1) < -((CLOSE * size) ** 2)]
    pairs = np.concatenate((crossing, crossing[:, ::-1]))
    part = heights[pairs[:, 0]] / (heights[pairs[:, 0]] - heights[pairs[:, 1]])
    bound = _feature_keys(skin)
    is_feature = np.isin(_keys(np.sort(pairs, axis=1), len(points)), bound)
    held = np.zeros(len(points), bool)
    held[np.concatenate([np.unravel_index(bound, (len(points),) * 2)[k] for k in range(2)])] = True
    held[np.concatenate([np.empty(0, np.int64), *skin.nodes.values()])] = True
    good = (part < SNAP) & (is_feature | ~held[pairs[:, 0]])
    good &= ~np.isin(pairs[:, 0], np.concatenate([np.empty(0, np.int64), *skin.nodes.values()]))
    pairs, part = pairs[good], part[good]
    order = np.argsort(part, kind="stable")
    nodes, first = np.unique(pairs[order, 0], return_index=True)
    chosen = order[first]
    way = part[chosen, None] * (points[pairs[chosen, 1]] - points[nodes])
    moved = points.copy()
    moved[nodes] += way
    return _without_damage(skin, points, moved)


def _without_damage(skin: Skin, points: Floats, moved: Floats) -> Floats:
    """Moved points; those stay whose move leaves the surface or turns a facet over."""
    before = normals(points, skin.facets)
    way = moved - points
    length = np.linalg.norm(way, axis=1)
    out = np.abs(np.einsum("tij,tj->ti", way[skin.facets], before)) > ALONG * length[skin.facets]
    stay = np.unique(skin.facets[out])
    while len(stay):
        moved[stay] = points[stay]
        after = normals(moved, skin.facets)
        wrong = np.einsum("ij,ij->i", before, after) < np.cos(CREASE)
        changed = skin.facets[wrong].ravel()
        stay = np.unique(changed[(moved[changed] != points[changed]).any(axis=1)])
    return moved


def _keys(edges: Integers, bound: int) -> Integers:
    return edges[:, 0] * bound + edges[:, 1]


def _feature_keys(skin: Skin) -> Integers:
    """Keys of edges that a node must not leave: of the body, between facets of different groups, of lines of groups."""
    edges, bound = _edges(skin.facets), len(skin.points)
    keys = _keys(edges, bound)
    order = np.argsort(keys, kind="stable")
    pairs = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    one, other = order[pairs] // 3, order[pairs + 1] // 3
    unit = normals(skin.points, skin.facets)
    sharp = np.einsum("ij,ij->i", unit[one], unit[other]) < np.cos(CREASE)
    for inside in skin.faces.values():
        sharp |= inside[one] != inside[other]
    lines = [np.sort(rows, axis=1) for rows in skin.lines.values()]
    return np.unique(np.concatenate([keys[order[pairs[sharp]]], *(_keys(rows, bound) for rows in lines)]))


def _with_crossings(points: Floats, heights: Floats, facets: Integers) -> tuple[Floats, tuple[Integers, int]]:
    """Points with a new one on every edge that crosses the plane; the keys of these edges, ascending, and the first new point."""
    edges = unique_rows(_edges(facets), len(points))
    crossing = edges[heights[edges].prod(axis=1) < 0]
    keys = np.sort(_keys(crossing, len(points)))
    a, b = np.unravel_index(keys, (len(points),) * 2)
    part = heights[a] / (heights[a] - heights[b])
    new = points[a] + part[:, None] * (points[b] - points[a])
    return np.concatenate((points, new)), (keys, len(points))


def _crossing(made: tuple[Integers, int], a: Integers, b: Integers) -> Integers:
    """The new points on edges between nodes a and b (k,)."""
    keys, first = made
    pairs = np.sort(np.stack((a, b), axis=1), axis=1)
    return first + np.searchsorted(keys, _keys(pairs, first))


def _kept_facets(facets: Integers, heights: Floats, made: tuple[Integers, int]) -> tuple[Integers, Integers]:
    """Facets on the side of the normal, those that cross the plane divided, and the facet (t,) each comes from."""
    sign = np.sign(heights[facets]).astype(int)
    above, below = (sign > 0).sum(axis=1), (sign < 0).sum(axis=1)
    whole = np.flatnonzero((below == 0) & (above > 0))
    found, parents = [facets[whole]], [whole]

    def turned(rows: Integers, first: Integers) -> Integers:
        return facets[rows[:, None], (first[:, None] + np.arange(3)) % 3]

    rows = np.flatnonzero((above == 1) & (below == 1))  # the third corner lies on the plane
    a, b, c = turned(rows, (sign[rows] > 0).argmax(axis=1)).T
    follows = heights[b] < 0
    point = np.where(
        follows, _crossing(made, a, np.where(follows, b, a)), _crossing(made, a, np.where(follows, a, c))
    )
    found.append(np.stack((a, np.where(follows, point, b), np.where(follows, c, point)), axis=1))
    parents.append(rows)
    rows = np.flatnonzero((above == 1) & (below == 2))
    a, b, c = turned(rows, (sign[rows] > 0).argmax(axis=1)).T
    found.append(np.stack((a, _crossing(made, a, b), _crossing(made, a, c)), axis=1))
    parents.append(rows)
    rows = np.flatnonzero((above == 2) & (below == 1))
    a, b, c = turned(rows, (sign[rows] < 0).argmax(axis=1)).T
    ab, ca = _crossing(made, a, b), _crossing(made, a, c)
    found += [np.stack((ab, b, c), axis=1), np.stack((ab, c, ca), axis=1)]
    parents += [rows, rows]
    return np.concatenate(found), np.concatenate(parents)


def _kept_lines(lines: Integers, heights: Floats, made: tuple[Integers, int]) -> Integers:
    sign = np.sign(heights[lines])
    whole = lines[(sign >= 0).all(axis=1)]
    divided = lines[(sign.prod(axis=1) < 0)]
    if not len(divided):
        return whole
    upper = np.where(heights[divided[:, 0]] > 0, divided[:, 0], divided[:, 1])
    return np.concatenate((whole, np.stack((upper, _crossing(made, *divided.T)), axis=1)))
