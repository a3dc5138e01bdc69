"""Which cells points lie in, apart from the one they belong to."""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from ancf_petsc.jit import kernel
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Floats, Integers

MOST_BINS = 128
"""Of the grid the points are sorted into, along an axis."""
WITHIN = -1e-9
"""A point is in a cell when its barycentric coordinates there are all larger: on a side counts."""


def other_cells(points: Floats, kind: str, cells: Integers, places: Floats, owners: Integers) -> Integers:
    """For each of places (q, 3) the lowest cell of cells (e, k), other than its owner (q,), that it lies in (q,), else -1.

    points: (n, 3) of the mesh. A plane body must lie across the third axis.
    """
    if not len(places):
        return np.empty(0, dtype=np.int64)
    shape = KINDS[kind]
    simplices = np.array(shape.simplices)[: len(shape.simplices) // shape.fold]
    low = places.min(axis=0)
    length = np.maximum(places.max(axis=0) - low, 1e-300)
    wide = length > 1e-6 * length.max()
    spacing = (np.prod(length[wide]) / len(places)) ** (1 / np.count_nonzero(wide))
    bins = np.where(wide, np.clip(np.ceil(length / spacing), 1, MOST_BINS), 1).astype(np.int64)
    index = np.minimum((places - low) / length * bins, bins - 1).astype(np.int64)
    number = (index[:, 0] * bins[1] + index[:, 1]) * bins[2] + index[:, 2]
    order = np.argsort(number, kind="stable")
    first = np.searchsorted(number[order], np.arange(bins.prod() + 1))
    return locate(
        points, np.ascontiguousarray(cells), simplices, places, owners, low, length, bins, order, first
    )


@kernel
def locate(points, cells, simplices, places, owners, low, length, bins, order, first):
    """Every cell looks into the bins its box touches."""
    found = np.full(places.shape[0], -1, np.int64)
    lowest, highest = np.empty(3), np.empty(3)
    start, stop = np.empty(3, np.int64), np.empty(3, np.int64)
    flat = 2 if simplices.shape[1] == 3 else 3
    for e in range(cells.shape[0]):
        reach = True
        for i in range(3):
            lowest[i], highest[i] = points[cells[e, 0], i], points[cells[e, 0], i]
            for a in range(1, cells.shape[1]):
                lowest[i] = min(lowest[i], points[cells[e, a], i])
                highest[i] = max(highest[i], points[cells[e, a], i])
            below = (lowest[i] - low[i]) / length[i] * bins[i]
            above = (highest[i] - low[i]) / length[i] * bins[i]
            reach = reach and above >= -1e-9 and below <= bins[i] * (1.0 + 1e-9)
            start[i] = int(min(max(below, 0.0), bins[i] - 1.0))
            stop[i] = int(min(max(above, 0.0), bins[i] - 1.0))
        if not reach:
            continue
        for x in range(start[0], stop[0] + 1):
            for y in range(start[1], stop[1] + 1):
                bin_ = (x * bins[1] + y) * bins[2]
                for k in range(first[bin_ + start[2]], first[bin_ + stop[2] + 1]):
                    place = order[k]
                    if found[place] >= 0 or owners[place] == e:
                        continue
                    near = True
                    for i in range(flat):
                        near = near and lowest[i] <= places[place, i] <= highest[i]
                    if near and in_cell(points, cells, simplices, places, e, place):
                        found[place] = e
    return found


@register_jitable
def in_cell(points, cells, simplices, places, e, place):
    """Whether one of the cell's simplices holds the place."""
    for s in range(simplices.shape[0]):
        if simplices.shape[1] == 4:
            inside = in_tetrahedron(points, cells, simplices, places, e, s, place)
        else:
            inside = in_triangle(points, cells, simplices, places, e, s, place)
        if inside:
            return True
    return False


@register_jitable
def in_tetrahedron(points, cells, simplices, places, e, s, place):
    a, b, c, d = (
        cells[e, simplices[s, 0]],
        cells[e, simplices[s, 1]],
        cells[e, simplices[s, 2]],
        cells[e, simplices[s, 3]],
    )
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    wx, wy, wz = points[d, 0] - points[a, 0], points[d, 1] - points[a, 1], points[d, 2] - points[a, 2]
    px, py, pz = (
        places[place, 0] - points[a, 0],
        places[place, 1] - points[a, 1],
        places[place, 2] - points[a, 2],
    )
    volume = triple(ux, uy, uz, vx, vy, vz, wx, wy, wz)
    if volume == 0.0:
        return False
    r = triple(px, py, pz, vx, vy, vz, wx, wy, wz) / volume
    q = triple(ux, uy, uz, px, py, pz, wx, wy, wz) / volume
    t = triple(ux, uy, uz, vx, vy, vz, px, py, pz) / volume
    return r > WITHIN and q > WITHIN and t > WITHIN and r + q + t < 1.0 - WITHIN


@register_jitable
def triple(ux, uy, uz, vx, vy, vz, wx, wy, wz):
    """u . (v x w)."""
    return ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)


@register_jitable
def in_triangle(points, cells, simplices, places, e, s, place):
    a, b, c = cells[e, simplices[s, 0]], cells[e, simplices[s, 1]], cells[e, simplices[s, 2]]
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    px, py = places[place, 0] - points[a, 0], places[place, 1] - points[a, 1]
    area = ux * vy - uy * vx
    if area == 0.0:
        return False
    r, q = (px * vy - py * vx) / area, (ux * py - uy * px) / area
    return r > WITHIN and q > WITHIN and r + q < 1.0 - WITHIN
