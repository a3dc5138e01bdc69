"""Planes about which a body, its supports and its loads are symmetric."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ancf_petsc.axes import AXES
from ancf_petsc.input.load import Case
from ancf_petsc.mesh.kinds import KINDS, part_sizes
from ancf_petsc.mesh.mesh import Mesh
from ancf_petsc.plan.plan import Plan
from ancf_petsc.reduce.actions import SAME, SceneAction, actions_on_shapes, directions, targets
from ancf_petsc.reduce.shape import CLOSE, BoundarySurface, Floats, Simplices, departure

DISTINCT = 1e-3
"""Principal moments that differ by less than this times the largest have no axes of their own."""


@dataclass(frozen=True)
class MirrorPlane:
    """A plane through `point` (3,) with the unit normal (3,)."""

    point: Floats
    normal: Floats

    @property
    def axis(self) -> int | None:
        """The axis it is normal to, None for none."""
        along = np.abs(self.normal)
        return int(along.argmax()) if along.max() > 1.0 - SAME else None

    def heights(self, points: Floats) -> Floats:
        """Distances (k,) of points (k, 3), positive on the side of the normal."""
        return (points - self.point) @ self.normal

    def image(self, points: Floats) -> Floats:
        """Mirror images of points (k, 3)."""
        return points - 2.0 * self.heights(points)[:, None] * self.normal

    @property
    def matrix(self) -> Floats:
        """(3, 3) what it makes of vectors."""
        return np.eye(3) - 2.0 * np.outer(self.normal, self.normal)

    def describe(self) -> str:
        """Such as "x = 0.05"."""
        level = float(self.point @ self.normal)
        level = 0.0 if abs(level) < 1e-9 * max(float(np.abs(self.point).max()), 1e-300) else level
        if self.axis is not None:
            sign = self.normal[self.axis]
            return f"{AXES[self.axis]} = {level * sign + 0.0:.6g}"
        return f"({', '.join(f'{c:.4g}' for c in np.round(self.normal, 9) + 0.0)}) . x = {level:.6g}"


class SceneModel:
    """A case on its mesh, with what symmetries are looked for in: its surface, what acts on it, its middle and principal axes."""

    def __init__(self, case: Case, plan: Plan) -> None:
        self.case, self.plan, self.mesh = case, plan, plan.mesh
        self.surface = BoundarySurface(plan.mesh)
        self.actions = actions_on_shapes(case, plan, self.surface)
        self.volume, middle, self.inertia = moments(plan.mesh)
        self.centre = self._neat(middle)

    @property
    def size(self) -> float:
        """What tolerances refer to."""
        return self.mesh.size

    def _neat(self, middle: Floats) -> Floats:
        """The middle of the body, half way between its extremes where it is there but for chords and rounding."""
        points = self.mesh.points[self.mesh.used]
        between = (points.min(axis=0) + points.max(axis=0)) / 2
        near = np.abs(between - middle) <= CLOSE * self.size + float(self.surface.slack.max(initial=0.0))
        return np.where(near, between, middle)

    def why_not(self, plane: MirrorPlane) -> str:
        """Why the scene is not symmetric about a plane; empty if it is."""
        return (
            self._body(plane)
            or next((why for row in directions(self.case) if (why := _breaks(plane, *row))), "")
            or next((why for action in self.actions if (why := self._unmatched(plane, action))), "")
        )

    def _body(self, plane: MirrorPlane) -> str:
        if abs(plane.heights(self.centre[None])[0]) > CLOSE * self.size + float(self.surface.slack.max()):
            return f"its middle, {place(self.centre)}, is not on the plane"
        return self._off(plane, self.surface.shape, self.surface.shape, "the surface")

    def _off(self, plane: MirrorPlane, shape: Simplices, target: Simplices, what: str) -> str:
        points, slack = shape.samples
        worst, which = departure(plane.image(points), slack, target, self.size)
        if worst <= CLOSE:
            return ""
        return f"{what} at {place(points[which])} has no mirror image: it lies off by {worst * self.size:.3g}"

    def _unmatched(self, plane: MirrorPlane, action: SceneAction) -> str:
        held, amount = plane.matrix @ action.held @ plane.matrix, plane.matrix @ action.amount
        partners = targets(action, self.actions, held, amount)
        name = " and ".join(action.groups)
        if not partners:
            return f"{action.key}: what it does to {name} has no mirror image"
        found = [self._off(plane, action.shape, shape, f"{action.key}: {name}") for shape in partners]
        return "" if not all(found) else found[0]


def _breaks(plane: MirrorPlane, key: str, vector: Floats, kind: str) -> str:
    """Why a vector is not its own mirror image; a spin is when it is normal to the plane."""
    image = plane.matrix @ vector * (-1.0 if kind == "spin" else 1.0)
    if np.abs(image - vector).max() <= SAME * np.abs(vector).max():
        return ""
    return f"{key}: its direction {place(vector)} is not {'normal to' if kind == 'spin' else 'in'} the plane"


def place(point: Floats) -> str:
    return f"({', '.join(f'{value:.6g}' for value in point)})"


def moments(mesh: Mesh) -> tuple[float, Floats, Floats]:
    """Volume, centre (3,) and second moments (3, 3) about the centre of a solid mesh of straight cells."""
    kind = KINDS[KINDS[mesh.kind].linear or mesh.kind]
    simplices = np.array(kind.simplices)
    corners = mesh.points[mesh.cells[:, simplices].reshape(-1, 4)]
    sizes = part_sizes(corners.reshape(-1, 3), np.arange(4 * len(corners)).reshape(-1, 4), KINDS["tetra"])
    sizes /= kind.fold
    volume = float(sizes.sum())
    centre = sizes @ corners.mean(axis=1) / volume
    arms = corners - centre
    total = arms.sum(axis=1)
    second = np.einsum("e,eai,eaj->ij", sizes, arms, arms) + np.einsum("e,ei,ej->ij", sizes, total, total)
    return volume, centre, second / 20.0


def mirror_planes(scene: SceneModel) -> list[MirrorPlane]:
    """Planes about which the scene is symmetric, those normal to axes first."""
    return [plane for plane in candidates(scene) if not scene.why_not(plane)]


def candidates(scene: SceneModel) -> list[MirrorPlane]:
    """Planes through the middle that are worth a look: normal to axes, to principal axes, to flat supports, and between these."""
    values, vectors = np.linalg.eigh(scene.inertia)
    gaps = np.abs(values[:, None] - values) + np.eye(3) * values.max()
    own = [vectors[:, k] for k in range(3) if gaps[k].min() > DISTINCT * values.max()]
    flat = [normal for action in scene.actions if (normal := flat_normal(action.shape)) is not None]
    first = different([*np.eye(3), *own, *flat])
    between = [
        sign * b + a
        for i, a in enumerate(first)
        for b in first[i + 1 :]
        if abs(a @ b) < SAME
        for sign in (1.0, -1.0)
    ]
    return [
        MirrorPlane(scene.centre, normal)
        for normal in different([*first, *(v / np.sqrt(2.0) for v in between)])
    ]


def flat_normal(shape: Simplices) -> Floats | None:
    """The normal of a shape that lies in a plane."""
    points = shape.corners.reshape(-1, 3)
    if shape.corners.shape[1] < 3:
        return None
    _, sizes, vectors = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    return vectors[2] if sizes[2] <= CLOSE * sizes[0] else None


def different(normals: list[Floats]) -> list[Floats]:
    """Unit normals without those that repeat an earlier one up to its sign."""
    kept: list[Floats] = []
    for normal in normals:
        unit = normal / np.linalg.norm(normal)
        if all(abs(unit @ other) < 1.0 - CLOSE for other in kept):
            kept.append(unit)
    return kept
