"""The axis of a body of revolution, and what a case may do to one: all it says must be the same around the axis."""

from __future__ import annotations

from math import radians
from pathlib import Path

import numpy as np

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError, MeshError
from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.kernel.revolution import Revolution
from ancf_petsc.mesh.groups import parts_for_support
from ancf_petsc.mesh.mesh import Group, Integers
from ancf_petsc.plan.space import Space

ON_AXIS = 1e-9
"""Nodes closer to the axis than this times the size of the mesh lie on it."""
GROUP = "axis of revolution"
"""What messages call the nodes on it."""


def revolution_of(space: Space, spec: CaseSpec, normal: int | None, file: Path | None) -> Revolution | None:
    """The revolution that a case asks for, about an axis through the origin in the plane across `normal`; None for any other body.

    Raises CaseError for an axis out of the plane and for what acts differently around it, MeshError for nodes beyond the axis.
    """
    if not spec.is_axisymmetric:
        return None
    assert spec.section
    assert normal is not None
    within = [i for i in range(3) if i != normal]
    axis = AXES.index(spec.section.axis) if spec.section.axis else within[1]
    if axis == normal:
        raise CaseError(
            f"the section lies in the plane {AXES[within[0]]}-{AXES[within[1]]}",
            file=file,
            key="section.axis",
            got=AXES[axis],
            expected=f'"{AXES[within[0]]}" or "{AXES[within[1]]}"',
            cure="the axis of revolution lies in the plane of the section, or turn the mesh",
        )
    revolution = Revolution(sum(within) - axis, axis, radians(spec.section.angle or 360.0))
    _refuse_negative_radii(space, revolution)
    _refuse_what_differs_around(spec, revolution, file)
    return revolution


def on_axis(space: Space, revolution: Revolution) -> Integers:
    """Indices into the mesh's points of the nodes in use that lie on the axis."""
    return space.nodes[np.abs(space.points[:, revolution.radial]) <= ON_AXIS * space.mesh.size]


def axis_group(space: Space, revolution: Revolution) -> Group | None:
    """The nodes on the axis with the sides they make; None where there are none."""
    nodes = on_axis(space, revolution)
    if not len(nodes):
        return None
    group = Group(GROUP, nodes)
    return Group(GROUP, nodes, parts_for_support(space.mesh, group))


def _refuse_negative_radii(space: Space, revolution: Revolution) -> None:
    radii = space.points[:, revolution.radial]
    beyond = np.flatnonzero(radii < -ON_AXIS * space.mesh.size)
    if len(beyond):
        radial, axis = AXES[revolution.radial], AXES[revolution.axis]
        raise MeshError(
            f"{len(beyond)} nodes lie beyond the axis of revolution, {axis}, the first is node "
            f"{space.mesh.node_numbers[space.nodes[beyond[0]]]} at {radial} = {radii[beyond[0]]:.6g}",
            file=space.mesh.source,
            key="mesh.file",
            expected=f"all nodes at {radial} >= 0, the radius",
            cure=f'move the mesh, or give the other axis: [section] axis = "{radial}"',
        )


def _refuse_what_differs_around(spec: CaseSpec, revolution: Revolution, file: Path | None) -> None:
    """Forces, accelerations and velocities but those along the axis, and rotations."""
    axis = AXES[revolution.axis]
    acting = [(f"load.{number}", load.vector) for number, load in enumerate(spec.load)]
    if spec.initial:
        acting.append(("initial.velocity", spec.initial.velocity))
    for key, vector in acting:
        if any(vector[i] for i in range(3) if i != revolution.axis):
            raise CaseError(
                "this has a component across the axis of revolution, and around the axis components across it cancel",
                file=file,
                key=key,
                got=list(vector),
                expected=f"a component along {axis} alone",
                cure=f"drop what is not along {axis}, or take a solid element",
            )
    if spec.initial and any(spec.initial.spin):
        raise CaseError(
            "a body of revolution moves in the plane of its section and does not rotate",
            file=file,
            key="initial.spin",
            got=list(spec.initial.spin),
            expected="no spin",
            cure="drop it, or take a solid element",
        )
