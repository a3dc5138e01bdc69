"""The discrete problem on this rank: the body, its supports and loads, and what is measured of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.model.body import Body, Floats
from ancf_petsc.model.drive import Drive
from ancf_petsc.model.frames import Frames
from ancf_petsc.model.load import Load


@dataclass(frozen=True)
class Model(Body):
    """What a solver needs to know.

    drive (v, 3): index into drives of driven degrees of freedom, -1 where free. frames: of degrees of freedom not along the axes.
    groups: name -> owned nodal vectors of its nodes (positions).
    means: name -> (owned nodal vectors, weights): weighted means of positions over all ranks.
    """

    drive: NDArray[np.int32]
    frames: Frames
    drives: list[Drive]
    loads: list[Load]
    groups: dict[str, NDArray[np.int64]]
    means: dict[str, tuple[NDArray[np.int64], Floats]]

    def driven_bits(self) -> NDArray[np.uint8]:
        """(v,) bit i is set where component i of the nodal vector is driven, bit 3 where another rank owns it.

        None of the first for vectors with a frame: their blocks are turned before components are left out.
        """
        bits = ((self.drive >= 0) << np.arange(3)).sum(axis=1).astype(np.uint8)
        bits[self.frames.vectors] = 0
        bits[self.owned :] |= 8
        return bits
