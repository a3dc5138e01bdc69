"""The closed lines of a profile: traced, and without the points they can do without."""

from __future__ import annotations

import numpy as np

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.mesh import Integers
from ancf_petsc.reduce.profile import Profile
from ancf_petsc.reduce.shape import Floats

STRAIGHT = 0.02
"""Of an edge: points of the section nearer than this to the straight line between others are left out."""


def simplified(profile: Profile) -> Profile:
    """A profile without the points that straight lines can do without, and that no group ends at."""
    loops = traced(profile)
    ends = np.zeros(len(profile.points), bool)
    for marks in profile.marks.values():
        ends[marks] = True
    kept: list[Integers] = []
    segments, parents = [], []
    for points, own in loops:
        labels = (
            np.array([inside[own] for inside in profile.lines.values()])
            .reshape(len(profile.lines), len(own))
            .T
        )
        fixed = ends[points] | (labels != np.roll(labels, 1, axis=0)).any(axis=1)
        chosen = _corners(profile.points[points], fixed, STRAIGHT * profile.sizes[points])
        first = sum(len(rows) for rows in kept)
        kept.append(points[chosen])
        numbers = first + np.arange(len(chosen))
        segments.append(np.stack((numbers, np.roll(numbers, -1)), axis=1))
        parents.append(own[chosen])
    every, parent = np.concatenate(kept), np.concatenate(parents)
    number = np.full(len(profile.points), -1)
    number[every] = np.arange(len(every))
    return Profile(
        profile.points[every],
        np.concatenate(segments),
        profile.sizes[every],
        {name: inside[parent] for name, inside in profile.lines.items()},
        {name: number[marks] for name, marks in profile.marks.items()},
    )


def traced(profile: Profile) -> list[tuple[Integers, Integers]]:
    """Closed lines: their points (k,) in order, and the segments (k,) from each to the next. Raises CaseError where they branch."""
    n = len(profile.points)
    around = np.bincount(profile.segments.ravel(), minlength=n)
    if (around[around > 0] != 2).any():
        raise CaseError("the section of the body is bounded by no closed lines", key="--to", got="section")
    order = np.argsort(profile.segments.ravel(), kind="stable")
    at = np.full((n, 2), -1)
    at[around > 0] = (order // 2).reshape(-1, 2)
    left = np.ones(len(profile.segments), bool)
    loops = []
    while left.any():
        segment = int(left.argmax())
        node = int(profile.segments[segment, 0])
        points, own = [], []
        while left[segment]:
            left[segment] = False
            points.append(node)
            own.append(segment)
            a, b = profile.segments[segment]
            node = int(b if a == node else a)
            one, other = at[node]
            segment = int(other if one == segment else one)
        loops.append((np.array(points), np.array(own)))
    return loops


def _corners(points: Floats, fixed: Floats, slack: Floats) -> Integers:
    """Which points (k, 2) of a closed line are kept: fixed ones, and between them what departs (Douglas and Peucker)."""
    start = int(fixed.argmax()) if fixed.any() else int(np.lexsort(points.T)[0])
    order = (start + np.arange(len(points) + 1)) % len(points)
    stops = [0, *(k for k in range(1, len(points)) if fixed[order[k]]), len(points)]
    if len(stops) == 2:
        stops.insert(1, int(np.linalg.norm(points[order] - points[start], axis=1).argmax()))
    kept = {0}
    spans = list(zip(stops, stops[1:], strict=False))
    kept |= set(stops[:-1])
    while spans:
        a, b = spans.pop()
        if b - a < 2:
            continue
        along = points[order[b]] - points[order[a]]
        arms = points[order[a + 1 : b]] - points[order[a]]
        length = max(float(np.linalg.norm(along)), 1e-300)
        off = np.abs(along[0] * arms[:, 1] - along[1] * arms[:, 0]) / length
        k = a + 1 + int(off.argmax())
        if off.max() > slack[order[k]]:
            kept.add(k)
            spans += [(a, k), (k, b)]
    return order[sorted(kept)]
