"""Dead loads: consistent shares of a total force over the nodes of a group."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.system.ramp import Ramp


@dataclass(frozen=True)
class Load:
    """pattern (v, 3): force on each owned nodal vector at full load; it follows the ramp.

    acceleration: of a gravity load, None for other forces.
    """

    pattern: NDArray[np.float64]
    ramp: Ramp
    acceleration: tuple[float, float, float] | None = None


def linear_shares(total: int, parts: NDArray, sizes: NDArray) -> NDArray[np.float64]:
    """Share (total,) of each node in a sum spread evenly over parts (m, corners) of the given sizes (m,).

    Exact for simplices with linear shape functions, points included.
    """
    corners = parts.shape[1]
    weights = np.bincount(parts.ravel(), np.repeat(sizes / corners, corners), minlength=total)
    return weights / sizes.sum()
