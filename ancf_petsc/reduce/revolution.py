"""Whether a scene is one of revolution about an axis: all of a ring, or a sector of it between planes of symmetry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from ancf_petsc.reduce.actions import SAME, SceneAction, directions, targets
from ancf_petsc.reduce.shape import CLOSE, Floats, Simplices, departure
from ancf_petsc.reduce.symmetry import MirrorPlane, SceneModel, different, flat_normal, place

TURNS = (0.1180, 0.2639, 0.3820, 0.5279, 0.6459, 0.7639, 0.9098)
"""Parts of the sector by which a body is rotated to see whether it stays what it is; no two are in a simple ratio."""
WHOLE = 2.0 * np.pi
NEAR = 1e-3
"""Of a cosine: directions within 2.6 degrees of a principal axis of a coarse mesh may be that of the body."""


@dataclass(frozen=True)
class Ring:
    """A sector of a body of revolution: an axis through `point` (3,) along `axis` (3,), the sector's angle, from `start` (3,) on.

    walls: keys of the supports on the planes that bound the sector. across (3,): third direction, right-handed.
    """

    point: Floats
    axis: Floats
    start: Floats
    angle: float = WHOLE
    walls: tuple[str, ...] = ()

    @property
    def across(self) -> Floats:
        return np.cross(self.axis, self.start)

    @property
    def is_whole(self) -> bool:
        """Whether it goes all the way around."""
        return self.angle == WHOLE

    def coordinates(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Radius, angle in [0, 2 pi), and height over `point` (k,) of points (k, 3)."""
        arms = points - self.point
        x, y = arms @ self.start, arms @ self.across
        return np.hypot(x, y), np.arctan2(y, x) % WHOLE, arms @ self.axis

    def rotated(self, points: Floats, part: float) -> Floats:
        """Points rotated by a part of the sector; what leaves it is mirrored back into it."""
        radius, angle, height = self.coordinates(points)
        angle = angle + part * self.angle
        if not self.is_whole:
            angle = np.abs((angle + self.angle) % (2 * self.angle) - self.angle)
        flat = np.cos(angle)[:, None] * self.start + np.sin(angle)[:, None] * self.across
        return self.point + radius[:, None] * flat + height[:, None] * self.axis


def ring_of(scene: SceneModel) -> tuple[Ring | None, str]:
    """The ring that a scene is a sector of, and why it is not the one that is likeliest."""
    reasons = []
    for ring in _candidates(scene):
        reason = why_no_ring(scene, ring)
        if not reason:
            return ring, ""
        reasons.append(f"about the axis through {place(ring.point)} along {place(ring.axis)}: {reason}")
    return None, next(iter(reasons), "there is no axis about which it could be one of revolution")


def walls_of(scene: SceneModel) -> list[tuple[SceneAction, MirrorPlane]]:
    """Flat supports that hold exactly their normal: planes of symmetry of the body that the scene is a part of."""
    found = []
    for action in scene.actions:
        normal = flat_normal(action.shape) if action.kind == "support" else None
        if (
            normal is not None
            and not action.amount.any()
            and np.abs(action.held - np.outer(normal, normal)).max() <= CLOSE
        ):
            found.append((action, MirrorPlane(action.shape.corners[0, 0], normal)))
    return found


def _candidates(scene: SceneModel) -> list[Ring]:
    """Axes where planes of symmetry meet; else in the only one, else through the middle: along axes and principal axes."""
    walls = walls_of(scene)
    found = []
    for i, (_, one) in enumerate(walls):
        for _, other in walls[i + 1 :]:
            axis = np.cross(one.normal, other.normal)
            if np.linalg.norm(axis) > CLOSE:
                system = np.array([one.normal, other.normal, axis])
                point = np.linalg.solve(
                    system, [one.normal @ one.point, other.normal @ other.point, axis @ scene.centre]
                )
                found.append((point, axis / np.linalg.norm(axis)))
    for _, plane in walls:
        found += [
            (point - plane.heights(point[None])[0] * plane.normal, axis)
            for axis in _directions(scene)
            for point in _middles(scene, axis)
        ]
    found += [(point, axis) for axis in _directions(scene) for point in _middles(scene, axis)]
    return [ring for point, axis in found if (ring := _sector(scene, point, axis, walls)) is not None]


def _middles(scene: SceneModel, axis: Floats) -> list[Floats]:
    """Points an axis may go through: the centre of the circle that the outermost nodes lie on, if they do, and the body's middle.

    A half has the circle of the whole; the middle is that of the body but for chords.
    """
    across = np.linalg.svd(axis[None])[2][1:].T
    flat = (scene.mesh.points[np.unique(scene.surface.facets)] - scene.centre) @ across
    outermost = flat[ConvexHull(flat).vertices]
    system = np.column_stack((2.0 * outermost, np.ones(len(outermost))))
    (u, v, _), *_ = np.linalg.lstsq(system, (outermost**2).sum(axis=1), rcond=None)
    if np.ptp(np.linalg.norm(outermost - [u, v], axis=1)) > CLOSE * scene.size:
        return [scene.centre]
    way = across @ [u, v]
    return [scene.centre + np.where(np.abs(way) <= CLOSE * scene.size, 0.0, way), scene.centre]


def _directions(scene: SceneModel) -> list[Floats]:
    """The principal axis whose moment differs from two equal ones, and the axes.

    Moments of a mesh are those of the body but for chords: before it stand the directions near it that are known, axes, normals of
    flat groups, directions of loads.
    """
    values, vectors = np.linalg.eigh(scene.inertia)
    odd = 0 if abs(values[2] - values[1]) < abs(values[1] - values[0]) else 2
    own = vectors[:, odd] * np.sign(vectors[np.abs(vectors[:, odd]).argmax(), odd])
    axes = [np.eye(3)[i] for i in np.argsort(-np.abs(own))]
    flat = [normal for action in scene.actions if (normal := flat_normal(action.shape)) is not None]
    loads = [action.amount for action in scene.actions] + [vector for _, vector, _ in directions(scene.case)]
    known = [*axes, *flat, *(vector / np.linalg.norm(vector) for vector in loads if vector.any())]
    near = [vector for vector in known if abs(vector @ own) > 1.0 - NEAR]
    return different([*near, own, *axes])


def _sector(
    scene: SceneModel, point: Floats, axis: Floats, walls: list[tuple[SceneAction, MirrorPlane]]
) -> Ring | None:
    """The ring about an axis with the planes of symmetry that contain it; None where they are more than two."""
    axis = axis * np.sign(axis[np.abs(axis).argmax()])
    own = [
        (action, plane)
        for action, plane in walls
        if abs(plane.normal @ axis) <= CLOSE and abs(plane.heights(point[None])[0]) <= CLOSE * scene.size
    ]
    middle = scene.centre - point
    middle = middle - (middle @ axis) * axis
    if not own:
        start = np.linalg.svd(axis[None])[2][1]
        return Ring(point, axis, start)
    keys = tuple(action.key for action, _ in own)
    ways = [_way(action.shape, point, axis) for action, _ in own]
    if np.linalg.norm(middle) <= CLOSE * scene.size:
        return None
    planes = {tuple(np.round(np.abs(plane.normal), 6)) for _, plane in own}
    if len(planes) == 1:
        start = np.cross(own[0][1].normal, axis)
        ring = Ring(point, axis, start, np.pi, keys)
        return ring if middle @ ring.across > 0 else Ring(point, axis, -start, np.pi, keys)
    if len(own) != 2 or any(np.linalg.norm(way) <= CLOSE * scene.size for way in ways):
        return None
    one, other = (way / np.linalg.norm(way) for way in ways)
    for first, last in ((one, other), (other, one)):
        ring = Ring(point, axis, first)
        angle = float(ring.coordinates((point + last)[None])[1][0])
        if float(ring.coordinates((point + middle)[None])[1][0]) < angle:
            return Ring(point, axis, first, angle, keys)
    return None


def _way(shape: Simplices, point: Floats, axis: Floats) -> Floats:
    """From the axis to the middle of a shape, across the axis (3,)."""
    arm = shape.corners.reshape(-1, 3).mean(axis=0) - point
    return arm - (arm @ axis) * axis


def why_no_ring(scene: SceneModel, ring: Ring) -> str:
    """Why a scene is not one of revolution about an axis; empty if it is."""
    for key, vector, kind in directions(scene.case):
        if kind == "spin":
            return f"{key}: the body rotates"
        if np.linalg.norm(np.cross(vector, ring.axis)) > SAME * np.linalg.norm(vector):
            return f"{key}: {place(vector)} is not along the axis"
    if len(scene.case.spec.material) > 1:
        return "material: there are several, and sections are made of one"
    acting = acting_on(scene, ring)
    return next((why for action in acting if (why := _differs(ring, action))), "") or _moves(
        scene, ring, acting
    )


def acting_on(scene: SceneModel, ring: Ring) -> list[SceneAction]:
    """What acts on a scene beside the planes of symmetry that bound the sector."""
    walls = {id(action) for action, _ in walls_of(scene) if action.key in ring.walls}
    return [action for action in scene.actions if id(action) not in walls]


def _differs(ring: Ring, action: SceneAction) -> str:
    """Why what acts differs around the axis."""
    name = " and ".join(action.groups)
    turn = np.cross(np.eye(3), ring.axis)
    if np.abs(turn @ action.held - action.held @ turn).max() > CLOSE:
        return f"{action.key}: components held on {name} differ around the axis"
    if np.linalg.norm(np.cross(action.amount, ring.axis)) > SAME * np.linalg.norm(action.amount):
        return f"{action.key}: what it does to {name} is not along the axis"
    return ""


def _moves(scene: SceneModel, ring: Ring, acting: list[SceneAction]) -> str:
    """Why a shape is not what it was after a rotation."""
    checks = [("the surface", outside(scene, ring), scene.surface.shape)]
    for action in acting:
        found = targets(action, acting, action.held, action.amount)
        checks.append((f"{action.key}: {' and '.join(action.groups)}", action.shape, found[0]))
    for name, shape, target in checks:
        points, slack = shape.samples
        for part in TURNS:
            worst, which = departure(ring.rotated(points, part), slack, target, scene.size)
            if worst > CLOSE:
                turned = f"rotated by {np.degrees(part * ring.angle):.4g} degrees"
                return f"{name} at {place(points[which])}, {turned}, lies off by {worst * scene.size:.3g}"
    return ""


def on_walls(scene: SceneModel, ring: Ring) -> NDArray[np.bool_]:
    """(t,) which facets of the surface lie on the planes that bound the sector."""
    found = np.zeros(len(scene.surface.facets), bool)
    for action, plane in walls_of(scene):
        if action.key in ring.walls:
            heights = np.abs(plane.heights(scene.mesh.points))[scene.surface.facets]
            found |= (heights <= CLOSE * scene.size).all(axis=1)
    return found


def outside(scene: SceneModel, ring: Ring) -> Simplices:
    """The surface without what lies on the planes that bound the sector."""
    kept = ~on_walls(scene, ring)
    return Simplices(scene.mesh.points[scene.surface.facets[kept]], scene.surface.slack[kept])
