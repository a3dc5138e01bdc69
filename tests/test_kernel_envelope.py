"""Factors in the envelope against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import random_array

from ancf_petsc.algebra.envelope import envelope, factorise, solve_fields

N = 40


def definite(seed: int):
    """A sparse symmetric positive definite matrix: dense, and its rows."""
    half = random_array((N, N), density=0.06, random_state=np.random.default_rng(seed))
    matrix = (half + half.T).tocsr() + 0.0
    dense = matrix.toarray()
    dense[np.diag_indices(N)] = np.abs(dense).sum(axis=1) + 1.0
    rows = [np.flatnonzero(row) for row in dense]
    pointers = np.concatenate(([0], np.cumsum([len(row) for row in rows])))
    columns = np.concatenate(rows).astype(np.int32)
    return dense, pointers, columns, dense[np.repeat(np.arange(N), np.diff(pointers)), columns]


@pytest.mark.parametrize("sets", [1, 3])
def test_components_with_rows_of_their_own_left_out(sets):
    """One factor for all components, or one for each."""
    dense, pointers, columns, values = definite(sets)
    free = np.ones((sets, N), bool)
    for k in range(sets):
        free[k, [3 + k, 17, 30 + k]] = False
    starts = envelope(pointers, columns)
    factors = np.full((sets, starts[-1]), np.nan)
    for k in range(sets):
        assert factorise(starts, pointers, columns, values, free[k], factors[k])
    b = np.random.default_rng(5).normal(size=(N, 3))
    found, which = b.copy(), np.arange(3) % sets
    solve_fields(starts, factors, which, found, np.empty((3, N)))
    for c in range(3):
        rows = np.flatnonzero(free[which[c]])
        expected = np.zeros(N)
        expected[rows] = np.linalg.solve(dense[np.ix_(rows, rows)], b[rows, c])
        np.testing.assert_allclose(found[:, c], expected, atol=1e-14)  # rounding of a well-posed system


def test_a_matrix_that_is_not_positive_definite_is_told():
    dense, pointers, columns, values = definite(1)
    place = pointers[20] + np.searchsorted(columns[pointers[20] : pointers[21]], 20)
    values[place] = -1.0
    starts = envelope(pointers, columns)
    assert not factorise(starts, pointers, columns, values, np.ones(N, bool), np.empty(starts[-1]))


def test_the_envelope_begins_at_the_first_entry_of_a_row():
    pointers, columns = np.array([0, 2, 3, 6]), np.array([0, 2, 1, 0, 1, 2], np.int32)
    assert envelope(pointers, columns).tolist() == [0, 1, 2, 5]
