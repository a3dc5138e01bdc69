"""What happens at a point of a solid: kernels of any element and any law, the reference of the fast paths.

In each cell nodal vectors are mapped to the reference cell, F = base + (sum_a r_a dN_a/dxi) J^-1 at each quadrature point, and
forces are mapped back. A (3 J, 3 L, 9 ik) is dP/dF, G (a, 3) the gradients with respect to X of the functions of the nodal vectors.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

from ancf_petsc.jit import composed
from ancf_petsc.kernel import scatter
from ancf_petsc.kernel.interface import Kernel, Kernels
from ancf_petsc.kernel.loop import (
    Action,
    Gather,
    as_given,
    compiled,
    named_means,
    named_target,
    nothing_to_close,
    sums_in_place,
)
from ancf_petsc.material.models import Law, green_lagrange
from ancf_petsc.material.tensor import add, determinant, dot, inlined, scale, transpose

ZERO = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
LARGE = 1e300
"""More than any det F."""


class Solid(NamedTuple):
    """A layout of cells of solids, and how points read and write it.

    one, two: geometries of one and of two nodal fields.
    deformation(state, at): F. gradient(state, at): of a direction, without base.
    add_stress(force, at, P): adds weight P G_a to the sums of forces.
    force_sums, product_sums, close: of actions that make a force.
    add_means(sums, at, strain, cauchy, det): a point's part of the fields. means: sums and close of that action.
    tangent, mean_tangent: of a law, the actions that make matrices.
    """

    named_cells: Callable
    one: Gather
    two: Gather
    deformation: Callable
    gradient: Callable
    add_stress: Callable
    force_sums: Callable
    product_sums: Callable
    close: Callable
    add_means: Callable
    means: tuple[Callable, Callable]
    tangent: Callable[[Law], Action]
    mean_tangent: Callable[[Law], Action]


def solid_kernels(law: Law, solid: Solid) -> Kernels:
    """The kernels of a layout for one law."""

    def made(gather: Gather, action: Action) -> Kernel:
        return compiled(gather, action, solid.named_cells)

    forces = (solid.force_sums, solid.close, as_given)
    in_place = (sums_in_place, nothing_to_close)
    products = (solid.product_sums, solid.close, as_given)
    mean_force = mean_tangent = None
    if law.mean_stress is not None:
        mean_force = made(solid.two, Action(_mean_force(law.mean_stress, solid), *forces, LARGE))
        mean_tangent = made(solid.two, solid.mean_tangent(law))
    return Kernels(
        internal_force=made(solid.one, force_action(law, solid)),
        energy=made(solid.one, Action(_energy(law.energy, solid), *in_place, as_given)),
        tangent=made(solid.one, solid.tangent(law)),
        tangent_product=made(solid.two, Action(_product(law, solid), *products)),
        fields=made(solid.one, Action(_fields(law.stress, solid), *solid.means, named_means)),
        mean_force=mean_force,
        mean_tangent=mean_tangent,
    )


def force_action(law: Law, solid: Solid) -> Action:
    """Internal forces."""
    stress, deformation, add_stress = law.stress, solid.deformation, solid.add_stress

    @composed
    def force_at(at, states, parameters, sums, seen):
        F = deformation(states[0], at)
        add_stress(sums[0], at, stress(F, parameters))
        return min(seen, determinant(F))

    return Action(force_at, solid.force_sums, solid.close, as_given, LARGE)


def _energy(psi: Callable, solid: Solid) -> Callable:
    deformation = solid.deformation

    @composed
    def energy_at(at, states, parameters, sums, seen):
        return seen + at.weight * psi(deformation(states[0], at), parameters)

    return energy_at


def _mean_force(stress: Callable, solid: Solid) -> Callable:
    deformation, add_stress = solid.deformation, solid.add_stress

    @composed
    def mean_force_at(at, states, parameters, sums, seen):
        before, after = deformation(states[0], at), deformation(states[1], at)
        smallest = min(seen, determinant(after))
        add_stress(sums[0], at, stress(before, after, parameters))
        return smallest

    return mean_force_at


def _product(law: Law, solid: Solid) -> Callable:
    moduli = moduli_of(law.tangent)
    deformation, gradient, add_stress = solid.deformation, solid.gradient, solid.add_stress

    @composed
    def product_at(at, states, parameters, sums, seen):
        force, A = sums
        moduli(deformation(states[0], at), parameters, 1.0, A)
        add_stress(force, at, change_of_stress(A, gradient(states[1], at)))
        return seen

    return product_at


def _fields(stress: Callable, solid: Solid) -> Callable:
    deformation, add_means = solid.deformation, solid.add_means

    @composed
    def fields_at(at, states, parameters, sums, seen):
        F = deformation(states[0], at)
        J = determinant(F)
        cauchy = scale(1.0 / J, dot(stress(F, parameters), transpose(F)))
        add_means(sums, at, green_lagrange(F), cauchy, J)
        return seen

    return fields_at


# --- the tangent of a law


@inlined
def unit(axis):
    """Unit vector along an axis."""
    return (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)


def moduli_of(block_of: Callable) -> Callable:
    """Of a law, symmetric."""

    @composed
    def moduli(F, parameters, weight, A):
        """weight dP_iJ/dF_kL into A (3 J, 3 L, 9 ik)."""
        for J in range(3):
            for L in range(J, 3):
                block = scale(weight, block_of(F, unit(J), unit(L), parameters))
                mirrored = transpose(block)
                for ik in range(9):
                    A[J, L, ik] = block[ik]
                    A[L, J, ik] = mirrored[ik]

    return moduli


@inlined
def change_of_stress(A, H):
    """dP_iJ = A_iJkL H_kL as nine numbers."""
    dP = ZERO
    for k in range(3):
        for L in range(3):
            x, y, z = A[0, L], A[1, L], A[2, L]
            column = (x[k], y[k], z[k], x[3 + k], y[3 + k], z[3 + k], x[6 + k], y[6 + k], z[6 + k])
            dP = add(dP, scale(H[3 * k + L], column))
    return dP


# --- cells of any element


@inlined
def gradient(local, at):
    """(sum_a r_a dN_a) J^-1 as nine numbers."""
    total, dN = ZERO, at.dN
    for a in range(local.shape[0]):
        x, y, z = local[a, 0], local[a, 1], local[a, 2]
        u, v, w = dN[a, 0], dN[a, 1], dN[a, 2]
        total = add(total, (x * u, x * v, x * w, y * u, y * v, y * w, z * u, z * v, z * w))
    return dot(total, at.frame.inverse)


@inlined
def deformation(local, at):
    """F as nine numbers."""
    return add(at.frame.base, gradient(local, at))


@inlined
def add_stress(local, at, P):
    """Add P J^-T dN_a, weighed, to local (a, 3)."""
    s, dN = dot(scale(at.weight, P), transpose(at.frame.inverse)), at.dN
    for a in range(local.shape[0]):
        u, v, w = dN[a, 0], dN[a, 1], dN[a, 2]
        local[a, 0] += s[0] * u + s[1] * v + s[2] * w
        local[a, 1] += s[3] * u + s[4] * v + s[5] * w
        local[a, 2] += s[6] * u + s[7] * v + s[8] * w


@inlined
def cartesian_gradients(at, G):
    """Gradients with respect to X of the functions of the nodal vectors into G (a, 3)."""
    dN, slot, J, inverse = at.dN, at.frame.slot, at.frame.J, at.frame.inverse
    slopes = slot.max() if J.shape[0] else 0
    for a in range(slot.size):
        j = slot[a] if slopes else 0
        u = v = w = 0.0
        if j == 0:
            u, v, w = dN[a, 0], dN[a, 1], dN[a, 2]
        else:
            for k in range(slopes):
                b = a - j + 1 + k
                factor = J[a // (slopes + 1), j - 1, k]
                u += factor * dN[b, 0]
                v += factor * dN[b, 1]
                w += factor * dN[b, 2]
        for i in range(3):
            G[a, i] = u * inverse[i] + v * inverse[3 + i] + w * inverse[6 + i]


@inlined
def stress_changes(A, G, H):
    """A_iJkL G_bL into H (3 J, 9 b + ik)."""
    for b in range(G.shape[0]):
        x, y, z = G[b, 0], G[b, 1], G[b, 2]
        for J in range(3):
            for ik in range(9):
                H[J, 9 * b + ik] = x * A[J, 0, ik] + y * A[J, 1, ik] + z * A[J, 2, ik]


@inlined
def add_products(H, G, first, blocks):
    """Add sum_J G_aJ H_J to blocks (a, 9 b + ik), for b from a on where first is 1, for all b where it is 0.

    The inner loop runs along memory and fills the registers of vectors.
    """
    for a in range(G.shape[0]):
        x, y, z, start = G[a, 0], G[a, 1], G[a, 2], 9 * a * first
        along_x, along_y, along_z, row = H[0, start:], H[1, start:], H[2, start:], blocks[a, start:]
        for m in range(row.size):
            row[m] += x * along_x[m] + y * along_y[m] + z * along_z[m]


@inlined
def whole(at, A):
    """The moduli of a solid stay as the law has them."""


def tangent_action(law: Law, deformation: Callable, fold: Callable) -> Action:
    """fold(at, A): from derivatives with respect to F to those with respect to sum_a r_a G_a, in place."""
    moduli = moduli_of(law.tangent)

    @composed
    def tangent_at(at, states, parameters, sums, seen):
        blocks, G, A, H = sums
        moduli(deformation(states[0], at), parameters, at.weight, A)
        fold(at, A)
        cartesian_gradients(at, G)
        stress_changes(A, G, H)
        add_products(H, G, 1, blocks)
        return seen

    return Action(tangent_at, scatter.matrix_sums, scatter.give_symmetric, named_target)


def mean_tangent_action(law: Law, deformation: Callable, fold: Callable) -> Action:
    """`tangent_action` between two states."""
    block_of = law.mean_tangent
    assert block_of is not None

    @composed
    def mean_tangent_at(at, states, parameters, sums, seen):
        blocks, G, A, H = sums
        before, after = deformation(states[0], at), deformation(states[1], at)
        for K in range(3):
            for L in range(3):
                block = scale(at.weight, block_of(before, after, unit(K), unit(L), parameters))
                for ik in range(9):
                    A[K, L, ik] = block[ik]
        fold(at, A)
        cartesian_gradients(at, G)
        stress_changes(A, G, H)
        add_products(H, G, 0, blocks)
        return seen

    return Action(mean_tangent_at, scatter.matrix_sums, scatter.give_blocks, named_target)


ANY = Solid(
    named_cells=scatter.named_cells,
    one=scatter.ONE,
    two=scatter.TWO,
    deformation=deformation,
    gradient=gradient,
    add_stress=add_stress,
    force_sums=scatter.force_sums,
    product_sums=scatter.product_sums,
    close=scatter.give_force,
    add_means=scatter.add_means,
    means=(scatter.mean_sums, scatter.give_means),
    tangent=partial(tangent_action, deformation=deformation, fold=whole),
    mean_tangent=partial(mean_tangent_action, deformation=deformation, fold=whole),
)


@cache
def make_kernels(law: Law) -> Kernels:
    """Kernels of all elements for one law."""
    return solid_kernels(law, ANY)
