"""`fix = ["normal"]`: a plane group whose nodes stay in its plane, whatever its orientation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.input.schema import ConstraintSpec
from ancf_petsc.mesh.mesh import Group
from ancf_petsc.model.drive import HELD
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.supports.table import SupportTable

FLAT = 1e-6
"""Nodes farther from a plane than this times the size of the mesh do not lie in it."""
ALIGNED = 1e-9
"""A normal with components across an axis below this is that axis."""


def enter(spec: ConstraintSpec, part: Part, table: SupportTable) -> None:
    """Hold the component normal to the group's plane; that of an axis as `fix` of the axis does."""
    if "normal" not in spec.fix:
        return
    key = f"constraint.{spec.group}.fix"
    group = part.group(spec.group, f"constraint.{spec.group}.group")
    normal = plane_of(part, group, key)
    along = axis_of(normal)
    if along is not None:
        table.prescribe(group, {along: HELD})
        return
    if part.revolution is not None:
        raise CaseError(
            "around the axis of a body of revolution an oblique plane is a cone",
            file=part.file,
            key=key,
            got=["normal"],
            expected=f"a line along {AXES[part.revolution.axis]} or {AXES[part.revolution.radial]}",
            cure="fix an axis",
        )
    if part.element.has_slopes:
        raise CaseError(
            f"element {part.element.code} has slopes, and the group's plane the normal ({', '.join(f'{c:.6g}' for c in normal)})",
            file=part.file,
            key=key,
            got=["normal"],
            expected="a plane normal to an axis, or an element without slopes",
            cure="turn the mesh, or take an element such as 3-10-1-3",
        )
    table.prescribe_normal(group, normal)


def axis_of(normal: NDArray[np.float64]) -> int | None:
    """The axis that a unit vector (3,) lies along, None for none."""
    along = int(np.argmax(np.abs(normal)))
    return along if np.abs(np.delete(normal, along)).max() < ALIGNED else None


def plane_of(part: Part, group: Group, key: str) -> NDArray[np.float64]:
    """Unit normal (3,) of the plane, of a plane body the line, that a group's nodes lie in, its largest component positive.

    Raises CaseError where they lie in none, or in many.
    """
    axes = part.space.axes
    if axes.shape[1] < 2:
        raise CaseError(
            "a beam's nodes have no normal",
            file=part.file,
            key=key,
            got=["normal"],
            expected="axes",
            cure='such as ["x"]',
        )
    points = part.mesh.points[group.nodes]
    arms = (points - points.mean(axis=0)) @ axes
    values, directions = np.linalg.eigh(arms.T @ arms)
    across, slack = directions[:, 0], FLAT * part.mesh.size
    if values[1] <= len(arms) * slack**2 or len(arms) < axes.shape[1]:
        raise CaseError(
            f"the group's {len(points)} nodes lie on a line or at a point: they span no plane",
            file=part.file,
            key=key,
            got=["normal"],
            expected="a group that is a flat face"
            if axes.shape[1] == 3
            else "a group that is a straight side",
            cure="hold axes, or give a group with more of the face",
        )
    normal = axes @ across
    off = float(np.abs(arms @ across).max())
    if off > slack:
        raise CaseError(
            f"the group is not plane: its nodes leave the nearest plane by up to {off:.3g}",
            file=part.file,
            key=key,
            got=["normal"],
            expected=f"less than {slack:.3g}, {FLAT:g} of the mesh's size",
            cure="divide the group into plane ones, a [[constraint]] for each",
        )
    return normal * np.sign(normal[np.argmax(np.abs(normal))])
