"""Motion in compiled loops: rates of change, whole steps of the central difference, and the balance of an implicit step;
`adaptive` and `implicit` have the steps that are made of them.

For a body of one material on one rank, whose driven degrees of freedom rest: what a step costs is then its
arithmetic, not the interpreter's. The loops know neither element nor law: they call the force by its address, and are compiled
once for all laws. With n nodal vectors:
    state                 x, v, a (n, 3), positions, velocities, accelerations; or y (2, n, 3), positions and velocities
    loads                 factors (l,) of the loads, or (m, l) at m times; patterns (l, n, 3)
    system                body, damping, mass, graph, buffers: the tuple that `System` describes
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.algebra.envelope import solve_components
from ancf_petsc.jit import call_at, kernel
from ancf_petsc.material.tensor import inlined


class System(NamedTuple):
    """What a motion needs beside its state and loads. Compiled loops take a plain tuple, which is quicker to call with.

    body: address of the force (`loop.force_loop`), and what it takes: cells, parameters of the law, span.
    mass: starts (n+1,), factors (k, size), which (3,) of the consistent mass (`envelope`): component c is solved for by factor
    which[c], no factors with lumped mass; share (n, 3): 1 / mass of free components, 0 of driven ones, inverse of a lumped mass.
    graph: pointers, columns, values of the mass, one number for a pair of nodes.
    buffers: force (n, 3) and work (3, n), overwritten.
    """

    body: tuple[int, tuple, Any, tuple[int, int]]
    damping: float
    mass: tuple
    graph: tuple
    buffers: tuple


@inlined
def balance(x, factors, patterns, system):
    """Loads less internal forces into the buffer of forces (n, 3), which is returned."""
    address, cells, parameters, span = system[0]
    force = system[4][0]
    for i in range(force.shape[0]):
        for c in range(3):
            force[i, c] = 0.0
    call_at(address, (x,), cells, parameters, span, force)
    for i in range(force.shape[0]):
        for c in range(3):
            force[i, c] = load(factors, patterns, i, c) - force[i, c]
    return force


@inlined
def load(factors, patterns, i, c):
    """Sum of all loads on one component."""
    total = 0.0
    for k in range(factors.size):
        total += factors[k] * patterns[k, i, c]
    return total


@inlined
def solve_mass(system, a):
    """Accelerations (n, 3) of the forces in the buffer."""
    starts, factors, which, share = system[2]
    force, work = system[4]
    if factors.shape[0]:
        solve_components(starts, factors, which, force, work, a)
        return
    for i in range(force.shape[0]):
        for c in range(3):
            a[i, c] = share[i, c] * force[i, c]


@register_jitable
def rates_at(y, loads, system, f):
    """f = dy/dt of y = (x, v), both (2, n, 3): velocities and accelerations, 0 where driven."""
    damping = system[1]
    balance(y[0], loads[0], loads[1], system)
    solve_mass(system, f[1])
    for i in range(y.shape[1]):
        for c in range(3):
            f[0, i, c] = y[1, i, c]
            f[1, i, c] -= damping * y[1, i, c]


@kernel
def rates(y, loads, system, f):
    """`rates_at`, as a kernel."""
    rates_at(y, loads, system, f)


# --- the central difference


@inlined
def drift(x, v, a, h):
    """Velocities at the middle of a step, positions at its end."""
    for i in range(x.shape[0]):
        for c in range(3):
            v[i, c] += h / 2 * a[i, c]
            x[i, c] += h * v[i, c]


@inlined
def kick(v, a, h, damping):
    """Velocities at the end of a step from undamped accelerations, which become the damped ones."""
    for i in range(v.shape[0]):
        for c in range(3):
            v[i, c] = (v[i, c] + h / 2 * a[i, c]) / (1.0 + damping * h / 2)
            a[i, c] -= damping * v[i, c]


@inlined
def power(factors, step, patterns, v):
    """Of the loads in the middle of a step at velocities v."""
    total = 0.0
    for k in range(factors.shape[1]):
        factor = (factors[step, k] + factors[step + 1, k]) / 2
        for i in range(v.shape[0]):
            for c in range(3):
                total += factor * patterns[k, i, c] * v[i, c]
    return total


@inlined
def row_times(first, last, columns, values, v):
    """One row of M v: entries first to last."""
    x = y = z = 0.0
    for k in range(first, last):
        j, m = np.uint32(columns[k]), values[k]
        x += m * v[j, 0]
        y += m * v[j, 1]
        z += m * v[j, 2]
    return x, y, z


@inlined
def kinetic_square(graph, v):
    """v . M v."""
    pointers, columns, values = graph
    total = 0.0
    for i in range(pointers.size - 1):
        x, y, z = row_times(pointers[i], pointers[i + 1], columns, values, v)
        total += x * v[i, 0] + y * v[i, 1] + z * v[i, 2]
    return total


@kernel
def march(state, h, loads, system):
    """As many steps h as loads have rows of factors but one; x, v, a move on. Returns work of the loads and loss.

    v at half a step: v + h/2 a; x + h v; then a at the end, where the damping is implicit.
    """
    x, v, a = state
    factors, patterns = loads
    damping, graph = system[1], system[3]
    done = loss = 0.0
    for step in range(factors.shape[0] - 1):
        drift(x, v, a, h)
        done += h * power(factors, step, patterns, v)
        if damping != 0.0:
            loss += h * damping * kinetic_square(graph, v)
        balance(x, factors[step + 1], patterns, system)
        solve_mass(system, a)
        kick(v, a, h, damping)
    return done, loss


# --- the balance of an implicit step


@register_jitable
def out_of_balance(fields, part, loads, system, values):
    """values (n, 3): M carried + Q(x + part d) - Q_e. fields: x, d, carried. Returns the sum of the squares of the three."""
    x, d, carried = fields
    pointers, columns, masses = system[3]
    factors, patterns = loads
    for i in range(x.shape[0]):
        for c in range(3):
            values[i, c] = x[i, c] + part * d[i, c]
    force = balance(values, factors, patterns, system)
    total = 0.0
    for i in range(x.shape[0]):
        inertia = row_times(pointers[i], pointers[i + 1], columns, masses, carried)
        for c in range(3):
            given = load(factors, patterns, i, c)
            total += inertia[c] ** 2 + (given - force[i, c]) ** 2 + given**2
            values[i, c] = inertia[c] - force[i, c]
    return total


@kernel
def unbalance(fields, part, loads, system, values):
    """`out_of_balance`, as a kernel."""
    return out_of_balance(fields, part, loads, system, values)
