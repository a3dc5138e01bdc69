"""What acts on a body, with the shape it acts on: what a symmetry of the body must map onto itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ancf_petsc.axes import AXES
from ancf_petsc.input.load import Case
from ancf_petsc.input.loads import ForceSpec
from ancf_petsc.mesh.groups import cells_of, parts_for_support
from ancf_petsc.mesh.mesh import Mesh
from ancf_petsc.mesh.parts import outer_sides
from ancf_petsc.plan.plan import Plan
from ancf_petsc.plan.supports.frames import PARALLEL
from ancf_petsc.plan.supports.normal import plane_of
from ancf_petsc.reduce.shape import CLOSE, BoundarySurface, Floats, Simplices, triangles

SAME = 1e-9
"""Directions and amounts that differ by less than this times their largest are the same; planes of nodes up to CLOSE."""


@dataclass(frozen=True)
class SceneAction:
    """What a table of the case does, for messages by its key, on a shape.

    held (3, 3): projector onto the components that are prescribed. amount (3,): their displacement, or the force, at factor 1.
    ramp: how it comes. kind: actions of one kind and ramp can be mapped onto each other. groups: names of what it acts on.
    """

    key: str
    kind: str
    shape: Simplices
    held: Floats
    amount: Floats
    ramp: object = None
    groups: tuple[str, ...] = ()

    def same(self, other: SceneAction, held: Floats, amount: Floats) -> bool:
        """Whether `other` does what this one becomes with `held` and `amount`."""
        scale = max(float(np.abs(amount).max()), float(np.abs(other.amount).max()))
        return (
            (self.kind, self.ramp) == (other.kind, other.ramp)
            and bool(np.abs(held - other.held).max() <= CLOSE)
            and bool(np.abs(amount - other.amount).max() <= SAME * scale)
        )


def actions_on_shapes(case: Case, plan: Plan, surface: BoundarySurface) -> list[SceneAction]:
    """Supports, forces and materials."""
    return [*_supports(case, plan, surface), *_forces(case, plan, surface), *_materials(case, plan.mesh)]


def _supports(case: Case, plan: Plan, surface: BoundarySurface) -> list[SceneAction]:
    """One for each group and ramp, and each dimension of what the group is meshed with."""
    by_group: dict[tuple[str, object], list[tuple[Floats, float]]] = {}
    for row in case.spec.constraint:
        ramp = row.ramp if any(row.move.values()) else None
        own = by_group.setdefault((row.group, ramp), [])
        own += [(np.eye(3)[AXES.index(axis)], amount) for axis, amount in row.move.items()]
        own += [(_direction(plan, row.group, word), 0.0) for word in row.fix]
    return [
        SceneAction(f"constraint.{name}", "support", shape, held, amount, ramp, (name,))
        for (name, ramp), directions_held in by_group.items()
        for held, amount in [_held(directions_held)]
        for shape in _shapes_of_support(plan.mesh, surface, name)
    ]


def _direction(plan: Plan, name: str, word: str) -> Floats:
    """The unit vector (3,) that a word of `fix` holds a group along."""
    if word in AXES:
        return np.eye(3)[AXES.index(word)]
    return plane_of(plan.supports.part, plan.mesh.groups[name], f"constraint.{name}.fix")


def _held(directions_held: list[tuple[Floats, float]]) -> tuple[Floats, Floats]:
    """Projector (3, 3) onto what is held, and the displacement (3,) in it, from directions and displacements along them."""
    if not directions_held:
        return np.zeros((3, 3)), np.zeros(3)
    rows = np.array([direction for direction, _ in directions_held])
    inverse = np.linalg.pinv(rows, rcond=PARALLEL)
    return inverse @ rows, inverse @ np.array([amount for _, amount in directions_held])


def _shapes_of_support(mesh: Mesh, surface: BoundarySurface, name: str) -> list[Simplices]:
    """Faces, edges and points of a group, each kind a shape; nodes that belong to its faces or edges are no points."""
    slack, group = surface.at_nodes(), mesh.groups[name]
    parts = parts_for_support(mesh, group)
    covered = np.concatenate([rows.ravel() for d, rows in parts.items() if d] or [np.empty(0, np.int64)])
    alone = np.setdiff1d(group.nodes, covered)
    kinds = [triangles(rows) if d == 2 else rows[:, :2] for d, rows in parts.items() if d in (1, 2)]
    if len(alone) and not any(d == 2 for d in parts):
        kinds.append(alone[:, None])
    return [Simplices(mesh.points[rows], slack[rows].max(axis=1)) for rows in kinds]


def targets(action: SceneAction, others: list[SceneAction], held: Floats, amount: Floats) -> list[Simplices]:
    """Shapes that an action, which does `held` and `amount` after a symmetry, may come to lie on.

    Supports that do the same are one, whatever groups they are in; each force is shared over its own group.
    """
    corners = action.shape.corners.shape[1]
    shapes = [o.shape for o in others if action.same(o, held, amount) and o.shape.corners.shape[1] == corners]
    if action.kind != "support" or len(shapes) < 2:
        return shapes
    return [Simplices(np.concatenate([s.corners for s in shapes]), np.concatenate([s.slack for s in shapes]))]


def _forces(case: Case, plan: Plan, surface: BoundarySurface) -> list[SceneAction]:
    return [
        SceneAction(
            f"load.{number}",
            "force",
            surface.of_group(plan.mesh.groups[load.group]),
            np.zeros((3, 3)),
            np.array(load.total),
            load.ramp,
            (load.group,),
        )
        for number, load in enumerate(case.spec.load)
        if isinstance(load, ForceSpec) and any(load.total)
    ]


def _materials(case: Case, mesh: Mesh) -> list[SceneAction]:
    """The regions of materials, where there are several."""
    found = []
    for row in case.spec.material if len(case.spec.material) > 1 else ():
        if row.group is None:
            continue
        corners = mesh.cells[cells_of(mesh, mesh.groups[row.group])]
        sides = triangles(outer_sides(mesh.kind, corners, len(mesh.points)))
        shape = Simplices(mesh.points[sides], np.zeros(len(sides)))
        law = (row.law, row.young, row.poisson, row.density)
        found.append(
            SceneAction(
                f"material.{row.group}", "material", shape, np.zeros((3, 3)), np.zeros(3), law, (row.group,)
            )
        )
    return found


def directions(case: Case) -> list[tuple[str, Floats, str]]:
    """What acts on the whole body: key of the case, vector (3,), "vector", or "spin" for a rotation about its own axis."""
    found = [
        (f"load.{number}", np.array(load.vector), "vector")
        for number, load in enumerate(case.spec.load)
        if not isinstance(load, ForceSpec)
    ]
    if case.spec.initial:
        found += [
            ("initial.velocity", np.array(case.spec.initial.velocity), "vector"),
            ("initial.spin", np.array(case.spec.initial.spin), "spin"),
        ]
    return [(key, vector, kind) for key, vector, kind in found if vector.any()]
