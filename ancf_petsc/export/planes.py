"""Supports along normals of planes as equations between components of a node, each of which gives one of them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.input.schema import CaseSpec, ConstraintSpec
from ancf_petsc.plan.plan import Plan
from ancf_petsc.plan.supports.frames import PARALLEL
from ancf_petsc.plan.supports.normal import axis_of, plane_of

Floats = NDArray[np.float64]
Terms = list[tuple[int, float]]
"""Components with their coefficients, the one that the equation gives first; their sum is zero."""


def plane_normals(plan: Plan, spec: CaseSpec) -> dict[str, Floats]:
    """Unit normals (3,) of the groups that supports hold along them."""
    groups = [row.group for row in spec.constraint if "normal" in row.fix]
    return {
        name: plane_of(plan.supports.part, plan.mesh.groups[name], f"constraint.{name}.fix")
        for name in groups
    }


def axes_held(row: ConstraintSpec, normals: dict[str, Floats]) -> list[str]:
    """The axes that a support's `fix` holds, that of a plane normal to one among them."""
    axes: list[str] = [axis for axis in row.fix if axis != "normal"]
    along = axis_of(normals[row.group]) if "normal" in row.fix else None
    return axes if along is None or AXES[along] in axes else [*axes, AXES[along]]


def equations(plan: Plan, spec: CaseSpec, normals: dict[str, Floats]) -> Iterator[tuple[int, Terms]]:
    """A node, index of the mesh's points, and the terms of each equation, for all planes that are normal to no axis.

    Components that supports prescribe along axes are given by no equation, but stand in it: so they may move.
    """
    oblique = {name: normal for name, normal in normals.items() if axis_of(normal) is None}
    if not oblique:
        return
    prescribed = np.zeros((len(plan.mesh.points), 3), bool)
    for row in spec.constraint:
        axes = [AXES.index(axis) for axis in (*axes_held(row, normals), *row.move)]
        prescribed[plan.mesh.groups[row.group].nodes[:, None], axes] = True
    member = np.stack(
        [np.isin(np.arange(len(prescribed)), plan.mesh.groups[name].nodes) for name in oblique], axis=1
    )
    nodes = np.flatnonzero(member.any(axis=1) & plan.mesh.used)
    asked, which = np.unique(np.hstack((member, prescribed))[nodes], axis=0, return_inverse=True)
    for number, row_asked in enumerate(asked):
        rows = np.array(list(oblique.values()))[row_asked[: len(oblique)]]
        terms = solved_for(rows, ~row_asked[len(oblique) :])
        for node in nodes[which.ravel() == number]:
            yield from ((int(node), own) for own in terms)


def solved_for(rows: Floats, free: NDArray[np.bool_]) -> list[Terms]:
    """Equations rows . u = 0, rows (m, 3), each solved for a free component that no other one has; those that say nothing new are
    left out."""
    rows, left, found = rows.copy(), free.copy(), []
    for k in range(len(rows)):
        size = np.abs(np.where(left, rows[k], 0.0))
        pivot = int(size.argmax())
        if size[pivot] < PARALLEL:
            continue
        left[pivot] = False
        found.append((k, pivot))
        rows[k] /= rows[k, pivot]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, pivot], rows[k])
        rows[others, pivot] = 0.0
    return [
        [(pivot, 1.0), *((i, float(rows[k, i])) for i in range(3) if i != pivot and rows[k, i])]
        for k, pivot in found
    ]
