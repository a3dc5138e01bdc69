"""The table of explicit methods: each has the order it claims, and so has the step it is judged by."""

import numpy as np
import pytest

from ancf_petsc.kernel.explicit import EXPLICIT, method

each_method = pytest.mark.parametrize("name", EXPLICIT)


def rates(y):
    """A pendulum of unit frequency, with a clock: nonlinear, and every condition of order counts."""
    return np.array([y[1], -np.sin(y[0]) + 0.3 * np.cos(y[2]), 1.0])


def end(row, weights, steps):
    """The state at time 1."""
    y, h = np.array([1.0, 0.5, 0.0]), 1.0 / steps
    for _ in range(steps):
        stages = []
        for given in row.stages:
            stages.append(rates(y + h * sum(a * k for a, k in zip(given, stages, strict=False))))
        y = y + h * np.array(weights) @ np.array(stages)
    return y


@each_method
def test_the_error_falls_with_the_order(name):
    """By 2^order when steps are halved; steps from 1/16 to 1/64 are short enough for that to hold to 15 %."""
    row = EXPLICIT[name]
    claims = [(row.weights, row.order)] + ([] if row.lower is None else [(row.lower, row.order - 1)])
    for weights, order in claims:
        exact = end(EXPLICIT["5dp"], EXPLICIT["5dp"].weights, 512)
        errors = [np.linalg.norm(end(row, weights, steps) - exact) for steps in (16, 32, 64)]
        found = np.log2(np.array(errors[:-1]) / errors[1:])
        np.testing.assert_allclose(found, order, atol=0.2)


@each_method
def test_the_last_stage_is_reused_where_it_is_the_rate_at_the_end(name):
    """Dormand and Prince's; PETSc's control then takes s - 1 evaluations a step."""
    assert EXPLICIT[name].reuses_last == (name == "5dp")


def test_wrong_weights_are_refused():
    with pytest.raises(ValueError, match="middle: weights are not of order 2"):
        method("middle", 2, [[0.5]], [0.1, 0.9])
