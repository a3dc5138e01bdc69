"""Bodies of revolution: a mesh of their section, whose cells are rings about an axis through the file's origin.

Cells are affine, so the undeformed radius is R = c_0 + sum_k c_k xi_k in each of them, and what an angle of the ring has of a cell
is angle det(J) R per area of the reference cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.cell import Geometry
from ancf_petsc.element.element import Element
from ancf_petsc.kernel.interface import Floats
from ancf_petsc.kernel.tables import make_tables


@dataclass(frozen=True)
class Revolution:
    """radial, axis: indices of the radial direction and of the axis. angle: of the ring that is computed, in radians."""

    radial: int
    axis: int
    angle: float

    @property
    def normal(self) -> int:
        """Index of the direction across the section, that of the hoop."""
        return 3 - self.radial - self.axis


class RingCells(NamedTuple):
    """`Cells` of a body of revolution; volumes (e) are those of the angle that is computed.

    gradients (q, a + 1, 3): dN/dxi and, third, N itself; the last function is that of a vector added to all positions.
    fractions (q): of the area. radii (e, q): undeformed ones. weights (e, q): volumes, their sum over q is that of the cell.
    measures (e, 1 + d): coefficients of 1, xi_1, .., xi_d of the volume, taken per volume of the reference cell. radial,
    normal: as `Revolution` has them.
    """

    nodes: NDArray[np.int32]
    jacobians: Floats
    inverses: Floats
    volumes: Floats
    gradients: Floats
    fractions: Floats
    slot: NDArray[np.int32]
    base: Floats
    radii: Floats
    weights: Floats
    measures: Floats
    radial: int
    normal: int


def linear(points: Floats) -> Floats:
    """1, xi_1, .., xi_d (q, 1 + d) at points (q, d) of a reference cell."""
    return np.hstack((np.ones((len(points), 1)), points))


def radii_of(geometry: Geometry, axes: Floats, radial: int) -> Floats:
    """Coefficients (e, 1 + d) of the undeformed radius. geometry: along axes (3, d)."""
    return np.hstack(((geometry.origin @ axes[radial])[:, None], axes[radial] @ geometry.jacobian))


def ring_tables(
    element: Element, cells: Any, corners: Floats, *, revolution: Revolution, axes: Floats, **more: Any
) -> RingCells:
    """Cells of a body of revolution. corners (e, c, 3), axes (3, 2), more: as `make_tables` takes them."""
    name = quadrature_of(element, more.pop("quadrature", "default"))
    flat = make_tables(element, cells, corners, axes=axes, quadrature=name, **more)
    coefficients = radii_of(element.geometry(corners @ axes), np.asarray(axes), revolution.radial)
    tables = element.tables(name)
    radii = coefficients @ linear(tables.points).T
    measures = revolution.angle * flat.volumes[:, None] * coefficients
    weights = revolution.angle * flat.volumes[:, None] * flat.fractions * radii
    gradients = np.zeros((len(tables.points), element.functions + 1, 3))
    gradients[:, :-1, :2] = flat.gradients[..., :2]
    gradients[:, :-1, 2], gradients[:, -1, 2] = tables.values, 1.0
    return RingCells(
        flat.nodes,
        flat.jacobians,
        flat.inverses,
        weights.sum(axis=1),
        gradients,
        flat.fractions,
        flat.slot,
        np.zeros(9),
        radii,
        weights,
        measures,
        revolution.radial,
        revolution.normal,
    )


def quadrature_of(element: Element, name: str) -> str:
    """The quadrature of a body of revolution: in the hoop functions count themselves, no rule is exact there."""
    return "ring" if "ring" in element.points and name in ("default", "exact") else name
