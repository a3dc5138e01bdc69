"""Gradients of nodal fields within cells, at any point of the reference cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.model.body import Body

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def deformation_gradients(body: Body, positions: Floats, point: Floats, cells: Integers) -> Floats:
    """F (m, 3, 3) of some cells (m,) at one point (k,), from positions (v, 3). Across a plane body the stretch is 1, around the
    axis of a body of revolution that of the radius.
    """
    inverse = _inverse(body, point, cells)
    edges = tangents(body, body.reference, point, np.eye(len(point)), cells)
    across = np.eye(3) - np.einsum("eki,ekj->eij", edges, inverse)
    return (
        gradients(body, positions, point, cells)
        + _around(body, positions, point, cells)[:, None, None] * across
    )


def _around(body: Body, positions: Floats, point: Floats, cells: Integers) -> Floats:
    """Stretch (m,) of the radius of a body of revolution; 1 for other bodies and on the axis."""
    if body.revolution is None:
        return np.ones(len(cells))
    values, radial = body.element.values(np.asarray(point)[None])[0], body.revolution.radial
    shares, origin = body.mapped(values, cells), body.origin[radial]
    before, after = (
        origin + np.einsum("ea,ea->e", shares, field[body.cells[cells], radial])
        for field in (body.reference, positions)
    )
    on_axis = np.abs(before) <= 1e-9 * body.size
    return np.where(on_axis, 1.0, after / np.where(on_axis, 1.0, before))


def gradients(body: Body, field: Floats, point: Floats, cells: Integers) -> Floats:
    """(m, 3, 3) of a field (v, 3) over the undeformed place, in some cells (m,) at one point (k,) of the reference cell.

    Of a plane body, the derivative along its normal is 0.
    """
    along_xi = tangents(body, field, point, np.eye(len(point)), cells)
    return np.einsum("eki,ekj->eij", along_xi, _inverse(body, point, cells))


def tangents(body: Body, field: Floats, point: Floats, along: Floats, cells: Integers) -> Floats:
    """(m, t, 3) derivatives of a field (v, 3) in some cells (m,), at one point (k,), along directions (t, k) there."""
    row = body.element
    values = along @ np.moveaxis(row.gradients(np.asarray(point)[None])[0], 0, 1)
    found = [np.einsum("ea,eai->ei", body.mapped(v, cells), field[body.cells[cells]]) for v in values]
    return np.stack(found, axis=1)


def _inverse(body: Body, point: Floats, cells: Integers) -> Floats:
    """(m, k, 3) derivatives of xi over the undeformed place."""
    edges = tangents(body, body.reference, point, np.eye(len(point)), cells)
    return np.linalg.pinv(np.swapaxes(edges, 1, 2)) if len(cells) else np.zeros((0, len(point), 3))
