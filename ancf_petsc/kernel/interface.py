"""What kernels take and what they are: every kernel is called with five arguments.

    fields       nodal fields (v, 3), a tuple: a state; two states; a state and a direction
    cells        the cells of this rank: `Cells`, or the layout of a fast path
    parameters   of the law, (p,)
    span         `Span`, the range of cells to visit
    out          what the kernel adds to: a force (v, 3), `Target` of a matrix; or writes: `Means` of cells; nothing for an energy

A point function gets `parameters` as it is: a law that needs more than numbers (a state at every point) gets a named tuple there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Cells(NamedTuple):
    """The cells of one element, in the order of their nodal vectors a, with quadrature points q.

    nodes (e, a): nodal vectors, node by node, a position before its slopes.
    jacobians (e, s, 3, 3): of each node s with slopes, from its slopes j to those along xi_k.
    inverses (e, 3, 3): dxi/dX; of a beam one over its length.
    volumes (e): undeformed volumes; of a plane body with its thickness, of a beam with its area.
    gradients (q, a, 3): dN/dxi; of a beam the first and the second derivative.
    fractions (q): of the volume, their sum is 1.
    slot (a): 0 for a position, j for the j-th slope.
    base (9): what F has without nodal vectors.
    """

    nodes: NDArray[np.int32]
    jacobians: Floats
    inverses: Floats
    volumes: Floats
    gradients: Floats
    fractions: Floats
    slot: NDArray[np.int32]
    base: Floats


class Span(NamedTuple):
    """Cells first:last."""

    first: int
    last: int


class Target(NamedTuple):
    """A matrix stored by scalar rows, own columns first, from `split` on those of ghosts.

    starts (e, a, a): where block (a, b) of a cell begins in values; negative for rows of other ranks.
    strides (v, 2): length of a scalar row of the nodal vector in the two parts of values.
    driven (v,): bit i is set where component i is driven: its row and column stay out; bit 3 where another rank owns
    the nodal vector.
    values (nnz,): what the kernel adds to.
    """

    starts: NDArray[np.int64]
    strides: NDArray[np.int32]
    split: int
    driven: NDArray[np.uint8]
    values: Floats


class Means(NamedTuple):
    """Means over undeformed cells: Green-Lagrange strain (e, 9), Cauchy stress (e, 9) and det F (e,)."""

    strain: Floats
    cauchy: Floats
    det: Floats


Kernel = Callable[..., Any]


class Kernels(NamedTuple):
    """The compiled loops of one element and one law.

    internal_force: adds Q; returns the smallest det F at a point, of a beam the smallest stretch.
    energy: returns the strain energy.
    tangent: adds dQ/dr, symmetric, to Target.
    tangent_product: fields are a state and a direction; adds the directional derivative of Q to a force.
    fields: puts into Means.
    mean_force: fields are two states; adds the force whose work between them is the growth of the energy, and whose moments
    balance; returns the smallest det F of the second state.
    mean_tangent: adds its derivative with respect to the second state, not symmetric, to Target.
    The last two are there for laws with `mean_stress` and `mean_tangent`.
    """

    internal_force: Kernel
    energy: Kernel
    tangent: Kernel
    tangent_product: Kernel
    fields: Kernel
    mean_force: Kernel | None = None
    mean_tangent: Kernel | None = None
