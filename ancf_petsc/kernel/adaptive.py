"""Adaptive pairs of explicit Runge-Kutta methods in one compiled loop, with PETSc's control of the step.

Control: the error is the mean square of the difference of the two orders, each component over its tolerance; a step is accepted
where it is below 1, and the next one is 0.9 error^(-1/order) times as long, half of that after the second failure in a row, a tenth
to ten times (TSAdapt "basic"). Arrays as in `motion`.
"""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
from ancf_petsc.kernel.motion import rates_at
from ancf_petsc.material.tensor import inlined

SAFETY, AGAIN, SHORTER, LONGER = 0.9, 0.5, 0.1, 10.0
REACHED, MORE, TOO_SHORT, NOT_FINITE = range(4)


@inlined
def copy(given, into):
    """Of a flat array."""
    for m in range(given.size):
        into[m] = given[m]


@inlined
def combine(y, h, weights, stages, trial):
    """trial = y + h sum of weights times stages, all flat."""
    copy(y, trial)
    for j in range(weights.size):
        factor, stage = h * weights[j], stages[j]
        if factor != 0.0:
            for m in range(trial.size):
                trial[m] += factor * stage[m]


@inlined
def error_of(h, difference, stages, position, speed):
    """Root mean square of the difference of the two orders over the tolerances of positions and velocities."""
    half, total = stages.shape[1] // 2, 0.0
    for part in range(2):
        square, first = 0.0, part * half
        for m in range(first, first + half):
            e = 0.0
            for j in range(difference.size):
                e += difference[j] * stages[j, m]
            square += e * e
        total += square / (speed if part else position) ** 2
    return h * np.sqrt(total / stages.shape[1])


@inlined
def largest(v):
    """Largest magnitude of a component of a field (n, 3)."""
    top = 0.0
    for i in range(v.shape[0]):
        for c in range(3):
            top = max(top, abs(v[i, c]))
    return top


@register_jitable
def loss_of(graph, v, a):
    """v . M v and its rate of change, 2 a . M v."""
    pointers, columns, values = graph
    loss = rate = 0.0
    for i in range(v.shape[0]):
        for k in range(pointers[i], pointers[i + 1]):
            for c in range(3):
                carried = values[k] * v[columns[k], c]
                loss += carried * v[i, c]
                rate += 2 * carried * a[i, c]
    return loss, rate


@inlined
def size_of(left, proposed):
    """Of the next step: two equal ones rather than one and a tiny rest."""
    size = min(left, proposed)
    return left / 2 if size < left < 2 * size else size


@register_jitable
def attempt(y, h, method, given, into):
    """The stages of a step h after the first and its end into stages (s, 2, n, 3) and trial (2, n, 3). given: loads, system."""
    rows, weights, _, _, reuses_last = method
    (loads, system), (stages, trial) = given, into
    flat = stages.reshape(stages.shape[0], -1)
    for i in range(1, stages.shape[0]):
        combine(y.reshape(-1), h, rows[i, :i], flat, trial.reshape(-1))
        rates_at(trial, loads, system, stages[i])
    if not reuses_last:
        combine(y.reshape(-1), h, weights, flat, trial.reshape(-1))


@inlined
def next_size(h, error, order, again):
    """What the control proposes after a step h with this error. again: whether the one before it failed."""
    safety = SAFETY * AGAIN if again and error > 1.0 else SAFETY
    factor = safety * error ** (-1.0 / order) if error > 0.0 else LONGER
    return h * min(max(factor, SHORTER), LONGER)


@kernel
def leap(y, method, course, loads, system):
    """Move y on to a goal. Returns (status, time, steps, rejected, loss, proposed, speed).

    method: stages, weights, difference, order and reuses_last of a `RungeKutta`. course: span and control; span: time, goal,
    shortest step, most steps; control: step proposed, largest speed so far, tolerance of positions and of speeds in parts of that,
    growth of the speed that counts.
    """
    (time, goal, shortest, most), (proposed, speed, position, part, growth) = course
    _, _, difference, order, reuses_last = method
    damping, graph = system[1], system[3]
    stages, trial = np.empty((difference.size, *y.shape)), np.empty(y.shape)
    flat = stages.reshape(stages.shape[0], -1)
    steps, rejected, lost = 0, 0, 0.0
    rates_at(y, loads, system, stages[0])
    loss, rate = loss_of(graph, y[1], stages[0][1]) if damping != 0.0 else (0.0, 0.0)
    while time < goal and steps < most:
        asked = size_of(goal - time, proposed)
        h, again = asked, False
        while True:
            attempt(y, h, method, (loads, system), (stages, trial))
            error = error_of(h, difference, flat, position, part * speed)
            if not np.isfinite(error):
                return NOT_FINITE, time, steps, rejected, lost, proposed, speed
            following = next_size(h, error, order, again)
            if error <= 1.0:
                break
            h, again, rejected = following, True, rejected + 1
            if h <= shortest:
                return TOO_SHORT, time, steps, rejected, lost, proposed, speed
        kept = asked < proposed and h >= asked * (1 - 1e-9)  # not less for having been cut short
        proposed = max(proposed, following) if kept else following
        time = goal if abs(time + h - goal) <= shortest else time + h
        copy(trial.reshape(-1), y.reshape(-1))
        steps += 1
        if reuses_last:
            copy(flat[-1], flat[0])
        else:
            rates_at(y, loads, system, stages[0])
        top = largest(y[1])
        speed = top if top > growth * speed else speed
        if damping != 0.0:
            before, before_rate = loss, rate
            loss, rate = loss_of(graph, y[1], stages[0][1])
            lost += damping * (h / 2 * (before + loss) + h * h / 12 * (before_rate - rate))
    return MORE if time < goal else REACHED, time, steps, rejected, lost, proposed, speed
