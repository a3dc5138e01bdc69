"""Whether a scene is prismatic between two planes of symmetry: plane strain."""

from __future__ import annotations

import numpy as np

from ancf_petsc.reduce.actions import SAME, directions, targets
from ancf_petsc.reduce.revolution import TURNS, walls_of
from ancf_petsc.reduce.shape import CLOSE, Floats, Simplices, departure
from ancf_petsc.reduce.symmetry import SceneModel


def prism_of(scene: SceneModel) -> tuple[int, float] | None:
    """The axis that a body is prismatic along, held at both ends, with nothing acting along it, and its length; else None."""
    points = scene.mesh.points[scene.mesh.used]
    for axis in range(3):
        low, high = points[:, axis].min(), points[:, axis].max()
        if _held_ends(scene, axis, low, high) and _same_along(scene, axis, low, high):
            return axis, float(high - low)
    return None


def _held_ends(scene: SceneModel, axis: int, low: float, high: float) -> set[str]:
    """Keys of the supports on both ends; empty where one has none."""
    levels: dict[str, float] = {}
    for action, plane in walls_of(scene):
        if abs(plane.normal[axis]) > 1.0 - SAME:
            for height in np.unique(np.round(action.shape.corners[..., axis], 12)):
                levels[action.key] = height
    slack = CLOSE * scene.size
    ends = [{key for key, height in levels.items() if abs(height - level) <= slack} for level in (low, high)]
    return ends[0] | ends[1] if all(ends) else set()


def _same_along(scene: SceneModel, axis: int, low: float, high: float) -> bool:
    """Whether body and actions stay what they are when moved along an axis; what leaves the body is mirrored back into it."""
    if any(
        kind == "spin" or abs(vector[axis]) > SAME * np.abs(vector).max()
        for _, vector, kind in directions(scene.case)
    ):
        return False
    if len(scene.case.spec.material) > 1:
        return False
    ends = _held_ends(scene, axis, low, high)
    acting = [action for action in scene.actions if action.key not in ends]
    for action in acting:
        across = np.delete(action.held[axis], axis)
        scale = np.abs(action.amount).max()
        if np.abs(across).max() > CLOSE or (scale and abs(action.amount[axis]) > SAME * scale):
            return False
    facets = scene.surface.facets
    heights = scene.mesh.points[facets][..., axis]
    flat = np.ptp(heights, axis=1) <= CLOSE * scene.size
    mantle = Simplices(scene.mesh.points[facets[~flat]], scene.surface.slack[~flat])
    level = heights[flat].mean(axis=1)
    inner = (level > low + CLOSE * scene.size) & (level < high - CLOSE * scene.size)
    if inner.any():
        return False
    return all(
        _maps(scene, shape, target, axis, low, high)
        for shape, target in [
            (mantle, scene.surface.shape),
            *((a.shape, targets(a, acting, a.held, a.amount)[0]) for a in acting),
        ]
    )


def _maps(scene: SceneModel, shape: Simplices, target: Simplices, axis: int, low: float, high: float) -> bool:
    points, slack = shape.samples
    for part in TURNS:
        moved: Floats = points.copy()
        length = high - low
        place = points[:, axis] - low + part * length
        moved[:, axis] = low + length - np.abs(place % (2 * length) - length)
        if departure(moved, slack, target, scene.size)[0] > CLOSE:
            return False
    return True
