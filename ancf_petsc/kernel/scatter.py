"""Between nodal vectors of the body and those of one cell: gather, scatter, and blocks of a matrix.

`local` (a, 3) are nodal vectors of a cell in its reference cell: positions from the first node, slopes along xi. J (s, 3, 3)
turns the slopes of each node into slopes along xi, no s where the element has none. slot (a) is 0 for positions and j for the
j-th slope.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.kernel.interface import Cells
from ancf_petsc.kernel.loop import Gather
from ancf_petsc.material.tensor import inlined, transpose

Nine = tuple[float, float, float, float, float, float, float, float, float]


class Frame(NamedTuple):
    """What the points of a cell share. inverse: dxi/dX; base: what F has without nodal vectors."""

    e: int
    nodes: Any
    slot: Any
    J: Any
    inverse: Nine
    base: Nine
    volume: float


class At(NamedTuple):
    """A quadrature point. frame: `Frame`, or what a layout has in its place. dN (a, 3): dN/dxi; fraction of the cell's volume and
    weight, its share of the volume."""

    frame: Any
    dN: Any
    fraction: float
    weight: float


@inlined
def nine(x):
    """An array (9,) as nine numbers."""
    return (x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8])


@inlined
def named_cells(cells):
    return Cells(*cells)


# --- gather


@inlined
def gather(field, nodes, slot, J, local):
    """Nodal vectors of a cell into local: positions from the first node, slopes along xi."""
    if J.shape[0] == 0:
        x, y, z = field[nodes[0], 0], field[nodes[0], 1], field[nodes[0], 2]
        for a in range(slot.size):
            n = nodes[a]
            local[a, 0], local[a, 1], local[a, 2] = field[n, 0] - x, field[n, 1] - y, field[n, 2] - z
    else:
        gather_slopes(field, nodes, slot, J, local)


@register_jitable
def gather_slopes(field, nodes, slot, J, local):
    """`gather` for an element with slopes."""
    slopes = slot.max()
    for a in range(slot.size):
        k = slot[a]
        for i in range(3):
            if k == 0:
                local[a, i] = field[nodes[a], i] - field[nodes[0], i]
            else:
                along = 0.0
                for j in range(slopes):
                    along += J[a // (slopes + 1), j, k - 1] * field[nodes[a - k + 1 + j], i]
                local[a, i] = along


@inlined
def frame_of(e, cells):
    m, base = cells.inverses, nine(cells.base)
    first, second = (m[e, 0, 0], m[e, 0, 1], m[e, 0, 2]), (m[e, 1, 0], m[e, 1, 1], m[e, 1, 2])
    inverse = (*first, *second, m[e, 2, 0], m[e, 2, 1], m[e, 2, 2])
    return Frame(e, cells.nodes[e], cells.slot, cells.jacobians[e], inverse, base, cells.volumes[e])


@inlined
def one_state(fields, cells):
    return (np.empty((cells.slot.size, 3)),)


@inlined
def enter_one(e, fields, cells, states):
    frame = frame_of(e, cells)
    gather(fields[0], frame.nodes, frame.slot, frame.J, states[0])
    return frame


@inlined
def two_states(fields, cells):
    return np.empty((cells.slot.size, 3)), np.empty((cells.slot.size, 3))


@inlined
def enter_two(e, fields, cells, states):
    frame = enter_one(e, fields, cells, states)
    gather(fields[1], frame.nodes, frame.slot, frame.J, states[1])
    return frame


@inlined
def points(cells):
    return cells.fractions.size


@inlined
def place(frame, cells, q):
    return At(frame, cells.gradients[q], cells.fractions[q], cells.fractions[q] * frame.volume)


ONE = Gather(one_state, enter_one, points, place)
TWO = Gather(two_states, enter_two, points, place)


# --- scatter


@inlined
def force_sums(cells, out):
    """The force of one cell."""
    return (np.zeros((cells.slot.size, 3)),)


@inlined
def product_sums(cells, out):
    """The force of one cell, and room for the tangent of a point (3 J, 3 L, 9 ik)."""
    return np.zeros((cells.slot.size, 3)), np.zeros((3, 3, 9))


@inlined
def give_force(frame, cells, parameters, sums, out):
    """Add the force of a cell to `out`."""
    local = sums[0]
    scatter(out, frame.nodes, frame.slot, frame.J, local)
    local[:] = 0.0


@inlined
def scatter(force, nodes, slot, J, local):
    """Add forces local (a, 3) on the vectors that `gather` makes to the force of the nodal vectors."""
    if J.shape[0] == 0:
        for a in range(slot.size):
            n = nodes[a]
            force[n, 0] += local[a, 0]
            force[n, 1] += local[a, 1]
            force[n, 2] += local[a, 2]
    else:
        scatter_slopes(force, nodes, slot, J, local)


@register_jitable
def scatter_slopes(force, nodes, slot, J, local):
    """`scatter` for an element with slopes."""
    slopes = slot.max()
    for a in range(slot.size):
        j = slot[a]
        for i in range(3):
            if j == 0:
                force[nodes[a], i] += local[a, i]
            else:
                along = 0.0
                for k in range(slopes):
                    along += J[a // (slopes + 1), j - 1, k] * local[a - j + 1 + k, i]
                force[nodes[a], i] += along


# --- means of cells


@inlined
def mean_sums(cells, out):
    """Strain, stress and det F of one cell, (19,)."""
    return np.zeros(19)


@inlined
def add_means(sums, at, strain, cauchy, det):
    """Add what a point has for its fraction of the cell."""
    for k in range(9):
        sums[k] += at.fraction * strain[k]
        sums[9 + k] += at.fraction * cauchy[k]
    sums[18] += at.fraction * det


@inlined
def give_means(frame, cells, parameters, sums, out):
    """Put the means of a cell into `out`."""
    e = frame.e
    for k in range(9):
        out.strain[e, k], out.cauchy[e, k] = sums[k], sums[9 + k]
    out.det[e] = sums[18]
    sums[:] = 0.0


# --- blocks of a matrix


@inlined
def matrix_sums(cells, out):
    """Blocks of one cell (a, 9 b + ik); gradients (a, 3), tangent (3 J, 3 L, 9 ik) and their product (3 J, 9 b + ik) of a point."""
    n = cells.slot.size
    return np.zeros((n, 9 * n)), np.zeros((n, 3)), np.zeros((3, 3, 9)), np.empty((3, 9 * n))


@inlined
def give_symmetric(frame, cells, parameters, sums, out):
    """Add the blocks of a cell, those of a and b from a on, and what mirrors them, to the matrix."""
    blocks = sums[0]
    for a in range(frame.slot.size):
        add_mirrored(out, frame.e, frame.nodes, a, blocks[a])
    blocks[:] = 0.0


@inlined
def give_blocks(frame, cells, parameters, sums, out):
    """Add all blocks of a cell to the matrix."""
    blocks = sums[0]
    for a in range(frame.slot.size):
        for b in range(frame.slot.size):
            add_pair(out, frame.e, frame.nodes, (a, b), nine(blocks[a, 9 * b : 9 * b + 9]))
    blocks[:] = 0.0


@inlined
def add_whole(values, start, stride, block):
    """Add a 3 x 3 block to a matrix stored by rows of length `stride`, from `start` on."""
    for i in range(3):
        row = np.uint64(start + i * stride)
        values[row] += block[3 * i]
        values[row + np.uint64(1)] += block[3 * i + 1]
        values[row + np.uint64(2)] += block[3 * i + 2]


@inlined
def add_pair(out, e, nodes, pair, block):
    """Add the block of two nodal vectors of cell e, which may be another rank's or driven."""
    a, b = pair
    i, j, start = nodes[a], nodes[b], out.starts[e, a, b]
    stride = out.strides[i, 1 if start >= out.split else 0]
    add_block(out.values, start, stride, block, (out.driven[i], out.driven[j]))


@register_jitable
def add_block(values, start, stride, block, driven):
    """`add_whole` without driven rows and columns, and for rows of this rank only. driven: bits of the rows and of the columns."""
    if start < 0:
        return
    row, column = driven
    if (row | column) & 7 == 0:
        add_whole(values, start, stride, block)
        return
    for i in range(3):
        for j in range(3):
            if not (row >> i | column >> j) & 1:
                values[start + i * stride + j] += block[3 * i + j]


@register_jitable
def add_mirrored(out, e, nodes, a, row):
    """Add row (9 b + ik), the blocks of a and b from a on, and what mirrors them."""
    i, values = nodes[a], out.values
    for b in range(a, nodes.size):
        j, block = nodes[b], nine(row[9 * b : 9 * b + 9])
        start, mirrored = out.starts[e, a, b], out.starts[e, b, a]
        if start >= 0 and mirrored >= 0 and out.driven[i] == 0 and out.driven[j] == 0:
            add_whole(values, start, out.strides[i, 1 if start >= out.split else 0], block)
            if b > a:
                stride = out.strides[j, 1 if mirrored >= out.split else 0]
                add_whole(values, mirrored, stride, transpose(block))
        else:
            add_pair(out, e, nodes, (a, b), block)
            if b > a:
                add_pair(out, e, nodes, (b, a), transpose(block))
