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


def measures(points: NDArray, dimension: int, parts: NDArray) -> NDArray[np.float64]:
    """Length, area or volume of simplices (m, dimension + 1), or of quadrilaterals (m, 4) as two triangles; 1 for points."""
    corners = points[parts]
    if dimension == 0:
        return np.ones(len(parts))
    if dimension == 1:
        return np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    if dimension == 2:
        area = (
            np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        )
        if parts.shape[1] == 4:
            area += (
                np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 0]), axis=1)
                / 2
            )
        return area
    edges = corners[:, 1:4] - corners[:, :1]
    return np.abs(np.linalg.det(edges)) / 6


def linear_shares(points: NDArray, dimension: int, parts: NDArray) -> NDArray[np.float64]:
    """Share (n,) of each node in a total spread evenly over simplices, by their linear shape functions."""
    size = measures(points, dimension, parts)
    corners = parts.shape[1]
    weights = np.bincount(parts.ravel(), np.repeat(size / corners, corners), minlength=len(points))
    return weights / size.sum()
