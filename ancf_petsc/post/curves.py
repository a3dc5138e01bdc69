"""Numbers from a force-stroke curve. Arrays are (rows,), in the order of the run, unloading included."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Curve = NDArray[np.float64]


def work_done(stroke: ArrayLike, force: ArrayLike) -> Curve:
    """Work (rows,) of the force since the first row, by the trapezoidal rule."""
    stroke, force = _pair(stroke, force)
    steps = np.diff(stroke) * (force[1:] + force[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(steps)])


def energy_absorbed(stroke: ArrayLike, force: ArrayLike) -> float:
    """Work the body keeps at the last row: of loading alone all of it, of a closed loop what was lost."""
    return float(work_done(stroke, force)[-1])


def energy_loaded(stroke: ArrayLike, force: ArrayLike) -> float:
    """Work put in up to the largest stroke."""
    stroke, force = _pair(stroke, force)
    return float(work_done(stroke, force)[_furthest(stroke)])


def initial_stiffness(stroke: ArrayLike, force: ArrayLike) -> float:
    """Slope at the first row, of second order in the step where there are three rows to take it from."""
    stroke, force = _loading(stroke, force)
    if len(stroke) < 2:
        return float("nan")
    return float(np.gradient(force, stroke, edge_order=2 if len(stroke) > 2 else 1)[0])


def secant_stiffness(stroke: ArrayLike, force: ArrayLike) -> float:
    """Change of force over change of stroke from the first row to the largest stroke."""
    stroke, force = _loading(stroke, force)
    with np.errstate(invalid="ignore", divide="ignore"):
        return float((force[-1] - force[0]) / (stroke[-1] - stroke[0]))


def force_at(stroke: ArrayLike, force: ArrayLike, wanted: ArrayLike) -> Curve:
    """Force at the wanted strokes while loading, linear between rows; nan beyond the largest stroke."""
    stroke, force = _loading(stroke, force)
    sign = -1.0 if stroke[-1] < stroke[0] else 1.0
    return np.interp(sign * np.asarray(wanted, float), sign * stroke, force, left=np.nan, right=np.nan)


def is_compression(stroke: ArrayLike, force: ArrayLike) -> bool:
    """Whether stroke and force both are negative where the stroke is largest."""
    stroke, force = _pair(stroke, force)
    at = _furthest(stroke)
    return bool(stroke[at] < 0 and force[at] < 0)


def _pair(stroke: ArrayLike, force: ArrayLike) -> tuple[Curve, Curve]:
    stroke, force = np.asarray(stroke, float), np.asarray(force, float)
    if stroke.shape != force.shape or stroke.ndim != 1 or len(stroke) == 0:
        raise ValueError(f"stroke {stroke.shape} and force {force.shape} are no curve")
    return stroke, force


def _furthest(stroke: Curve) -> int:
    return int(np.argmax(np.abs(stroke - stroke[0])))


def _loading(stroke: ArrayLike, force: ArrayLike) -> tuple[Curve, Curve]:
    """The rows, first to largest stroke, that go on in the direction of the largest."""
    stroke, force = _pair(stroke, force)
    end = _furthest(stroke) + 1
    travel = np.abs(stroke[:end] - stroke[0])
    ahead = np.concatenate([[True], travel[1:] > np.maximum.accumulate(travel)[:-1]])
    return stroke[:end][ahead], force[:end][ahead]
