"""The project's meshes, made with Gmsh at any size, or of bricks in rows. Lengths in metres.

A brick is six tetrahedra that share its diagonal from the lowest to the highest corner (Kuhn). The geometry
of `pvc_block` is assumed: the drawing in the paper is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import CaseError, did_you_mean
from .gmsh_file import gmsh_session
from .kinds import KINDS, KUHN
from .mesh import Floats, Integers
from .parts import outer_sides, unique_rows

Plane = tuple[str, float]
Faces = dict[str, tuple[Plane, ...]]
ON_PLANE = 1e-9

VERSIONS = ("2.2", "4.1")


@dataclass(frozen=True)
class Model:
    """One of the project's bodies.

    faces: group name -> planes its faces lie on, as (axis, coordinate).
    edges: group name -> lines it is made of, each as two planes.
    build: adds the solid to Gmsh's OpenCASCADE model.
    grid: structured points (nz + 1, ny + 1, nx + 1, 3) from divisions (nx, ny, nz).
    size, divisions: what is made where nothing is asked for; size is the length of edges.
    """

    about: str
    build: Callable[[Any], None]
    grid: Callable[[Sequence[int]], Floats]
    faces: Faces
    edges: dict[str, tuple[tuple[Plane, Plane], ...]]
    size: float
    divisions: tuple[int, int, int]


def _add_box(gmsh: Any, low: Sequence[float], high: Sequence[float]) -> None:
    gmsh.model.occ.addBox(*low, *np.subtract(high, low))


def _box_grid(divisions: Sequence[int], low: Sequence[float], high: Sequence[float]) -> Floats:
    axes = [np.linspace(*ends, count + 1) for *ends, count in zip(low, high, divisions)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    return np.stack([x, y, z], axis=-1)


def box_model(
    about: str,
    low: Sequence[float],
    high: Sequence[float],
    *,
    faces: Faces,
    edges: dict[str, tuple[tuple[Plane, Plane], ...]] | None = None,
    size: float,
    divisions: tuple[int, int, int],
) -> Model:
    """A box from its lowest to its highest corner."""
    build, grid = partial(_add_box, low=low, high=high), partial(_box_grid, low=low, high=high)
    return Model(about, build, grid, faces, edges or {}, size, divisions)


INNER, OUTER, HEIGHT = 0.025, 0.095, 0.1
GROOVE_DEPTH, GROOVE_MOUTH = 0.025, 0.02
LOWER, UPPER = (HEIGHT - GROOVE_MOUTH) / 2, (HEIGHT + GROOVE_MOUTH) / 2


def _add_pvc_block(gmsh: Any) -> None:
    """The section in the plane y = 0, turned by a right angle about z."""
    section = [(INNER, 0.0), (OUTER, 0.0), (OUTER, LOWER), (OUTER - GROOVE_DEPTH, HEIGHT / 2)]
    section += [(OUTER, UPPER), (OUTER, HEIGHT), (INNER, HEIGHT)]
    occ = gmsh.model.occ
    points = [occ.addPoint(x, 0, z) for x, z in section]
    lines = [occ.addLine(one, other) for one, other in zip(points, points[1:] + points[:1])]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    occ.revolve([(2, face)], 0, 0, 0, 0, 0, 1, np.pi / 2)


def _pvc_grid(divisions: Sequence[int]) -> Floats:
    """Divisions across the wall, around the quarter, over the height; the groove's corners are nodes."""
    across, around, over = divisions
    if over < 4 or over % 2:
        raise CaseError("divisions over the height", got=over, expected="an even number, at least 4")
    flank = max(1, round(over * GROOVE_MOUTH / HEIGHT / 2))
    lower = np.linspace(0, LOWER, over // 2 - flank + 1)
    half = np.concatenate([lower, np.linspace(LOWER, HEIGHT / 2, flank + 1)[1:]])
    z = np.concatenate([half, HEIGHT - half[-2::-1]])
    depth = GROOVE_DEPTH * np.clip(1 - np.abs(z - HEIGHT / 2) / (GROOVE_MOUTH / 2), 0, None)
    radius = INNER + (OUTER - depth - INNER)[:, None, None] * np.linspace(0, 1, across + 1)
    angle = np.linspace(0, np.pi / 2, around + 1)[:, None]
    cosine = np.where(angle == angle[-1], 0, np.cos(angle))
    x, y, z = np.broadcast_arrays(radius * cosine, radius * np.sin(angle), z[:, None, None])
    return np.stack([x, y, z], axis=-1)


def _perimeter(z: float, x: Sequence[float], y: Sequence[float]) -> tuple[tuple[Plane, Plane], ...]:
    return tuple((("z", z), ("x", end)) for end in x) + tuple((("z", z), ("y", end)) for end in y)


QUARTER: Faces = {
    "bottom": (("z", 0.0),),
    "top": (("z", 0.1),),
    "symmetry_x": (("x", 0.0),),
    "symmetry_y": (("y", 0.0),),
}

MODELS = {
    "pvc_block": Model(
        "quarter of a grooved ring 190 x 100 mm, bore 50, groove 25 deep and 20 wide (assumed geometry)",
        _add_pvc_block,
        _pvc_grid,
        QUARTER,
        {},
        0.01,
        (4, 8, 10),
    ),
    "cube": box_model(
        "quarter block 50 x 50 x 100 mm",
        (0, 0, 0),
        (0.05, 0.05, 0.1),
        faces=QUARTER,
        size=0.005,
        divisions=(5, 5, 10),
    ),
    "bar": box_model(
        "bar 0.1 x 0.1 x 0.5 m hanging along z",
        (0, 0, -0.5),
        (0.1, 0.1, 0),
        faces={"top": (("z", 0.0),), "bottom": (("z", -0.5),)},
        edges={"bottom_edges": _perimeter(-0.5, (0, 0.1), (0, 0.1))},
        size=0.05,
        divisions=(2, 2, 10),
    ),
    "pendulum": box_model(
        "pendulum 0.5 x 0.1 x 0.1 m along x, hinged at an upper edge",
        (0, 0, 0),
        (0.5, 0.1, 0.1),
        faces={"tip": (("x", 0.5),)},
        edges={"hinge": ((("x", 0.0), ("z", 0.1)),)},
        size=0.1,
        divisions=(4, 2, 2),
    ),
    "pendulum_vertical": box_model(
        "the pendulum upright along z, hinged at a lower edge",
        (0, 0, 0),
        (0.1, 0.1, 0.5),
        faces={"tip": (("z", 0.5),)},
        edges={"hinge": ((("x", 0.0), ("z", 0.0)),)},
        size=0.1,
        divisions=(2, 2, 4),
    ),
    "ellipsograph": box_model(
        "beam 1 x 0.01 x 0.02 m along x of the ellipsograph",
        (0, 0, 0),
        (1, 0.01, 0.02),
        faces={"left": (("x", 0.0),), "right": (("x", 1.0),), "side_y0": (("y", 0.0),)},
        edges={"left_edge": ((("x", 0.0), ("z", 0.0)),), "right_edge": ((("x", 1.0), ("z", 0.0)),)},
        size=0.08,
        divisions=(13, 1, 1),
    ),
    "cantilever": box_model(
        "beam 1 x 0.1 x 0.1 m along x",
        (0, 0, 0),
        (1, 0.1, 0.1),
        faces={"clamp": (("x", 0.0),), "end": (("x", 1.0),)},
        size=0.05,
        divisions=(20, 2, 2),
    ),
}


def make_mesh(
    name: str,
    path: str | Path,
    *,
    size: float | None = None,
    divisions: Sequence[int] | None = None,
    order: int = 1,
    hexahedra: bool = False,
    version: str = "2.2",
) -> Path:
    """Writes a mesh of one of MODELS as a Gmsh file and returns its path.

    size: length of edges of an unstructured mesh. divisions: bricks (nx, ny, nz) of a structured one, for
    pvc_block across the wall, around, over the height. order 2 adds mid-nodes on straight edges.
    Raises CaseError where this cannot be made.
    """
    model = _checked_request(name, size, divisions, order, hexahedra, version)
    path = Path(path)
    if path.suffix != ".msh":
        raise CaseError("the mesh file's name", key="--out", got=str(path), expected="a name ending in .msh")
    if not path.parent.is_dir():
        raise CaseError("there is no such folder", key="--out", got=str(path.parent), cure="make it first")
    if divisions is None and not hexahedra:
        kind = "tetra"
        points, cells = _unstructured(model, model.size if size is None else size)
    else:
        points, bricks = _bricks(model.grid(model.divisions if divisions is None else divisions))
        kind, cells = ("hexahedron", bricks) if hexahedra else ("tetra", bricks[:, np.array(KUHN)].reshape(-1, 4))
    groups = [*_group_parts(model, points, cells, kind), ("solid", 3, cells)]
    _write(path, points, groups, order, version)
    return path


def _checked_request(
    name: str, size: float | None, divisions: Sequence[int] | None, order: int, hexahedra: bool, version: str
) -> Model:
    if name not in MODELS:
        raise CaseError("no such model", key="NAME", got=name, cure=did_you_mean(name, list(MODELS)))
    if size is not None and (divisions is not None or hexahedra):
        cure = "give --divisions alone for bricks, --size alone for tetrahedra"
        raise CaseError("bricks have divisions, not a size", key="--size", got=size, cure=cure)
    if size is not None and not 0 < size < np.inf:
        raise CaseError(key="--size", got=size, expected="a length in metres above 0")
    if divisions is not None and not (len(divisions) == 3 and all(count >= 1 for count in divisions)):
        raise CaseError(key="--divisions", got=list(divisions), expected="three numbers from 1")
    if order not in (1, 2) or (order == 2 and hexahedra):
        raise CaseError(key="--order", got=order, expected="1" if hexahedra else "1 or 2")
    if version not in VERSIONS:
        raise CaseError(key="--format", got=version, expected=" or ".join(VERSIONS))
    return MODELS[name]


def _unstructured(model: Model, size: float) -> tuple[Floats, Integers]:
    """Points (n, 3) and tetrahedra (e, 4) by Gmsh, in its numbering."""
    options = {"Mesh.MeshSizeMin": size, "Mesh.MeshSizeMax": size}
    with gmsh_session(**options) as gmsh:
        model.build(gmsh)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(3)
        numbers, coordinates, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(KINDS["tetra"].gmsh)
    order = np.argsort(numbers)
    cells = np.searchsorted(numbers[order], nodes).reshape(-1, 4)
    return coordinates.reshape(-1, 3)[order], cells


def _bricks(grid: Floats) -> tuple[Floats, Integers]:
    """Points (n, 3), x running fastest, and bricks (e, 8) of a grid (nz + 1, ny + 1, nx + 1, 3)."""
    index = np.arange(grid[..., 0].size).reshape(grid.shape[:3])
    lower = [index[:-1, :-1, :-1], index[:-1, :-1, 1:], index[:-1, 1:, 1:], index[:-1, 1:, :-1]]
    upper = [index[1:, :-1, :-1], index[1:, :-1, 1:], index[1:, 1:, 1:], index[1:, 1:, :-1]]
    return grid.reshape(-1, 3), np.stack([corner.ravel() for corner in lower + upper], axis=1)


def _group_parts(model: Model, points: Floats, cells: Integers, kind: str) -> list[tuple[str, int, Integers]]:
    """Name, dimension, parts (m, corners) of the model's groups."""
    sides = outer_sides(kind, cells, len(points))
    edges = np.stack([sides, np.roll(sides, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = unique_rows(edges, len(points))
    groups = [(name, 2, sides[_on(points, planes)[sides].all(axis=1)]) for name, planes in model.faces.items()]
    for name, lines in model.edges.items():
        along = np.any([_on(points, line)[edges].all(axis=1) for line in lines], axis=0)
        groups.append((name, 1, edges[along]))
    return groups


def _on(points: Floats, planes: Sequence[Plane]) -> np.ndarray:
    size = np.ptp(points, axis=0).max()
    heights = [points[:, "xyz".index(axis)] - level for axis, level in planes]
    return np.all(np.abs(heights) <= ON_PLANE * size, axis=0)


def _write(
    path: Path, points: Floats, groups: list[tuple[str, int, Integers]], order: int, version: str
) -> None:
    """A Gmsh file with one entity and one physical group for each of `groups`, the body the last."""
    kinds = {(1, 2): "line", (2, 3): "triangle", (2, 4): "quad", (3, 4): "tetra", (3, 8): "hexahedron"}
    options = {"Mesh.MshFileVersion": float(version), "Mesh.Binary": 0, "Mesh.SaveAll": 0, "Mesh.SecondOrderLinear": 1}
    with gmsh_session(**options) as gmsh:
        mesh = gmsh.model.mesh
        for tag, (name, dimension, parts) in enumerate(groups, start=1):
            gmsh.model.addDiscreteEntity(dimension, tag)
            gmsh.model.addPhysicalGroup(dimension, [tag], tag, name)
        mesh.addNodes(3, len(groups), np.arange(1, len(points) + 1), points.ravel())
        for tag, (_, dimension, parts) in enumerate(groups, start=1):
            kind = KINDS[kinds[dimension, parts.shape[1]]]
            mesh.addElementsByType(tag, kind.gmsh, [], (parts + 1).ravel())
        if order == 2:
            mesh.setOrder(2)
        try:
            gmsh.write(str(path))
        except Exception as error:
            raise CaseError(f"the mesh cannot be written ({error})", key="--out", got=str(path)) from None
