"""The table of driven degrees of freedom: contradictions in any order, what may be driven twice, what is held besides."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from ancf_petsc.errors import CaseError
from ancf_petsc.model.constraint import HELD, Motion, Support, tabulate
from ancf_petsc.model.ramp import Ramp

LINEAR, COSINE = Ramp("linear"), Ramp("cosine")
NUMBERS = np.arange(10, 16)


def support(group, nodes, **motions):
    return Support(group, np.array(nodes), {"xyz".index(axis): motion for axis, motion in motions.items()})


@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize(
    ("one", "other"),
    [
        (Motion(1.0, LINEAR), Motion(2.0, LINEAR)),
        (Motion(1.0, LINEAR), Motion(1.0, COSINE)),
        (Motion(1.0, LINEAR), HELD),
    ],
)
def test_two_motions_of_one_degree_of_freedom_are_refused_in_any_order(one, other, order):
    """The third support has nothing to do with it, but may be the first of the table."""
    supports = [support("a", [0, 1, 2], z=one), support("b", [2, 3], z=other), support("c", [5], x=HELD)]
    with pytest.raises(
        CaseError, match="contradict each other: 1 nodes are driven twice in z, the first is node 12"
    ):
        tabulate([supports[k] for k in order], 6, NUMBERS)


def test_the_same_motion_twice_is_one():
    move = Motion(1.0, LINEAR)
    table = tabulate([support("a", [0, 1], z=move), support("b", [1, 2], z=move, x=HELD)], 6, NUMBERS)
    moved = table.motions.index(move)
    assert table.motion[:, 2].tolist() == [moved] * 3 + [-1] * 3
    assert table.motions[table.motion[1, 0]] == HELD
    assert (table.motion[[0, 3, 4, 5], 0] == -1).all()


def test_holding_leaves_what_is_moved():
    move = Motion(1.0, LINEAR)
    table = tabulate([support("a", [0, 1], z=move)], 6, NUMBERS)
    table.hold(np.arange(3), 2)
    assert [table.motions[k].amplitude for k in table.motion[:3, 2]] == [1.0, 1.0, 0.0]
    assert (table.motion[3:, 2] == -1).all()


def test_a_motion_of_nothing_is_holding():
    table = tabulate([support("a", [0], z=Motion(0.0, COSINE)), support("b", [0], z=HELD)], 6, NUMBERS)
    assert table.motions == [HELD]
