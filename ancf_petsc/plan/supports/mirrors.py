"""Planes of symmetry of a case, from what its constraints and forces do to sides of cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.input.loads import ForceSpec
from ancf_petsc.mesh.groups import parts_for_load
from ancf_petsc.model.drive import Drive
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.symmetry import Held, Mirror, Sheared, planes_of_symmetry


class Prescribed(NamedTuple):
    """A constraint: its group, axis -> drive, and the parts of the group by dimension."""

    group: str
    drives: Mapping[int, Drive]
    parts: dict[int, NDArray[np.int64]]


def mirrors_of(part: Part, prescribed: Sequence[Prescribed]) -> list[Mirror]:
    """The planes of symmetry, which the log names. A beam's ends are points, no planes."""
    dimension, mesh = part.element.cell.dimension - 1, part.mesh
    if dimension < 1:
        return []
    none = np.empty((0, 1), np.int64)
    held = []
    for group, drives, parts in prescribed:
        resting = frozenset(axis for axis, drive in drives.items() if not drive.amplitude)
        held.append(Held(group, frozenset(drives), resting, parts.get(dimension, none)))
    sheared = []
    for number, load in enumerate(part.spec.load):
        if isinstance(load, ForceSpec):
            found, rows = parts_for_load(mesh, part.group(load.group, f"load.{number}.group"))
            axes = frozenset(i for i in range(3) if load.total[i])
            sheared.append(Sheared(axes, rows if found == dimension else none))
    mirrors = planes_of_symmetry(mesh.points, mesh.size, part.normal, held, sheared)
    mesh.notes.extend(
        f"{mirror.group} is taken as a plane of symmetry normal to {AXES[mirror.normal]}: the slope across it keeps its "
        f"direction at {len(mirror.nodes)} nodes"
        for mirror in mirrors
    )
    return mirrors
