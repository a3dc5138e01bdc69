"""Which degrees of freedom are driven, and by what. Tabulated on the root rank, over all nodal vectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.errors import CaseError
from ancf_petsc.model.ramp import Ramp

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Drive:
    """A prescribed displacement: amplitude times ramp. Held degrees of freedom have amplitude 0."""

    amplitude: float
    ramp: Ramp

    def value(self, s: float) -> float:
        return self.amplitude * self.ramp.value(s)


HELD = Drive(0.0, Ramp("constant"))


@dataclass(frozen=True)
class Support:
    """One [[constraint]] of a case on the nodal vectors it drives: axis -> drive."""

    group: str
    vectors: NDArray[np.int64]
    drives: dict[int, Drive]


@dataclass
class ConstraintTable:
    """drive (v, 3): index into drives of each degree of freedom, -1 where it is free."""

    drive: NDArray[np.int32]
    drives: list[Drive]

    def hold(self, vectors: NDArray[np.int64], axis: int) -> None:
        """Hold a component of nodal vectors where nothing else drives it."""
        if len(vectors):
            free = vectors[self.drive[vectors, axis] < 0]
            self.drive[free, axis] = _index_of(HELD, self.drives)


def tabulate(supports: Sequence[Support], total: int, node_numbers: NDArray) -> ConstraintTable:
    """Enter all supports into one table over `total` nodal vectors.

    Raises CaseError where two supports drive the same degree of freedom differently.
    """
    table = ConstraintTable(np.full((total, 3), -1, np.int32), [])
    groups: list[str] = []
    source = np.full((total, 3), -1, np.int32)
    for number, support in enumerate(supports):
        groups.append(support.group)
        for axis, drive in support.drives.items():
            index = _index_of(drive, table.drives)
            present = table.drive[support.vectors, axis]
            clash = (present >= 0) & (present != index)
            if clash.any():
                vector = support.vectors[np.argmax(clash)]
                other = groups[source[vector, axis]]
                raise CaseError(
                    f"the constraints on {other!r} and {support.group!r} contradict each other: "
                    f"{int(clash.sum())} nodes are driven twice in {AXES[axis]}, "
                    f"the first is node {node_numbers[vector]}",
                    key=f"constraint.{support.group}.{AXES[axis]}",
                    got=_words(drive),
                    expected=f"{_words(table.drives[present[np.argmax(clash)]])} as {other!r} asks",
                    cure="fix or move each degree of freedom once, or take the shared nodes out of one group",
                )
            table.drive[support.vectors, axis] = index
            source[support.vectors, axis] = number
    return table


def _index_of(drive: Drive, drives: list[Drive]) -> int:
    if drive.amplitude == 0.0:
        drive = HELD
    if drive not in drives:
        drives.append(drive)
    return drives.index(drive)


def _words(drive: Drive) -> str:
    if drive.amplitude == 0.0:
        return "held"
    return f"moved by {drive.amplitude:g} ({drive.ramp.kind})"
