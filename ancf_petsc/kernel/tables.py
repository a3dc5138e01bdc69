"""What the generic kernels take of the cells of one element.

Nodal slopes are along the axes; J turns them into slopes of the reference cell, so that shape functions are
the same numbers for all cells. Plane elements are solids with a third axis that does nothing: base_33 = 1 is
plane strain, and volumes have the thickness in them. Plane stress of St Venant and Kirchhoff is plane strain
with the condensed first Lame parameter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ancf_petsc.element.element import Element

Floats = NDArray[np.float64]


class Maps(NamedTuple):
    """The affine maps X = X0 + J xi: jacobians (e, 3, 3) and inverses (e, 3, 3)."""

    jacobians: Floats
    inverses: Floats


class Reference(NamedTuple):
    """Shape functions a of the reference cell at quadrature points q.

    gradients (q, a, 3): dN/dxi. weights (q): fractions of the volume, their sum is 1. slot (a): 0 for a
    position, j for the slope along axis j. base (9,): what F has without nodal vectors.
    """

    gradients: Floats
    weights: Floats
    slot: NDArray[np.int32]
    base: Floats


class Tables(NamedTuple):
    """The arguments that all kernels take of the cells, in their order.

    cells (e, a): nodal vectors, node by node, a position before its slopes. volumes (e): undeformed volumes.
    """

    cells: NDArray[np.int32]
    maps: Maps
    volumes: Floats
    reference: Reference


def make_tables(
    element: Element,
    cells: ArrayLike,
    corners: ArrayLike,
    *,
    quadrature: str = "default",
    thickness: float = 1.0,
    numbers: ArrayLike | None = None,
) -> Tables:
    """Tables of cells (e, a) from undeformed corners (e, c, 3); `numbers` (e) are for messages.

    Raises MeshError for cells that cannot be computed with, CaseError for a quadrature the element has not.
    """
    geometry = element.geometry(corners, numbers)
    volume = float(element.cell.volume) * (1.0 if element.cell.dimension == 3 else thickness)
    return Tables(
        np.ascontiguousarray(cells, dtype=np.int32),
        Maps(_in_space(geometry.jacobian), _in_space(geometry.inverse)),
        geometry.determinant * volume,
        make_reference(element, quadrature),
    )


def make_reference(element: Element, quadrature: str = "default") -> Reference:
    """Shape functions of an element at the points of a named quadrature."""
    tables = element.tables(quadrature)
    d = element.cell.dimension
    gradients = np.zeros((*tables.values.shape, 3))
    gradients[..., :d] = tables.gradients
    base = np.diag([0.0] * d + [1.0] * (3 - d)).ravel()
    return Reference(gradients, tables.weights / tables.weights.sum(), tables.slot.astype(np.int32), base)


def _in_space(matrices: Floats) -> Floats:
    """Matrices (e, d, d) with ones on the diagonal of the axes they lack: (e, 3, 3)."""
    full = np.tile(np.eye(3), (len(matrices), 1, 1))
    d = matrices.shape[1]
    full[:, :d, :d] = matrices
    return full
