"""Checks of runs that go on: how far they are from the uninterrupted ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from verify_table import Row, check, measure


@check(
    "Runs that go on",
    "the uninterrupted run on one rank: fields of all outputs, from the first, a middle and the last checkpoint",
)
def restart(folder: Path) -> Iterator[Row]:
    from restart_cases import followed, largest_difference, snapshots, with_checkpoints
    from test_restart import CASES

    for name, (data, every) in CASES.items():
        place = folder / name
        case = with_checkpoints(data, every)
        with snapshots(place) as kept:
            followed(case, place / "whole")
        largest = 0.0
        for snapshot in {kept[0], kept[len(kept) // 2], kept[-1]}:
            followed(case, snapshot, restart=True)
            largest = max(largest, largest_difference(place / "whole", snapshot))
        yield measure(f"{name}: largest difference over the largest number of the field", largest, 0.0)
