"""Motion of element 3413 in compiled loops: rates of change, whole steps of the central difference, and the
balance of an implicit step; `adaptive` and `implicit` have the steps that are made of them.

For a body of one material on one rank, whose driven degrees of freedom rest: what a step costs is then its
arithmetic, not the interpreter's. With n nodal vectors:
    x, v, a (n, 3)        positions, velocities, accelerations
    factors (m, l)        of the loads at m times, patterns (l, n, 3) of the loads
    starts (n+1,), factors (k, size), which (3,)  of the consistent mass (`envelope`): component c is solved
                          for by factor which[c]; no factors with lumped mass
    share (n, 3)          1 / mass of free components, 0 of driven ones: the inverse of a lumped mass
    pointers, columns, values  the mass, one number for a pair of nodes
    force (n, 3), work (3, n)  overwritten
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.algebra.envelope import solve_components
from ancf_petsc.jit import composed, kernel
from ancf_petsc.kernel.adaptive import leap_kernel
from ancf_petsc.kernel.implicit import alpha_kernel
from ancf_petsc.kernel.interface import Span
from ancf_petsc.kernel.loop import loop
from ancf_petsc.kernel.point_solid import force_action
from ancf_petsc.kernel.tet3413 import GEOMETRY, SOLID, named_cells
from ancf_petsc.material.models import Law


class MotionKernels(NamedTuple):
    """The compiled loops of one law."""

    rates: Callable
    march: Callable
    unbalance: Callable
    leap: Callable
    alpha: Callable


@register_jitable
def solve_mass(mass, force, work, a):
    """Accelerations (n, 3) of forces (n, 3)."""
    starts, factors, which, share = mass
    if factors.shape[0]:
        solve_components(starts, factors, which, force, work, a)
        return
    for i in range(force.shape[0]):
        for c in range(3):
            a[i, c] = share[i, c] * force[i, c]


@register_jitable
def load(factors, patterns, i, c):
    """Of all loads on a component."""
    total = 0.0
    for k in range(factors.size):
        total += factors[k] * patterns[k, i, c]
    return total


@register_jitable
def drift(x, v, a, h):
    """Velocities at the middle of a step, positions at its end."""
    for i in range(x.shape[0]):
        for c in range(3):
            v[i, c] += h / 2 * a[i, c]
            x[i, c] += h * v[i, c]


@register_jitable
def kick(v, a, h, damping):
    """Velocities at the end of a step from undamped accelerations, which become the damped ones."""
    for i in range(v.shape[0]):
        for c in range(3):
            v[i, c] = (v[i, c] + h / 2 * a[i, c]) / (1.0 + damping * h / 2)
            a[i, c] -= damping * v[i, c]


@register_jitable
def power(factors, patterns, v):
    """Of the loads at velocities v."""
    total = 0.0
    for k in range(factors.size):
        for i in range(v.shape[0]):
            for c in range(3):
                total += factors[k] * patterns[k, i, c] * v[i, c]
    return total


@register_jitable
def carried_by(first, last, columns, values, v):
    """One row of M v: entries first to last."""
    x = y = z = 0.0
    for k in range(first, last):
        j, m = np.uint32(columns[k]), values[k]
        x += m * v[j, 0]
        y += m * v[j, 1]
        z += m * v[j, 2]
    return x, y, z


@register_jitable
def kinetic_square(pointers, columns, values, v):
    """v . M v."""
    total = 0.0
    for i in range(pointers.size - 1):
        x, y, z = carried_by(pointers[i], pointers[i + 1], columns, values, v)
        total += x * v[i, 0] + y * v[i, 1] + z * v[i, 2]
    return total


@cache
def make_motion_kernels(law: Law) -> MotionKernels:
    """Compiled loops for one law."""
    balance = balance_of(loop(GEOMETRY, force_action(law, SOLID)))
    rates, unbalance = rates_of(balance), unbalance_of(balance)
    return MotionKernels(
        kernel(rates), march_kernel(balance), kernel(unbalance), leap_kernel(rates), alpha_kernel(unbalance)
    )


def balance_of(visit: Callable) -> Callable:
    """The loop over forces, to stand in others."""

    @composed
    def balance(x, body, factors, patterns, force):
        """force (n, 3): loads less internal forces."""
        cells, parameters = named_cells(body[0]), body[1]
        force[:] = 0.0
        visit((x,), cells, parameters, Span(0, cells.volumes.size), force)
        for i in range(force.shape[0]):
            for c in range(3):
                force[i, c] = load(factors, patterns, i, c) - force[i, c]

    return balance


def rates_of(balance: Callable) -> Callable:
    """Rates of change, to stand in others."""

    @composed
    def rates(y, damping, body, factors, patterns, mass, force, work, f):
        """f = dy/dt of y = (x, v), both (2, n, 3): velocities and accelerations, 0 where driven."""
        balance(y[0], body, factors, patterns, force)
        solve_mass(mass, force, work, f[1])
        for i in range(y.shape[1]):
            for c in range(3):
                f[0, i, c] = y[1, i, c]
                f[1, i, c] -= damping * y[1, i, c]

    return rates


def march_kernel(balance: Callable) -> Callable:
    """Whole steps of the central difference."""

    @kernel
    def march(x, v, a, h, damping, body, factors, patterns, mass, graph, force, work):
        """As many steps h as factors has rows but one; x, v, a move on. Returns work of the loads and loss.

        v at half a step: v + h/2 a; x + h v; then a at the end, where the damping is implicit.
        """
        pointers, columns, values = graph
        done = loss = 0.0
        for step in range(factors.shape[0] - 1):
            drift(x, v, a, h)
            done += h * power((factors[step] + factors[step + 1]) / 2, patterns, v)
            if damping != 0.0:
                loss += h * damping * kinetic_square(pointers, columns, values, v)
            balance(x, body, factors[step + 1], patterns, force)
            solve_mass(mass, force, work, a)
            kick(v, a, h, damping)
        return done, loss

    return march


def unbalance_of(balance: Callable) -> Callable:
    """The balance of an implicit step, to stand in others."""

    @composed
    def unbalance(x, d, part, carried, body, factors, patterns, graph, force, values):
        """values (n, 3): M carried + Q(x + part d) - Q_e. Returns the sum of the squares of the three."""
        pointers, columns, masses = graph
        for i in range(x.shape[0]):
            for c in range(3):
                values[i, c] = x[i, c] + part * d[i, c]
        balance(values, body, factors, patterns, force)
        total = 0.0
        for i in range(x.shape[0]):
            inertia = carried_by(pointers[i], pointers[i + 1], columns, masses, carried)
            for c in range(3):
                given = load(factors, patterns, i, c)
                total += inertia[c] ** 2 + (given - force[i, c]) ** 2 + given**2
                values[i, c] = inertia[c] - force[i, c]
        return total

    return unbalance
