"""What prescribed displacements say about slopes.

Where component i of r is prescribed on a surface, it is prescribed along the surface, so component i of the slopes tangent to
it is too; on a line that of the slope along it; in a volume that of all slopes; at a point r alone.

Constraints live in indices: the slopes of a node are taken along three perpendicular directions such that each prescribed
slope is one of them. They are the axes wherever that will do. Where no such directions exist (planes at odd angles hold different
components), all slopes of the component are held.

On a plane of symmetry the deformation gradient is that of its mirror image, so the tangential components of the slope across
the plane vanish as well; `plan/symmetry` finds these planes.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.plan.space import Space
from ancf_petsc.plan.symmetry import Mirror

Floats = NDArray[np.float64]
FLAT = 1e-8
"""Eigenvalues of the sum of tangent projectors below this are zero: facets whose normals differ by less than 1e-4 are one plane."""
ALIGNED, EXACT = 1e-8, 1e-12
"""A direction is one of the frame when its cosine is this close to 1; a frame is rotated when it is not as close as EXACT."""

Parts = dict[int, NDArray[np.int64]]


def prescribed_slopes(
    space: Space, supports: Iterable[tuple[set[int], Parts]], mirrors: Iterable[Mirror] = ()
) -> tuple[NDArray[np.bool_], int]:
    """Rotate the frames of `space` where needed. Returns (v, 3), whether a component of a slope is prescribed, and at how many
    nodes all slopes of a component are held for want of a frame.

    supports: components prescribed on parts (dimension -> corners (m, c), indices of points). mirrors: planes of symmetry.
    """
    d = space.axes.shape[1]
    tangents = np.zeros((len(space.nodes), 3, 3, 3))
    for components, parts in supports:
        for dimension, corners in parts.items():
            if dimension:
                _add_projectors(space, tangents, sorted(components), dimension, corners)
    for mirror in mirrors:
        for component in {0, 1, 2} - {mirror.normal}:
            tangents[space.compact[mirror.nodes], component, mirror.normal, mirror.normal] += 1.0
    nodes = np.flatnonzero(tangents.any(axis=(1, 2, 3)) & (np.diff(space.first) > 1))
    held = np.zeros((space.vectors, 3), bool)
    if not len(nodes):
        return held, 0
    values, vectors = np.linalg.eigh(tangents[nodes])
    rank = (values > FLAT * np.maximum(values[..., -1:], 1e-300)).sum(axis=-1)
    rank[~tangents[nodes].any(axis=(2, 3))] = 0
    # Rank 1: the direction held; rank 2: the one left free.
    mark = np.where((rank == 1)[..., None], vectors[..., -1], vectors[..., 0])
    marked = (rank == 1) | ((rank == 2) & (d == 3))
    assert space.frames is not None
    space.frames[nodes] = _frames(space, nodes, mark, marked)
    along = np.abs(np.einsum("kji,kcj->kci", space.frames[nodes], mark))
    fits = along.max(axis=-1) > 1.0 - ALIGNED
    is_mark = along > 0.5
    wanted = np.where((rank == 1)[..., None], is_mark, ~is_mark)
    wanted[(rank == d) | (marked & ~fits)] = True
    wanted[rank == 0] = False
    for slot in range(d):
        held[space.first[nodes] + 1 + slot] = wanted[:, :, slot]
    return held, int((marked & ~fits).any(axis=1).sum())


def slopes_at(space: Space, points: NDArray[np.int64]) -> NDArray[np.int64]:
    """The nodal vectors that are slopes of nodes, which are given as indices into the mesh's points."""
    nodes = space.compact[points]
    return np.flatnonzero(np.isin(space.node_of(), nodes) & (space.slots() > 0))


def _add_projectors(
    space: Space, tangents: Floats, components: list[int], dimension: int, corners: NDArray[np.int64]
) -> None:
    """Add the projectors onto parts to the corners' sums (n, component, 3, 3)."""
    x = space.mesh.points[corners]
    edge = x[:, 1] - x[:, 0]
    if dimension == 1:
        unit = edge / np.linalg.norm(edge, axis=1)[:, None]
        projectors = unit[:, :, None] * unit[:, None, :]
    elif dimension == 2:
        normal = np.cross(edge, x[:, -1] - x[:, 0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        projectors = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    else:
        projectors = np.broadcast_to(np.eye(3), (len(corners), 3, 3))
    nodes = space.compact[corners]
    for component in components:
        for c in range(corners.shape[1]):
            np.add.at(tangents[:, component], nodes[:, c], projectors)


def _frames(space: Space, nodes: NDArray[np.int64], mark: Floats, marked: NDArray[np.bool_]) -> Floats:
    """(k, 3, 3) directions of the slopes of nodes, the marked ones (k, component, 3) among them where they are perpendicular."""
    assert space.frames is not None
    default = space.frames[nodes]
    along = np.abs(np.einsum("kji,kcj->kci", default, mark)).max(axis=-1)
    rotated = (marked & (along < 1.0 - EXACT)).any(axis=1)
    if not rotated.any():
        return default
    # Distinct weights keep perpendicular marks apart, so that they are the eigenvectors of the sum.
    weights = np.array([1.0, 2.0, 4.0]) * marked[rotated]
    total = np.einsum("kc,kci,kcj->kij", weights, mark[rotated], mark[rotated])
    if space.axes.shape[1] < 3:
        normal = default[rotated][:, :, -1]
        total -= normal[:, :, None] * normal[:, None, :]
    _, frames = np.linalg.eigh(total)
    frames = frames[:, :, ::-1].copy()
    frames[np.linalg.det(frames) < 0, :, 1] *= -1.0
    result = default.copy()
    result[rotated] = frames
    return result
