"""The table of driven degrees of freedom: contradictions in any order, what may be driven twice, what is held besides."""

from __future__ import annotations

from itertools import permutations
from types import SimpleNamespace

import numpy as np
import pytest

from ancf_petsc.errors import CaseError
from ancf_petsc.model.drive import HELD, Drive
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.plan.supports.table import SupportTable

LINEAR, COSINE = Ramp("linear"), Ramp("cosine")


def table_of(*supports):
    """The finished table of six nodes, numbered from 10, without slopes. supports: name, nodes, drives by axis."""
    part = SimpleNamespace(
        vectors=6,
        positions=lambda group: group.nodes,
        element=SimpleNamespace(has_slopes=False),
        normal=None,
        mesh=SimpleNamespace(node_numbers=np.arange(10, 16)),
        space=SimpleNamespace(nodes=np.arange(6), node_of=lambda: np.arange(6)),
    )
    table = SupportTable(part)
    for name, nodes, drives in supports:
        group = SimpleNamespace(name=name, nodes=np.array(nodes))
        table.prescribe(group, {"xyz".index(axis): drive for axis, drive in drives.items()})
    return table


@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize(
    ("one", "other"),
    [
        (Drive(1.0, LINEAR), Drive(2.0, LINEAR)),
        (Drive(1.0, LINEAR), Drive(1.0, COSINE)),
        (Drive(1.0, LINEAR), HELD),
    ],
)
def test_two_drives_of_one_degree_of_freedom_are_refused_in_any_order(one, other, order):
    """The third support has nothing to do with it, but may be the first of the table."""
    supports = [("a", [0, 1, 2], {"z": one}), ("b", [2, 3], {"z": other}), ("c", [5], {"x": HELD})]
    with pytest.raises(
        CaseError, match="contradict each other: 1 nodes are driven twice in z, the first is node 12"
    ):
        table_of(*(supports[k] for k in order))


def test_the_same_drive_twice_is_one():
    move = Drive(1.0, LINEAR)
    table = table_of(("a", [0, 1], {"z": move}), ("b", [1, 2], {"z": move, "x": HELD}))
    moved = table.drives.index(move)
    assert table.drive[:, 2].tolist() == [moved] * 3 + [-1] * 3
    assert table.drives[table.drive[1, 0]] == HELD
    assert (table.drive[[0, 3, 4, 5], 0] == -1).all()


def test_holding_leaves_what_is_moved():
    table = table_of(("a", [0, 1], {"z": Drive(1.0, LINEAR)}))
    table.hold(np.arange(3), 2)
    table.finish()
    assert [table.drives[k].amplitude for k in table.drive[:3, 2]] == [1.0, 1.0, 0.0]
    assert (table.drive[3:, 2] == -1).all()


def test_a_drive_by_nothing_is_holding():
    table = table_of(("a", [0], {"z": Drive(0.0, COSINE)}), ("b", [0], {"z": HELD}))
    assert table.drives == [HELD]
