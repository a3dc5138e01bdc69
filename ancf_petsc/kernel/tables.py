"""The cells of one element, as kernels take them.

A nodal slope is the derivative of r along a direction, times a length: its undeformed value says which. J turns
slopes into those of the reference cell, so that shape functions are the same numbers for all cells.

Elements of the plane are solids with a third axis that does nothing: F has a one along the normal, which is plane
strain, and volumes have the thickness in them. Plane stress of St Venant and Kirchhoff is plane strain with the condensed
first Lame parameter. Volumes of beams have the area in them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.kernel.interface import Cells, Floats


def make_tables(
    element: Element,
    cells: ArrayLike,
    corners: ArrayLike,
    *,
    directions: ArrayLike | None = None,
    axes: ArrayLike | None = None,
    quadrature: str = "default",
    thickness: float = 1.0,
    numbers: ArrayLike | None = None,
) -> Cells:
    """Cells (e, a) from undeformed corners (e, c, 3).

    directions (e, s, d, 3): undeformed slopes of the nodes with slopes, default the axes. axes (3, d): those a plane body
    lies along, default x and y. thickness: of a plane body; the area of a beam. numbers (e): for messages.
    Raises MeshError for cells that cannot be computed with, CaseError for a quadrature the element has not.
    """
    corners = np.asarray(corners, dtype=float)
    d = element.cell.dimension
    frame = np.eye(3)[:, :d] if axes is None else np.asarray(axes, dtype=float)
    geometry = element.geometry(corners if d == 3 or axes is None else corners @ frame, numbers)
    if directions is None:
        directions = np.broadcast_to(frame.T, (len(corners), nodes_with_slopes(element), d, 3))
    inverses = np.zeros((len(corners), 3, 3))
    inverses[:, :d] = np.einsum("ekj,ij->eki", geometry.inverse, frame)
    if element.is_beam:
        inverses[:, 0, 0] = geometry.inverse[:, 0, 0]
    volume = float(element.cell.volume) * (1.0 if d == 3 else thickness)
    return Cells(
        np.ascontiguousarray(cells, dtype=np.int32),
        slope_maps(geometry.jacobian, frame, np.asarray(directions)),
        inverses,
        geometry.determinant * volume,
        *reference_functions(element, quadrature, frame),
    )


def nodes_with_slopes(element: Element) -> int:
    """How many nodes of a cell carry slopes: its corners or none."""
    return len(element.cell.corners) if element.has_slopes else 0


def slope_maps(jacobian: Floats, axes: Floats, directions: Floats) -> Floats:
    """(e, s, 3, 3) from slopes along `directions` (e, s, d, 3), orthogonal ones, to slopes along xi. jacobian (e, d, d)."""
    d = jacobian.shape[-1]
    edges = np.einsum("ij,ejk->eik", axes, jacobian)
    squares = np.einsum("esmi,esmi->esm", directions, directions)
    full = np.zeros((*directions.shape[:2], 3, 3))
    full[..., :d, :d] = np.einsum("esmi,eik->esmk", directions, edges) / squares[..., None]
    return full


def map_functions(values: Floats, maps: Floats, element: Element) -> Floats:
    """Functions (e, a) of the nodal vectors from those of the reference cell, (a) or (e, a); maps (e, s, 3, 3)."""
    d, (e, s) = element.cell.dimension, maps.shape[:2]
    mapped = np.array(np.broadcast_to(values, (e, element.functions)))
    if s:
        by_node = mapped[:, : s * (d + 1)].reshape(e, s, d + 1)
        by_node[..., 1:] = np.einsum("esmk,esk->esm", maps[..., :d, :d], by_node[..., 1:])
        mapped[:, : s * (d + 1)] = by_node.reshape(e, s * (d + 1))
    return mapped


def reference_functions(
    element: Element, quadrature: str = "default", axes: ArrayLike | None = None
) -> tuple[Floats, Floats, NDArray[np.int32], Floats]:
    """gradients, fractions, slot and base of `Cells`, at the points of a named quadrature."""
    tables = element.tables(quadrature)
    d = element.cell.dimension
    gradients = np.zeros((*tables.values.shape, 3))
    gradients[..., :d] = tables.gradients
    if element.is_beam:
        gradients[..., 1] = element.derivative(tables.points, (2,))
    frame = np.eye(3)[:, :d] if axes is None else np.asarray(axes)
    base = (np.eye(3) - frame @ frame.T).ravel()
    return gradients, tables.weights / tables.weights.sum(), tables.slot.astype(np.int32), base
