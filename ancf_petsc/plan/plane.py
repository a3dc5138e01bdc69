"""The plane a plane body moves in: that of its mesh, and for a straight beam the one that the case determines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.plan.space import Space

NodesOf = Callable[[str, str], NDArray[np.int64]]
"""Nodes of a group, whose name stands under a key."""
ACROSS = 1e-9
"""A direction does not leave a plane when its component across is smaller than this part of it."""


def plane_normal(space: Space, spec: CaseSpec, nodes_of: NodesOf, file: Path | None) -> int | None:
    """The axis a plane body does not move along; None for a solid.

    Raises CaseError where a beam lies in no plane of the axes, where nothing determines its plane, and where something
    moves or loads a body across its plane.
    """
    if space.element.components == 3:
        return None
    flat = [i for i in range(3) if np.abs(space.axes[i]).max() < ACROSS]
    if not flat:
        raise CaseError(
            "the beam lies along no plane of the axes",
            file=file,
            key="mesh.file",
            expected="a line in a plane x-y, y-z or z-x",
            cure="turn the mesh",
        )
    acting = {
        i: key
        for key, vector in _actions(space, spec)
        for i in flat
        if abs(vector[i]) > ACROSS * np.linalg.norm(vector)
    }
    normal = flat[0] if len(flat) == 1 else _of_beam(space, spec, nodes_of, file, flat, acting)
    if normal in acting:
        raise CaseError(
            f"the body moves in the plane {_plane(normal)} and this acts along {AXES[normal]}",
            file=file,
            key=acting[normal],
            expected=f"nothing across the plane of element {space.element.code}",
            cure=f"drop the component along {AXES[normal]}, or take a solid element",
        )
    return normal


def _actions(space: Space, spec: CaseSpec) -> Iterator[tuple[str, NDArray]]:
    """What moves or loads the body: a key of the case and the directions it acts along, (3,)."""
    for number, load in enumerate(spec.load):
        yield f"load.{number}", np.array(load.vector)
    for row in spec.constraint:
        yield f"constraint.{row.group}.move", np.array([row.move.get(axis, 0.0) for axis in AXES])  # type: ignore[call-overload]
    if spec.initial:
        yield "initial.velocity", np.array(spec.initial.velocity)
        if spec.is_axisymmetric:
            return  # which says of itself that it does not rotate
        turning = np.abs(np.cross(spec.initial.spin, space.axes.T)).max(axis=0)
        about_itself = np.linalg.norm(turning) <= ACROSS * np.linalg.norm(spec.initial.spin)
        yield "initial.spin", np.zeros(3) if about_itself else turning


def _of_beam(
    space: Space,
    spec: CaseSpec,
    nodes_of: NodesOf,
    file: Path | None,
    flat: list[int],
    acting: dict[int, str],
) -> int:
    """Of the two axes across a beam the one it does not move along: what acts decides, else what is held, else what the
    curve follows."""
    first, second = flat
    if len(acting) == 2:
        raise CaseError(
            f"{acting[first]} acts along {AXES[first]}, {acting[second]} along {AXES[second]}",
            file=file,
            key=acting[second],
            expected=f"one plane: element {space.element.code} moves in x-y, y-z or z-x",
            cure="drop one of them, or take a solid element",
        )
    if acting:
        return second if first in acting else first
    found = _by_supports(space, spec, nodes_of, flat)
    if found is None:
        curve = spec.output.curve
        followed = {curve.force.component, curve.stroke.component} & set(flat) if curve else set()
        found = (second if first in followed else first) if len(followed) == 1 else None
    if found is None:
        raise CaseError(
            "nothing determines the plane the beam moves in",
            file=file,
            key="constraint",
            expected=f"a load, a motion, a spin, a support or output.curve along one of {AXES[first]} and {AXES[second]}",
            cure=f'hold the other one along the whole beam, such as fix = ["{AXES[first]}"] for a motion in {_plane(first)}',
        )
    space.mesh.notes.append(f"the beam moves in the plane {_plane(found)}: supports or output.curve say so")
    return found


def _by_supports(space: Space, spec: CaseSpec, nodes_of: NodesOf, flat: list[int]) -> int | None:
    """The axis across the plane that supports speak of; None where they do not decide.

    Held everywhere: the axis across. Held somewhere where the other is nowhere: the axis within. Both held alike: either
    plane gives the same, so the first axis is across. Otherwise the plane in which supports leave no rigid motion.
    """
    held = {axis: np.zeros((2, len(space.nodes)), bool) for axis in flat}
    for row in spec.constraint:
        nodes = space.compact[nodes_of(row.group, f"constraint.{row.group}.group")]
        for axis in flat:
            held[axis][0, nodes] |= AXES[axis] in row.fix or AXES[axis] in row.move
            held[axis][1, nodes] |= AXES[axis] in row.slopes
    first, second = flat
    whole = [axis for axis in flat if held[axis][0].all()]
    somewhere = [axis for axis in flat if held[axis].any()]
    if len(whole) == 1:
        return whole[0]
    if len(somewhere) == 1:
        return second if first in somewhere else first
    if not somewhere:
        return None
    if np.array_equal(held[first], held[second]):
        return first
    steady = [axis for axis in flat if held[axis][0].sum() > 1 or held[axis].any(axis=1).all()]
    return (second if first in steady else first) if len(steady) == 1 else None


def _plane(normal: int) -> str:
    return "-".join(AXES[i] for i in range(3) if i != normal)
