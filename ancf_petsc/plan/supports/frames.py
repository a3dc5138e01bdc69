"""Frames of nodes that are held along directions that are no axes.

What is prescribed at a node is a set of directions, each with the displacement along it: axes, and normals of planes. Made
perpendicular one after the other, axes first, they are directions of the node's frame, whose components are driven; the
others stay free. Where a direction depends on those before, the displacement must be what these say already.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.model.drive import HELD, Drive

Floats = NDArray[np.float64]
PARALLEL = 1e-6
"""A direction depends on others when its part across them is smaller."""
SAME = 1e-9
"""Displacements are the same when they differ by less than this part of the largest."""


class Wanted(NamedTuple):
    """A displacement along a unit vector (3,). name: what asks for it."""

    direction: Floats
    drive: Drive
    name: str


class Contradiction(Exception):
    """wanted: what cannot be had beside those before it, and why in words."""

    def __init__(self, wanted: Wanted, why: str) -> None:
        super().__init__(why)
        self.wanted, self.why = wanted, why


class NodeFrame(NamedTuple):
    """axes (3, 3): perpendicular unit vectors as columns. drives: of each component, None where it is free."""

    axes: Floats
    drives: tuple[Drive | None, ...]

    @property
    def is_global(self) -> bool:
        """Whether it is that of the axes."""
        return np.array_equal(self.axes, np.eye(3))


def frame_of(wanted: Sequence[Wanted]) -> NodeFrame:
    """The frame of a node from all that is prescribed there, axes before other directions. Raises Contradiction."""
    axes, parts = np.zeros((3, 3)), list[list[Drive] | None]([None, None, None])
    largest = max((abs(item.drive.amplitude) for item in wanted), default=0.0)
    for item in wanted:
        shares = item.direction @ axes
        rest = item.direction - axes @ shares
        length = float(np.linalg.norm(rest))
        left = [
            item.drive,
            *(Drive(-c * d.amplitude, d.ramp) for c, p in zip(shares, parts, strict=True) for d in p or ()),
        ]
        if length < PARALLEL:
            if any(abs(drive.amplitude) > SAME * largest for drive in _summed(left, largest)):
                raise Contradiction(item, "other supports move these nodes along it")
            continue
        place = _column(rest / length, parts)
        axes[:, place] = rest / length
        parts[place] = _summed([Drive(drive.amplitude / length, drive.ramp) for drive in left], largest)
        if len(parts[place] or ()) > 1:
            raise Contradiction(item, "two ramps would move these nodes across each other")
    drives = tuple(None if part is None else (part or [HELD])[0] for part in parts)
    return NodeFrame(_completed(axes, [part is not None for part in parts]), drives)


def _summed(drives: Sequence[Drive], largest: float) -> list[Drive]:
    """One drive for each ramp, without those that come to nothing."""
    found: list[Drive] = []
    for drive in drives:
        same = next((k for k, other in enumerate(found) if other.ramp == drive.ramp), None)
        if same is None:
            found.append(drive)
        else:
            found[same] = Drive(found[same].amplitude + drive.amplitude, drive.ramp)
    return [drive for drive in found if abs(drive.amplitude) > 1e-3 * SAME * largest]


def _column(direction: Floats, parts: Sequence[list[Drive] | None]) -> int:
    """Of the columns that are left, the one of the axis that is nearest to the direction."""
    left = [i for i in range(3) if parts[i] is None]
    return max(left, key=lambda i: abs(direction[i]))


def _completed(axes: Floats, taken: Sequence[bool]) -> Floats:
    """Free columns perpendicular to those that are taken, near the axes."""
    found, left = axes.copy(), [i for i in range(3) if not taken[i]]
    if len(left) == 3:
        return np.eye(3)
    if len(left) == 2:
        i = left.pop(0)
        rest = np.eye(3)[i] - found @ found[i]
        found[:, i] = rest / np.linalg.norm(rest)
    for i in left:
        across = np.cross(found[:, (i + 1) % 3], found[:, (i + 2) % 3])
        found[:, i] = across / np.linalg.norm(across)
    return found
