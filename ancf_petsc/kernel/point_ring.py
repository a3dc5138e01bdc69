"""What happens at a point of a body of revolution: a plane solid with a stretch along the hoop, r / R.

With n the direction of the hoop and e that of the radius, the third column of the functions' table is N_a and the third row of
dxi/dX is n / R. Then H = sum_a r_a G_a, as in any solid, holds the hoop stretch in e.Hn, and

    F = H (I - n nT) + (e.Hn) n nT

folds it into its place. Forces and moduli are folded back the same: everything else is that of `point_solid`.
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from ancf_petsc.kernel import scatter
from ancf_petsc.kernel.interface import Kernels
from ancf_petsc.kernel.loop import Gather
from ancf_petsc.kernel.point_solid import (
    Solid,
    gradient,
    mean_tangent_action,
    solid_kernels,
    tangent_action,
    unit,
)
from ancf_petsc.kernel.point_solid import add_stress as add_plane_stress
from ancf_petsc.kernel.revolution import RingCells
from ancf_petsc.kernel.scatter import At, Nine
from ancf_petsc.material.models import Law
from ancf_petsc.material.tensor import add, apply, inlined, inner, outer


class RingFrame(NamedTuple):
    """`scatter.Frame` of a ring, at a point: inverse has the hoop in its third row."""

    e: int
    nodes: Any
    slot: Any
    J: Any
    inverse: Nine
    base: Nine
    volume: float
    radial: int
    normal: int


@inlined
def named_cells(cells):
    return RingCells(*cells)


# --- gather: positions from the first node, which is the last row


@inlined
def with_first(field, nodes, local):
    """The position that the others are taken from, into the last row of local (a + 1, 3)."""
    for i in range(3):
        local[local.shape[0] - 1, i] = field[nodes[0], i]


@inlined
def one_state(fields, cells):
    return (np.empty((cells.slot.size + 1, 3)),)


@inlined
def enter_one(e, fields, cells, states):
    frame = scatter.enter_one(e, fields, cells, states)
    with_first(fields[0], frame.nodes, states[0])
    return frame


@inlined
def two_states(fields, cells):
    return np.empty((cells.slot.size + 1, 3)), np.empty((cells.slot.size + 1, 3))


@inlined
def enter_two(e, fields, cells, states):
    frame = scatter.enter_two(e, fields, cells, states)
    with_first(fields[0], frame.nodes, states[0])
    with_first(fields[1], frame.nodes, states[1])
    return frame


@inlined
def place(frame, cells, q):
    m, n, s = frame.inverse, unit(cells.normal), 1.0 / cells.radii[frame.e, q]
    inverse = (m[0], m[1], m[2], m[3], m[4], m[5], s * n[0], s * n[1], s * n[2])
    ring = RingFrame(
        frame.e,
        frame.nodes,
        frame.slot,
        frame.J,
        inverse,
        frame.base,
        frame.volume,
        cells.radial,
        cells.normal,
    )
    weight = cells.weights[frame.e, q]
    return At(ring, cells.gradients[q], weight / frame.volume, weight)


# --- the hoop in its place


@inlined
def deformation(local, at):
    """F as nine numbers; of a direction, its change."""
    H, n = gradient(local, at), unit(at.frame.normal)
    hoop = apply(H, n)
    stretch = inner(unit(at.frame.radial), hoop)
    return add(H, outer((stretch * n[0] - hoop[0], stretch * n[1] - hoop[1], stretch * n[2] - hoop[2]), n))


@inlined
def add_stress(local, at, P):
    """Add what P works on, weighed, to local (a, 3): P (I - n nT) + (n.Pn) e nT on H."""
    n, e = unit(at.frame.normal), unit(at.frame.radial)
    Pn = apply(P, n)
    hoop = inner(n, Pn)
    back = (hoop * e[0] - Pn[0], hoop * e[1] - Pn[1], hoop * e[2] - Pn[2])
    add_plane_stress(local, at, add(P, outer(back, n)))


@inlined
def fold(at, A):
    """From dP/dF to derivatives with respect to H, in A (3 J, 3 L, 9 ik): (n, n) becomes (e, n), other (i, n) vanish."""
    e, n = at.frame.radial, at.frame.normal
    for L in range(3):
        for k in range(3):
            hoop = A[n, L, 3 * n + k]
            for i in range(3):
                A[n, L, 3 * i + k] = hoop if i == e else 0.0
    for J in range(3):
        for i in range(3):
            hoop = A[J, n, 3 * i + n]
            for k in range(3):
                A[J, n, 3 * i + k] = hoop if k == e else 0.0


RING = Solid(
    named_cells=named_cells,
    one=Gather(one_state, enter_one, scatter.points, place),
    two=Gather(two_states, enter_two, scatter.points, place),
    deformation=deformation,
    gradient=deformation,
    add_stress=add_stress,
    force_sums=scatter.force_sums,
    product_sums=scatter.product_sums,
    close=scatter.give_force,
    add_means=scatter.add_means,
    means=(scatter.mean_sums, scatter.give_means),
    tangent=partial(tangent_action, deformation=deformation, fold=fold),
    mean_tangent=partial(mean_tangent_action, deformation=deformation, fold=fold),
)


@cache
def make_kernels(law: Law) -> Kernels:
    """Kernels of all plane elements in bodies of revolution for one law."""
    return solid_kernels(law, RING)
