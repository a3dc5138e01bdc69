"""Steps of generalised alpha in one compiled loop, by Newton with a factor that is kept as long as it does its work.

The loop returns to its caller where it wants a new factor, and goes on from there. Arrays as in `motion`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.algebra.envelope import solve_one
from ancf_petsc.jit import kernel
from ancf_petsc.kernel.motion import out_of_balance
from ancf_petsc.material.tensor import inlined

DONE, WANTS_FACTOR, FAILED = range(3)


class Scheme(NamedTuple):
    """A step h of the method, in the notation of `motion/integrators/generalized_alpha`."""

    h: float
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    damping: float


class Test(NamedTuple):
    """When Newton ends: the balance below `relative` times the forces, `absolute`, or `rounding` times |x|.

    slow: a fall of the balance by less asks for a new factor. most: iterations.
    """

    relative: float
    absolute: float
    rounding: float
    slow: float
    most: int


class Progress(NamedTuple):
    """Where the loop stands; the caller hands it back.

    iteration: of the step at work. newton: iterations of the steps done. waiting: for a factor, with d and its
    balance made.
    """

    step: int
    iteration: int
    newton: int
    before: float
    aged: bool
    waiting: bool


@inlined
def begin(scheme, v, a, d, still):
    """First guess of d, and what of M's factor does not depend on it."""
    h, am, af, beta, gamma, damping = scheme
    of_v = -am / (beta * h) + damping * ((1 - af) + af * (1 - gamma / beta))
    of_a = (1 - am) - am * (0.5 / beta - 1) + damping * af * h * (1 - 0.5 * gamma / beta)
    for i in range(v.shape[0]):
        for c in range(3):
            d[i, c] = h * v[i, c] + h * h / 2 * a[i, c]
            still[i, c] = of_v * v[i, c] + of_a * a[i, c]


@inlined
def finish(scheme, x, v, a, d):
    """State at the end of the step."""
    h, _, _, beta, gamma, _ = scheme
    for i in range(v.shape[0]):
        for c in range(3):
            end = (d[i, c] - h * v[i, c]) / (beta * h * h) - (0.5 / beta - 1) * a[i, c]
            v[i, c] += h * ((1 - gamma) * a[i, c] + gamma * end)
            a[i, c] = end
            x[i, c] += d[i, c]


@inlined
def add_to(x, factor, y):
    """x + factor y in x, fields (n, 3)."""
    for i in range(x.shape[0]):
        for c in range(3):
            x[i, c] += factor * y[i, c]


@inlined
def norm(x):
    """Of a field (n, 3)."""
    total = 0.0
    for i in range(x.shape[0]):
        for c in range(3):
            total += x[i, c] ** 2
    return np.sqrt(total)


@register_jitable
def evaluate(x, d, rules, loads, system):
    """The balance of the step in the buffer of values (n, 3), 0 where driven. Returns its norm and that of the forces."""
    (h, am, af, beta, gamma, damping), _, _, (carried, still, values) = rules
    share = system[2][3]
    inertia = am / (beta * h * h) + damping * af * gamma / (beta * h)
    for i in range(d.shape[0]):
        for c in range(3):
            carried[i, c] = still[i, c] + inertia * d[i, c]
    scale = np.sqrt(out_of_balance((x, d, carried), af, loads, system, values)) / af
    for i in range(d.shape[0]):
        for c in range(3):
            values[i, c] = values[i, c] / af if share[i, c] != 0.0 else 0.0
    return norm(values), scale


@register_jitable
def newton(fields, begun, rules, loads, system):
    """Iterations on d until it balances or a factor is wanted. fields: x, d. begun: iterations, last norm, aged, waiting.

    Returns (status, iterations, last norm, whether aged).
    """
    (x, d), (_, test, solver, (_, _, values)) = fields, rules
    relative, absolute, rounding, slow, most = test
    iteration, before, aged, waiting = begun
    floor = rounding * norm(x)
    while True:
        if not waiting:
            residual, forces = evaluate(x, d, rules, loads, system)
            aged = aged or (iteration > 0 and residual > slow * before)
            before = residual
            if residual <= max(relative * forces, absolute, floor):
                return DONE, iteration, before, aged
            if not np.isfinite(residual) or iteration == most:
                return FAILED, iteration, before, aged
            if aged:
                return WANTS_FACTOR, iteration, before, aged
        waiting = False
        solve_one(solver[0], solver[1], values.reshape(-1))
        add_to(d, -1.0, values)
        iteration += 1


@kernel
def alpha_steps(state, progress, rules, loads, system):
    """Go on to the step after the last of the loads' factors; x, v, a move on. Returns (status, Progress as a plain tuple).

    state: x, v, a, d, the increment of positions of the step at work. rules: `Scheme`; `Test`; starts and factor of the derivative
    of the balance by d over its 3 n components (`envelope`); buffers (3, n, 3), which are kept while the loop waits for a factor.
    """
    x, v, a, d = state
    step, iteration, done, before, aged, waiting = progress
    factors, patterns = loads
    still = rules[3][1]
    while step < factors.shape[0]:
        if not waiting:
            begin(rules[0], v, a, d, still)
            iteration, before = 0, np.inf
        begun = (iteration, before, aged, waiting)
        status, iteration, before, aged = newton((x, d), begun, rules, (factors[step], patterns), system)
        if status != DONE:
            return status, (step, iteration, done, before, aged, status == WANTS_FACTOR)
        finish(rules[0], x, v, a, d)
        step, done, waiting = step + 1, done + iteration, False
    return DONE, (step, 0, done, before, aged, False)
