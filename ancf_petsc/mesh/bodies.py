"""The bodies the project makes meshes of, in metres.

The geometry of `pvc_block` is assumed: the drawing in the paper is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.mesh import Floats

Plane = tuple[str, float]
Faces = dict[str, tuple[Plane, ...]]
Edges = dict[str, tuple[tuple[Plane, Plane], ...]]


@dataclass(frozen=True)
class Primitive:
    """One of the project's bodies.

    faces: group name -> planes its faces lie on, as (axis, coordinate).
    edges: group name -> lines it is made of, each as two planes.
    build: adds the solid to Gmsh's OpenCASCADE model.
    grid: structured points (nz + 1, ny + 1, nx + 1, 3) from divisions (nx, ny, nz).
    size, divisions: what is made where nothing is asked for; size is the length of edges.
    rims: planes of bonded faces and of roots, whose curves off the planes of symmetry meshes can be graded to.
    section: adds the section in the plane x-z to the model, half way along y or that which is revolved about z. revolved: it is.
    """

    about: str
    build: Callable[[Any], None]
    grid: Callable[[Sequence[int]], Floats]
    faces: Faces
    edges: Edges
    size: float
    divisions: tuple[int, int, int]
    rims: tuple[Plane, ...] = ()
    section: Callable[[Any], int] | None = None
    revolved: bool = False


def _add_box(gmsh: Any, low: Sequence[float], high: Sequence[float]) -> None:
    gmsh.model.occ.addBox(*low, *np.subtract(high, low))


def _box_grid(divisions: Sequence[int], low: Sequence[float], high: Sequence[float]) -> Floats:
    axes = [np.linspace(low[i], high[i], divisions[i] + 1) for i in range(3)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    return np.stack([x, y, z], axis=-1)


def box(
    about: str,
    low: Sequence[float],
    high: Sequence[float],
    *,
    faces: Faces,
    edges: Edges | None = None,
    size: float,
    divisions: tuple[int, int, int],
    rims: tuple[Plane, ...] = (),
) -> Primitive:
    """A box from its lowest to its highest corner."""
    build, grid = partial(_add_box, low=low, high=high), partial(_box_grid, low=low, high=high)
    (x, y, z), (across, depth, over) = low, high
    corners = [(x, z), (across, z), (across, over), (x, over)]
    section = partial(_add_polygon, corners=corners, y=(y + depth) / 2)
    return Primitive(about, build, grid, faces, edges or {}, size, divisions, rims, section)


def _add_polygon(gmsh: Any, corners: Sequence[tuple[float, float]], y: float = 0.0) -> int:
    """A face in the plane x-z, by its corners (x, z)."""
    occ = gmsh.model.occ
    points = [occ.addPoint(x, y, z) for x, z in corners]
    lines = [occ.addLine(one, other) for one, other in zip(points, [*points[1:], points[0]], strict=True)]
    return occ.addPlaneSurface([occ.addCurveLoop(lines)])


def beam(about: str, width: float, *, layer: float = 1.0) -> Primitive:
    """A beam 1 m long along x with a square section, clamped at x = 0.

    layer: thickness of the middle layer of bricks along x, in parts of the others'.
    """
    low, high = (0.0, 0.0, 0.0), (1.0, width, width)

    def grid(divisions: Sequence[int]) -> Floats:
        points = _box_grid(divisions, low, high)
        parts = np.ones(divisions[0])
        parts[divisions[0] // 2] = layer
        x = np.concatenate([[0.0], np.cumsum(parts)]) / parts.sum()
        x[-1] = 1.0
        points[..., 0] = x
        return points

    faces: Faces = {"clamp": (("x", 0.0),), "end": (("x", 1.0),)}
    rims = (("x", 0.0),)
    whole = box(about, low, high, faces=faces, size=width / 2, divisions=(20, 2, 2), rims=rims)
    return replace(whole, grid=grid)


INNER, OUTER, HEIGHT = 0.025, 0.095, 0.1
GROOVE_DEPTH, GROOVE_MOUTH = 0.025, 0.02
LOWER, UPPER = (HEIGHT - GROOVE_MOUTH) / 2, (HEIGHT + GROOVE_MOUTH) / 2


BELOW = [(OUTER, 0.0), (OUTER, LOWER)]
ABOVE = [(OUTER, UPPER), (OUTER, HEIGHT), (INNER, HEIGHT), (INNER, 0.0)]
SHARP = [*BELOW, (OUTER - GROOVE_DEPTH, HEIGHT / 2), *ABOVE]
ROOT_RADIUS, ROOT_ARCS = 0.004, 4


def _root() -> tuple[Floats, tuple[float, float]]:
    """Points (arcs + 1, 2) of the rounded root from below, whose circle touches both flanks, and its centre (x, z)."""
    half = np.arctan(GROOVE_MOUTH / 2 / GROOVE_DEPTH)
    centre = OUTER - GROOVE_DEPTH + ROOT_RADIUS / np.sin(half), HEIGHT / 2
    angles = (np.pi / 2 - half) * np.linspace(-1, 1, ROOT_ARCS + 1)
    points = np.stack((-np.cos(angles), np.sin(angles)), axis=1)
    return centre + ROOT_RADIUS * points, centre


def _add_rounded(gmsh: Any) -> int:
    """The section of the block whose root is rounded."""
    occ, (root, centre) = gmsh.model.occ, _root()
    below, arc, above = ([occ.addPoint(x, 0, z) for x, z in corners] for corners in (BELOW, root, ABOVE))
    middle = occ.addPoint(centre[0], 0, centre[1])
    ends = [*above, below[0], below[1], arc[0]]
    lines = [occ.addCircleArc(one, middle, other) for one, other in zip(arc, arc[1:], strict=False)]
    lines += [occ.addLine(one, other) for one, other in zip([arc[-1], *ends], ends, strict=False)]
    return occ.addPlaneSurface([occ.addCurveLoop(lines)])


def _revolve(gmsh: Any, section: Callable[[Any], int]) -> None:
    """The section in the plane y = 0, turned by a right angle about z."""
    gmsh.model.occ.revolve([(2, section(gmsh))], 0, 0, 0, 0, 0, 1, np.pi / 2)


def _pvc_grid(divisions: Sequence[int], radius: float = 0.0) -> Floats:
    """Divisions across the wall, around the quarter, over the height; the groove's corners are nodes. radius: of its root."""
    across, around, over = divisions
    if over < 4 or over % 2:
        raise CaseError("divisions over the height", got=over, expected="an even number, at least 4")
    flank = max(1, round(over * GROOVE_MOUTH / HEIGHT / 2))
    lower = np.linspace(0, LOWER, over // 2 - flank + 1)
    half = np.concatenate([lower, np.linspace(LOWER, HEIGHT / 2, flank + 1)[1:]])
    z = np.concatenate([half, HEIGHT - half[-2::-1]])
    depth = GROOVE_DEPTH * np.clip(1 - np.abs(z - HEIGHT / 2) / (GROOVE_MOUTH / 2), 0, None)
    if radius:
        root, centre = _root()
        inside = np.abs(z - centre[1]) < root[-1, 1] - centre[1]
        arc = np.sqrt(np.where(inside, radius**2 - (z - centre[1]) ** 2, 0.0))
        depth = np.where(inside, OUTER - centre[0] + arc, depth)
    distance = INNER + (OUTER - depth - INNER)[:, None, None] * np.linspace(0, 1, across + 1)
    angle = np.linspace(0, np.pi / 2, around + 1)[:, None]
    cosine = np.where(angle == angle[-1], 0, np.cos(angle))
    x, y, z = np.broadcast_arrays(distance * cosine, distance * np.sin(angle), z[:, None, None])
    return np.stack([x, y, z], axis=-1)


def _perimeter(z: float, x: Sequence[float], y: Sequence[float]) -> tuple[tuple[Plane, Plane], ...]:
    return tuple((("z", z), ("x", end)) for end in x) + tuple((("z", z), ("y", end)) for end in y)


QUARTER: Faces = {
    "bottom": (("z", 0.0),),
    "top": (("z", 0.1),),
    "symmetry_x": (("x", 0.0),),
    "symmetry_y": (("y", 0.0),),
}

BONDED: tuple[Plane, ...] = (("z", 0.0), ("z", 0.1))

BODIES = {
    "pvc_block": Primitive(
        "quarter of a grooved ring 190 x 100 mm, bore 50, groove 25 deep and 20 wide (assumed geometry)",
        partial(_revolve, section=partial(_add_polygon, corners=SHARP)),
        _pvc_grid,
        QUARTER,
        {},
        0.01,
        (4, 8, 10),
        (*BONDED, ("z", HEIGHT / 2)),
        partial(_add_polygon, corners=SHARP),
        revolved=True,
    ),
    "pvc_block_rounded": Primitive(
        "the same with the root of the groove rounded by 4 mm, which ends stresses without limit there",
        partial(_revolve, section=_add_rounded),
        partial(_pvc_grid, radius=ROOT_RADIUS),
        QUARTER,
        {},
        0.01,
        (4, 8, 10),
        (*BONDED, *(("z", float(z)) for z in _root()[0][:, 1])),
        _add_rounded,
        revolved=True,
    ),
    "cube": box(
        "quarter block 50 x 50 x 100 mm",
        (0, 0, 0),
        (0.05, 0.05, 0.1),
        faces=QUARTER,
        size=0.005,
        divisions=(5, 5, 10),
        rims=BONDED,
    ),
    "bar": box(
        "bar 0.1 x 0.1 x 0.5 m hanging along z",
        (0, 0, -0.5),
        (0.1, 0.1, 0),
        faces={"top": (("z", 0.0),), "bottom": (("z", -0.5),)},
        edges={"bottom_edges": _perimeter(-0.5, (0, 0.1), (0, 0.1))},
        size=0.05,
        divisions=(2, 2, 10),
        rims=(("z", 0.0),),
    ),
    "pendulum": box(
        "pendulum 0.5 x 0.1 x 0.1 m along x, hinged at an upper edge",
        (0, 0, 0),
        (0.5, 0.1, 0.1),
        faces={"tip": (("x", 0.5),)},
        edges={"hinge": ((("x", 0.0), ("z", 0.1)),)},
        size=0.18,
        divisions=(4, 2, 2),
    ),
    "pendulum_vertical": box(
        "the pendulum upright along z, hinged at a lower edge",
        (0, 0, 0),
        (0.1, 0.1, 0.5),
        faces={"tip": (("z", 0.5),)},
        edges={"hinge": ((("x", 0.0), ("z", 0.0)),)},
        size=0.18,
        divisions=(2, 2, 4),
    ),
    "ellipsograph": box(
        "beam 1 x 0.01 x 0.02 m along x of the ellipsograph",
        (0, 0, 0),
        (1, 0.01, 0.02),
        faces={"left": (("x", 0.0),), "right": (("x", 1.0),), "side_y0": (("y", 0.0),)},
        edges={"left_edge": ((("x", 0.0), ("z", 0.0)),), "right_edge": ((("x", 1.0), ("z", 0.0)),)},
        size=0.095,
        divisions=(13, 1, 1),
    ),
    "cantilever": beam("beam 1 x 0.1 x 0.1 m along x", 0.1),
    **{f"slender_{ratio}": beam(f"the same 1 : {ratio}", 1.0 / ratio) for ratio in (30, 100, 300, 1000)},
    **{
        f"thin_layer_{ratio}": beam(
            f"the cantilever, one layer of its bricks 1 : {ratio}", 0.1, layer=1.0 / ratio
        )
        for ratio in (10, 100, 1000, 10000)
    },
}
