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
class Motion:
    """A prescribed displacement: amplitude times ramp. Held degrees of freedom have amplitude 0."""

    amplitude: float
    ramp: Ramp

    def value(self, s: float) -> float:
        return self.amplitude * self.ramp.value(s)


HELD = Motion(0.0, Ramp("constant"))


@dataclass(frozen=True)
class Support:
    """One [[constraint]] of a case on the nodal vectors it drives: axis -> motion."""

    group: str
    vectors: NDArray[np.int64]
    motions: dict[int, Motion]


@dataclass
class ConstraintTable:
    """motion (v, 3): index into motions of each degree of freedom, -1 where it is free."""

    motion: NDArray[np.int32]
    motions: list[Motion]

    def hold(self, vectors: NDArray[np.int64], axis: int) -> None:
        """Hold a component of nodal vectors where nothing else drives it."""
        if len(vectors):
            free = vectors[self.motion[vectors, axis] < 0]
            self.motion[free, axis] = _index_of(HELD, self.motions)


def tabulate(supports: Sequence[Support], total: int, node_numbers: NDArray) -> ConstraintTable:
    """Enter all supports into one table over `total` nodal vectors.

    Raises CaseError where two supports drive the same degree of freedom differently.
    """
    table = ConstraintTable(np.full((total, 3), -1, np.int32), [])
    groups: list[str] = []
    source = np.full((total, 3), -1, np.int32)
    for number, support in enumerate(supports):
        groups.append(support.group)
        for axis, motion in support.motions.items():
            index = _index_of(motion, table.motions)
            present = table.motion[support.vectors, axis]
            clash = (present >= 0) & (present != index)
            if clash.any():
                vector = support.vectors[np.argmax(clash)]
                other = groups[source[vector, axis]]
                raise CaseError(
                    f"the constraints on {other!r} and {support.group!r} contradict each other: "
                    f"{int(clash.sum())} nodes are driven twice in {AXES[axis]}, "
                    f"the first is node {node_numbers[vector]}",
                    key=f"constraint.{support.group}.{AXES[axis]}",
                    got=_words(motion),
                    expected=f"{_words(table.motions[present[np.argmax(clash)]])} as {other!r} asks",
                    cure="fix or move each degree of freedom once, or take the shared nodes out of one group",
                )
            table.motion[support.vectors, axis] = index
            source[support.vectors, axis] = number
    return table


def _index_of(motion: Motion, motions: list[Motion]) -> int:
    if motion.amplitude == 0.0:
        motion = HELD
    if motion not in motions:
        motions.append(motion)
    return motions.index(motion)


def _words(motion: Motion) -> str:
    if motion.amplitude == 0.0:
        return "held"
    return f"moved by {motion.amplitude:g} ({motion.ramp.kind})"
