"""Nodal vectors whose unknowns are components in a frame of their own: those that are held along a direction that is no axis.

Vectors of unknowns (positions, velocities, forces, residuals, drives) have the components of these frames everywhere. Kernels,
masses and results have those of the axes: what passes between both goes through here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Frames:
    """vectors (k,): ascending local nodal vectors with a frame. axes (k, 3, 3): its directions, as columns."""

    vectors: NDArray[np.int64]
    axes: Floats

    def __bool__(self) -> bool:
        return len(self.vectors) > 0

    def to_axes(self, field: Floats) -> Floats:
        """A field (n, 3) or (v, 3) of unknowns with components along the axes, in place."""
        return self._turn(field, "kij,kj->ki")

    def to_frames(self, field: Floats) -> Floats:
        """A field (n, 3) or (v, 3) along the axes with components of unknowns, in place."""
        return self._turn(field, "kji,kj->ki")

    def _turn(self, field: Floats, how: str) -> Floats:
        if not self:
            return field
        count = int(np.searchsorted(self.vectors, len(field)))
        chosen = self.vectors[:count]
        if count:
            field[chosen] = np.einsum(how, self.axes[:count], field[chosen])
        return field


class TurnedBlocks:
    """The 3 x 3 blocks of a layout that a frame touches, as places among its numbers (b, 3, 3).

    frames: of local nodal vectors. rows, columns, starts, strides (b,): of blocks of owned rows. driven (v, 3): of unknowns.
    """

    def __init__(
        self, frames: Frames, blocks: tuple[NDArray, NDArray, NDArray, NDArray], driven: NDArray
    ) -> None:
        index = np.full(len(driven), -1, np.int64)
        index[frames.vectors] = np.arange(len(frames.vectors))
        rows, columns, starts, strides = blocks
        touched = (index[rows] >= 0) | (index[columns] >= 0)
        rows, columns = rows[touched], columns[touched]
        axes = np.concatenate((frames.axes, np.eye(3)[None]))
        self._left, self._right = axes[index[rows]], axes[index[columns]]
        self._free = (~driven[rows])[:, :, None] & (~driven[columns])[:, None, :]
        inner = np.arange(3)
        self._places = (
            starts[touched, None, None] + strides[touched, None, None] * inner[:, None] + inner[None, :]
        )

    def turn(self, values: Floats) -> None:
        """Blocks along the axes become those of unknowns, without driven rows and columns. In place."""
        blocks = np.einsum("bki,bkl,blj->bij", self._left, values[self._places], self._right)
        values[self._places] = np.where(self._free, blocks, 0.0)
