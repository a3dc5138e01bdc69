"""A section swept about its axis: tetrahedra of a sector between two planes through the axis."""

from __future__ import annotations

import numpy as np

from ancf_petsc.mesh.kinds import KINDS, part_sizes
from ancf_petsc.mesh.mesh import Group, Integers, Mesh
from ancf_petsc.reduce.revolution import Ring
from ancf_petsc.reduce.shape import CLOSE, Floats

STEEPEST = np.radians(5.0)
"""The largest angle of a layer: its chords leave out a sixth of its square, 0.13 percent, of the volume."""


def swept(section: Mesh, ring: Ring, angle: float, radial: int, axial: int, walls: tuple[str, str]) -> Mesh:
    """Tetrahedra of the sector from the ring's start on by an angle; its planes are the groups `walls`.

    section: triangles, radius and height along two axes. Lines of its groups become faces, points edges around the axis.
    """
    radius, height = section.points[:, radial], section.points[:, axial] - ring.point @ ring.axis
    radius = np.where(np.abs(radius) <= CLOSE * section.size, 0.0, radius)
    layers = _layers(section, radius, angle)
    angles = np.linspace(0.0, angle, layers + 1)
    around = np.cos(angles)[:, None] * ring.start + np.sin(angles)[:, None] * ring.across
    points = ring.point + radius[:, None] * around[:, None] + height[:, None] * ring.axis
    numbers = _numbers(radius, layers)
    count = int(numbers.max()) + 1
    places = np.empty((count, 3))
    places[numbers.ravel()] = points.reshape(-1, 3)
    cells = _positive(places, _simplices(section.cells, numbers))
    groups = {name: _group(name, group, numbers) for name, group in section.groups.items()}
    for name, layer in zip(walls, (0, layers), strict=True):
        rows = numbers[layer][section.cells]
        groups[name] = Group(name, np.unique(rows), {2: rows})
    return Mesh(
        points=places,
        kind="tetra",
        cells=cells,
        groups=groups,
        node_numbers=1 + np.arange(count),
        cell_numbers=1 + np.arange(len(cells)),
        used=np.ones(count, bool),
    )


def _layers(section: Mesh, radius: Floats, angle: float) -> int:
    """Layers as thick, at the middle of the body, as its triangles are wide, and none of a larger angle than STEEPEST."""
    sizes = np.abs(part_sizes(section.points, section.cells, KINDS["triangle"]))
    across = np.sqrt(4.0 / np.sqrt(3.0) * sizes.mean())
    middle = sizes @ radius[section.cells].mean(axis=1) / sizes.sum()
    return max(1, round(angle * middle / across), int(np.ceil(angle / STEEPEST - CLOSE)))


def _numbers(radius: Floats, layers: int) -> Integers:
    """(layers + 1, n) numbers of the points of the section in each layer; those on the axis are the same in all."""
    off = radius > 0
    numbers = np.zeros((layers + 1, len(radius)), np.int64)
    numbers[:, ~off] = np.arange((~off).sum())
    numbers[:, off] = (~off).sum() + np.arange((layers + 1) * off.sum()).reshape(layers + 1, -1)
    return numbers


def _simplices(parts: Integers, numbers: Integers) -> Integers:
    """Points, lines or triangles (m, k) swept through all layers, as simplices (s, k + 1).

    Each climbs from a layer to the next corner by corner in ascending order, so that neighbours divide common faces alike. Where
    corners are on the axis some have no content, and are left out.
    """
    ordered = np.sort(parts, axis=1)
    found = []
    for low, high in zip(numbers, numbers[1:], strict=False):
        for k in range(ordered.shape[1]):
            found.append(np.hstack((low[ordered[:, : k + 1]], high[ordered[:, k:]])))
    simplices = np.concatenate(found)
    corners = np.sort(simplices, axis=1)
    return simplices[(corners[:, 1:] != corners[:, :-1]).all(axis=1)]


def _positive(points: Floats, cells: Integers) -> Integers:
    """Tetrahedra with their corners in the order of a positive volume."""
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    wrong = np.linalg.det(edges) < 0
    return np.where(wrong[:, None], cells[:, [0, 2, 1, 3]], cells)


def _group(name: str, group: Group, numbers: Integers) -> Group:
    """The group of a section swept with it."""
    dimension = max(group.parts)
    rows = _simplices(group.parts[dimension], numbers)
    return Group(name, np.unique(rows), {dimension + 1: rows})
