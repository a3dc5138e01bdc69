"""The pair of Dormand and Prince, orders 5 and 4, in one compiled loop with PETSc's control of the step.

J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19. Control: the error is the mean square of the
difference of the two orders, each component over its tolerance; a step is accepted where it is below 1, and the next
one is 0.9 error^(-1/5) times as long, half of that after the second failure in a row, a tenth to ten times
(TSAdapt "basic"). Arrays as in `motion`, and
    y (2, n, 3)           positions and velocities
    stages (7, 2, n, 3), trial (2, n, 3)  overwritten
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import composed, kernel

STEPS = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
"""Weights of the stages before each; those of the last are the step of order 5."""
LOWER = np.array([5179 / 57600, 0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40])
DIFFERENCE = LOWER - np.append(STEPS[-1], 0.0)
SAFETY, AGAIN, SHORTER, LONGER = 0.9, 0.5, 0.1, 10.0
REACHED, MORE, TOO_SHORT, NOT_FINITE = range(4)


@register_jitable
def combine(y, h, weights, stages, count, trial):
    """trial = y + h sum of weights times stages, all flat."""
    trial[:] = y
    for j in range(count):
        factor, stage = h * weights[j], stages[j]
        if factor != 0.0:
            for m in range(trial.size):
                trial[m] += factor * stage[m]


@register_jitable
def error_of(h, stages, position, speed):
    """Root mean square of the difference of the two orders over the tolerances of positions and velocities."""
    half, total = stages.shape[1] // 2, 0.0
    for part in range(2):
        square, first = 0.0, part * half
        for m in range(first, first + half):
            e = 0.0
            for j in range(7):
                e += DIFFERENCE[j] * stages[j, m]
            square += e * e
        total += square / (speed if part else position) ** 2
    return h * np.sqrt(total / stages.shape[1])


@register_jitable
def largest(v):
    """Of the magnitudes of a field (n, 3)."""
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


@register_jitable
def size_of(left, proposed):
    """Of the next step: two equal ones rather than one and a tiny rest."""
    size = min(left, proposed)
    return left / 2 if size < left < 2 * size else size


def leap_kernel(rates: Callable) -> Callable:
    """From where the body is to a goal, by steps of the pair."""

    @composed
    def attempt(y, h, tolerances, system, flat, stages, trial):
        """The stages of a step h, the state it ends with in trial (2, n, 3); returns its error."""
        for i in range(1, 7):
            combine(y.reshape(-1), h, STEPS[i], flat, i, trial.reshape(-1))
            rates(trial, *system, stages[i])
        return error_of(h, flat, *tolerances)

    @kernel
    def leap(y, span, most, control, damping, graph, system, stages, trial):
        """Move y on from span[0] to span[1] in at most `most` steps, none below span[2].

        control: step proposed, largest speed so far, tolerance of positions and of speeds in parts of that,
        growth of the speed that counts. Returns (status, time, steps, rejected, loss, proposed, speed).
        """
        time, goal, shortest = span
        proposed, speed, position, part, growth = control
        flat = stages.reshape(7, -1)
        steps, rejected, lost = 0, 0, 0.0
        rates(y, *system, stages[0])
        loss, rate = loss_of(graph, y[1], stages[0][1]) if damping != 0.0 else (0.0, 0.0)
        while time < goal and steps < most:
            asked = size_of(goal - time, proposed)
            h, again = asked, False
            while True:
                error = attempt(y, h, (position, part * speed), system, flat, stages, trial)
                if not np.isfinite(error):
                    return NOT_FINITE, time, steps, rejected, lost, proposed, speed
                safety = SAFETY * AGAIN if again and error > 1.0 else SAFETY
                factor = safety * error**-0.2 if error > 0.0 else LONGER
                following = h * min(max(factor, SHORTER), LONGER)
                if error <= 1.0:
                    break
                h, again, rejected = following, True, rejected + 1
                if h <= shortest:
                    return TOO_SHORT, time, steps, rejected, lost, proposed, speed
            kept = asked < proposed and h >= asked * (1 - 1e-9)  # not less for having been cut short
            proposed = max(proposed, following) if kept else following
            time = goal if abs(time + h - goal) <= shortest else time + h
            y[:], stages[0], steps = trial, stages[6], steps + 1
            top = largest(y[1])
            speed = top if top > growth * speed else speed
            if damping != 0.0:
                before, before_rate = loss, rate
                loss, rate = loss_of(graph, y[1], stages[0][1])
                lost += damping * (h / 2 * (before + loss) + h * h / 12 * (before_rate - rate))
        return MORE if time < goal else REACHED, time, steps, rejected, lost, proposed, speed

    return leap
