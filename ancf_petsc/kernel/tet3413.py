"""The fast path of element 3413: one point a cell, constant gradients, everything in registers.

A claim of equality with the kernels of any element, which a test checks. Cells are tetrahedra with nodes 0 to 3. F
= sum_a r_a G_a with the gradients G of nodes 1 to 3; that of node 0 is minus their sum. Points read the nodal fields and write the
forces of the body themselves.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from ancf_petsc.jit import composed, kernel
from ancf_petsc.kernel import loop
from ancf_petsc.kernel.interface import Floats, Kernels
from ancf_petsc.kernel.loop import Action, Gather, named_target, nothing_to_close, sums_in_place
from ancf_petsc.kernel.point_solid import Solid, force_action, solid_kernels
from ancf_petsc.kernel.scatter import add_pair, add_whole
from ancf_petsc.material.models import Law
from ancf_petsc.material.tensor import (
    add,
    apply,
    determinant,
    inlined,
    inverse_transpose,
    scale,
    transpose,
)

ZERO = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Tetrahedra(NamedTuple):
    """nodes (e, 4): nodal vectors of the cells. gradients (e, 3, 3): G_a (a = 1..3, component J). volumes (e,): undeformed."""

    nodes: NDArray[np.int32]
    gradients: Floats
    volumes: Floats


class Tetrahedron(NamedTuple):
    """A cell: its four nodes and the gradients (3, 3) of the last three."""

    e: int
    nodes: tuple[Any, Any, Any, Any]
    G: Any


class AtTetrahedron(NamedTuple):
    """Its point."""

    frame: Tetrahedron
    weight: float


@inlined
def named_cells(cells):
    return Tetrahedra(*cells)


@inlined
def fields_themselves(fields, cells):
    return fields


@inlined
def enter(e, fields, cells, states):
    """Nodes are unsigned: compiled code then need not ask whether an index counts from the end."""
    n = cells.nodes
    nodes = np.uint32(n[e, 0]), np.uint32(n[e, 1]), np.uint32(n[e, 2]), np.uint32(n[e, 3])
    return Tetrahedron(e, nodes, cells.gradients[e])


@inlined
def one_point(cells):
    return 1


@inlined
def place(frame, cells, q):
    return AtTetrahedron(frame, cells.volumes[frame.e])


@inlined
def deformation(r, at):
    """sum over a = 1..3 of (r_a - r_0) G_a as nine numbers."""
    nodes, G = at.frame.nodes, at.frame.G
    x, y, z = r[nodes[0], 0], r[nodes[0], 1], r[nodes[0], 2]
    total = ZERO
    for a in range(3):
        n = nodes[a + 1]
        dx, dy, dz = r[n, 0] - x, r[n, 1] - y, r[n, 2] - z
        gx, gy, gz = G[a, 0], G[a, 1], G[a, 2]
        row = (dx * gx, dx * gy, dx * gz, dy * gx, dy * gy, dy * gz, dz * gx, dz * gy, dz * gz)
        total = add(total, row)
    return total


@inlined
def add_stress(force, at, P):
    """Add volume P G_a to the force of node a, and what balances it to node 0."""
    nodes, G, volume = at.frame.nodes, at.frame.G, at.weight
    fx = fy = fz = 0.0
    for a in range(3):
        px, py, pz = apply(P, (volume * G[a, 0], volume * G[a, 1], volume * G[a, 2]))
        n = nodes[a + 1]
        force[n, 0] += px
        force[n, 1] += py
        force[n, 2] += pz
        fx += px
        fy += py
        fz += pz
    force[nodes[0], 0] -= fx
    force[nodes[0], 1] -= fy
    force[nodes[0], 2] -= fz


@inlined
def force_of_the_body(cells, out):
    return (out,)


@inlined
def product_sums(cells, out):
    """The force of the body, and room for the tangent of a point (3 J, 3 L, 9 ik)."""
    return out, np.empty((3, 3, 9))


@inlined
def put_means(means, at, strain, cauchy, det):
    """The fields of a cell are those of its point."""
    e = at.frame.e
    for k in range(9):
        means.strain[e, k] = strain[k]
        means.cauchy[e, k] = cauchy[k]
    means.det[e] = det


@inlined
def gradients_of(at):
    """Of nodes 1 to 3."""
    G = at.frame.G
    return (G[0, 0], G[0, 1], G[0, 2]), (G[1, 0], G[1, 1], G[1, 2]), (G[2, 0], G[2, 1], G[2, 2])


@inlined
def add_inner_cell(out, e, nodes, upper):
    """Add a cell none of whose rows and columns is driven or another rank's. upper: blocks (a, b) with a <= b."""
    values, starts, strides = out.values, out.starts[e], out.strides
    s0, s1, s2, s3 = strides[nodes[0], 0], strides[nodes[1], 0], strides[nodes[2], 0], strides[nodes[3], 0]
    k00, k01, k02, k03, k11, k12, k13, k22, k23, k33 = upper
    add_whole(values, starts[0, 0], s0, k00)
    add_whole(values, starts[0, 1], s0, k01)
    add_whole(values, starts[0, 2], s0, k02)
    add_whole(values, starts[0, 3], s0, k03)
    add_whole(values, starts[1, 0], s1, transpose(k01))
    add_whole(values, starts[1, 1], s1, k11)
    add_whole(values, starts[1, 2], s1, k12)
    add_whole(values, starts[1, 3], s1, k13)
    add_whole(values, starts[2, 0], s2, transpose(k02))
    add_whole(values, starts[2, 1], s2, transpose(k12))
    add_whole(values, starts[2, 2], s2, k22)
    add_whole(values, starts[2, 3], s2, k23)
    add_whole(values, starts[3, 0], s3, transpose(k03))
    add_whole(values, starts[3, 1], s3, transpose(k13))
    add_whole(values, starts[3, 2], s3, transpose(k23))
    add_whole(values, starts[3, 3], s3, k33)


@register_jitable
def add_any_cell(out, e, nodes, upper):
    """Add a cell with driven degrees of freedom or nodes of other ranks. upper: blocks (a, b) with a <= b."""
    k00, k01, k02, k03, k11, k12, k13, k22, k23, k33 = upper
    add_pair(out, e, nodes, (0, 0), k00)
    add_pair(out, e, nodes, (1, 1), k11)
    add_pair(out, e, nodes, (2, 2), k22)
    add_pair(out, e, nodes, (3, 3), k33)
    add_both(out, e, nodes, (0, 1), k01)
    add_both(out, e, nodes, (0, 2), k02)
    add_both(out, e, nodes, (0, 3), k03)
    add_both(out, e, nodes, (1, 2), k12)
    add_both(out, e, nodes, (1, 3), k13)
    add_both(out, e, nodes, (2, 3), k23)


@inlined
def add_both(out, e, nodes, pair, block):
    """A block and what mirrors it."""
    add_pair(out, e, nodes, pair, block)
    add_pair(out, e, nodes, (pair[1], pair[0]), transpose(block))


def _tangent(law: Law) -> Action:
    block_of = law.tangent

    @composed
    def tangent_at(at, states, parameters, out, seen):
        e, nodes, _ = at.frame
        F, w = deformation(states[0], at), at.weight
        g1, g2, g3 = gradients_of(at)
        k11 = scale(w, block_of(F, g1, g1, parameters))
        k12 = scale(w, block_of(F, g1, g2, parameters))
        k13 = scale(w, block_of(F, g1, g3, parameters))
        k22 = scale(w, block_of(F, g2, g2, parameters))
        k23 = scale(w, block_of(F, g2, g3, parameters))
        k33 = scale(w, block_of(F, g3, g3, parameters))
        k01 = scale(-1.0, add(k11, add(transpose(k12), transpose(k13))))
        k02 = scale(-1.0, add(k12, add(k22, transpose(k23))))
        k03 = scale(-1.0, add(k13, add(k23, k33)))
        k00 = scale(-1.0, add(k01, add(k02, k03)))
        upper = (k00, k01, k02, k03, k11, k12, k13, k22, k23, k33)
        driven = out.driven
        held = driven[nodes[0]] | driven[nodes[1]] | driven[nodes[2]] | driven[nodes[3]]
        if held == 0:
            add_inner_cell(out, e, nodes, upper)
        else:
            add_any_cell(out, e, nodes, upper)
        return seen

    return Action(tangent_at, sums_in_place, nothing_to_close, named_target)


def _mean_tangent(law: Law) -> Action:
    block_of = law.mean_tangent
    assert block_of is not None

    @composed
    def mean_tangent_at(at, states, parameters, out, seen):
        e, nodes, G = at.frame
        before, after = deformation(states[0], at), deformation(states[1], at)
        for b in range(1, 4):
            v = (G[b - 1, 0], G[b - 1, 1], G[b - 1, 2])
            balance = ZERO
            for a in range(4):
                if a < 3:
                    u = (G[a, 0], G[a, 1], G[a, 2])
                    block = scale(at.weight, block_of(before, after, u, v, parameters))
                    balance = add(balance, scale(-1.0, block))
                    row = a + 1
                else:
                    block, row = balance, 0
                add_pair(out, e, nodes, (row, b), block)
                add_pair(out, e, nodes, (row, 0), scale(-1.0, block))
        return seen

    return Action(mean_tangent_at, sums_in_place, nothing_to_close, named_target)


GEOMETRY = Gather(fields_themselves, enter, one_point, place)
SOLID = Solid(
    named_cells=named_cells,
    one=GEOMETRY,
    two=GEOMETRY,
    deformation=deformation,
    gradient=deformation,
    add_stress=add_stress,
    force_sums=force_of_the_body,
    product_sums=product_sums,
    close=nothing_to_close,
    add_means=put_means,
    means=(sums_in_place, nothing_to_close),
    tangent=_tangent,
    mean_tangent=_mean_tangent,
)


@cache
def make_kernels(law: Law) -> Kernels:
    """Kernels of element 3413 for one law."""
    return solid_kernels(law, SOLID)


def force_of_all(law: Law, cells: tuple) -> int:
    """Address of the internal forces of all cells, for compiled motions."""
    return loop.force_loop(GEOMETRY, force_action(law, SOLID), named_cells, cells)


@kernel
def geometry(points, nodes, gradients, volumes):
    """Gradients of nodes 1 to 3 (e, 3, 3) and volumes (e,) from undeformed points (v, 3)."""
    for e in range(nodes.shape[0]):
        x, y, z = points[nodes[e, 0], 0], points[nodes[e, 0], 1], points[nodes[e, 0], 2]
        a, b, c = nodes[e, 1], nodes[e, 2], nodes[e, 3]
        J = (
            points[a, 0] - x,
            points[a, 1] - y,
            points[a, 2] - z,
            points[b, 0] - x,
            points[b, 1] - y,
            points[b, 2] - z,
            points[c, 0] - x,
            points[c, 1] - y,
            points[c, 2] - z,
        )
        det = determinant(J)
        inverse = inverse_transpose(J, det)
        for k in range(9):
            gradients[e, k // 3, k % 3] = inverse[k]
        volumes[e] = det / 6.0


def tetrahedra(nodes: NDArray[np.int32], points: Floats) -> Tetrahedra:
    """Cells (e, 4) of undeformed points (v, 3)."""
    gradients, volumes = np.empty((len(nodes), 3, 3)), np.empty(len(nodes))
    geometry(points, nodes, gradients, volumes)
    return Tetrahedra(nodes, gradients, volumes)
