"""Planes of symmetry among what a case holds: flat sides on which exactly the component normal to them is held.

Reflected in such a side a body goes on, and its deformation gradient there is its own mirror image: F_nt = 0, as on every side
held along its normal, and F_tn = 0. A flat support without friction is the same: where no shear acts on it, an isotropic
law leaves the slope across it without tangential components.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.mesh.check import connected_pieces
from ancf_petsc.mesh.parts import row_keys

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
FLAT = 1e-6
"""Points closer to a plane than this times the size of the mesh lie in it."""


class Mirror(NamedTuple):
    """A plane of symmetry: its axis, and its nodes as indices of points. group: that is held."""

    group: str
    normal: int
    nodes: Integers


class Held(NamedTuple):
    """What one constraint does to sides (m, corners), indices of points: components it drives, those of them that rest."""

    group: str
    components: frozenset[int]
    resting: frozenset[int]
    sides: Integers


class Sheared(NamedTuple):
    """Sides (m, corners) that a force acts on; components of the force."""

    components: frozenset[int]
    sides: Integers


def planes_of_symmetry(
    points: Floats, size: float, across: int | None, held: Sequence[Held], sheared: Sequence[Sheared]
) -> list[Mirror]:
    """The planes of symmetry of a case. points (n, 3), size of the mesh; across: the axis a plane body does not move along.

    A constraint makes one of each connected piece of its sides that lies in a plane normal to an axis, where that component
    rests and no constraint drives another one on its sides and no force acts along them.
    """
    kept = [row for row in held if len(row.sides)]
    acting = [row for row in sheared if len(row.sides)]
    if not kept:
        return []
    rows = [row.sides for row in kept] + [force.sides for force in acting]
    known, index = np.unique(row_keys(np.concatenate(rows), len(points)), return_inverse=True)
    places = np.split(index, np.cumsum([len(row) for row in rows])[:-1])
    driven, forced = np.zeros((len(known), 3), bool), np.zeros((len(known), 3), bool)
    for row, place in zip(kept, places, strict=False):
        driven[place[:, None], sorted(row.components)] = True
    for force, place in zip(acting, places[len(kept) :], strict=True):
        forced[place[:, None], sorted(force.components)] = True
    if across is not None:
        driven[:, across] = forced[:, across] = False
    mirrors = []
    for row, place in zip(kept, places, strict=False):
        for normal in sorted(row.resting - {across}):
            others = [i for i in range(3) if i != normal]
            alone = ~(driven[place][:, others] | forced[place][:, others]).any(axis=1)
            nodes = _flat_nodes(points, FLAT * size, normal, row.sides, alone)
            if len(nodes):
                mirrors.append(Mirror(row.group, normal, nodes))
    return mirrors


def _flat_nodes(
    points: Floats, slack: float, normal: int, sides: Integers, alone: NDArray[np.bool_]
) -> Integers:
    """Nodes of those pieces of the sides that lie in a plane normal to an axis and hold no component along it.

    alone (m,): sides on which nothing but the normal component is held or loaded; the nodes of others are left out.
    """
    count, label = connected_pieces(sides, len(points))
    piece = label[sides[:, 0]]
    heights = points[sides, normal]
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, piece, heights.min(axis=1))
    np.maximum.at(high, piece, heights.max(axis=1))
    good = alone & (high - low <= slack)[piece]
    inside = np.zeros(len(points), bool)
    inside[sides[good]] = True
    inside[sides[~alone]] = False
    return np.flatnonzero(inside)
