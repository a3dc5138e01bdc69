"""Making the project's meshes with Gmsh at any size, or of bricks in rows.

A brick is six tetrahedra that share its diagonal from the lowest to the highest corner (Kuhn).
"""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.errors import CaseError, did_you_mean, writing
from ancf_petsc.mesh.bodies import BODIES, Plane, Primitive
from ancf_petsc.mesh.gmsh_session import gmsh_session
from ancf_petsc.mesh.kinds import KINDS, KUHN, part_kind
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.parts import outer_sides, unique_rows

ON_PLANE = 1e-9
"""Nodes closer to a plane than this times the size of the body are on it."""

VERSIONS = ("2.2", "4.1")
GROWTH = 0.5
"""Of the length of edges with the distance from a rim."""

SAMPLING = 400
"""Points along a curve that distances are taken to."""

BOX_MARGIN = 1e-6
"""Metres by which Gmsh's boxes of curves are too large."""


def make_mesh(
    name: str,
    path: str | Path,
    *,
    size: float | None = None,
    rim: float | None = None,
    divisions: Sequence[int] | None = None,
    order: int = 1,
    hexahedra: bool = False,
    flat: str = "",
    version: str = "2.2",
) -> Path:
    """Writes a mesh of one of BODIES as a Gmsh file and returns its path.

    flat: the section of a box half way along y, that of a body of revolution in the plane x-z, with the groups that cut it:
    "triangle", or of a box "quad"; "line" for a box's axis along x.
    size: length of edges of an unstructured mesh, rim: at rims of bonded faces and roots, where stresses are
    singular; edges grow with the distance from them. divisions: bricks (nx, ny, nz) of a structured one, for
    pvc_block across the wall, around, over the height. order 2 adds mid-nodes on straight edges.
    Raises CaseError where this cannot be made.
    """
    body = _checked_request(
        name, size=size, rim=rim, divisions=divisions, order=order, hexahedra=hexahedra, version=version
    )
    _check_grid(name, flat, structured=divisions is not None or hexahedra)
    path = Path(path)
    if path.suffix != ".msh":
        raise CaseError("the mesh file's name", key="--out", got=str(path), expected="a name ending in .msh")
    if not path.parent.is_dir():
        raise CaseError("there is no such folder", key="--out", got=str(path.parent), cure="make it first")
    if flat:
        if flat == "triangle" and divisions is None:
            points, cells = _unstructured(body, body.size if size is None else size, rim, 2)
        else:
            points, cells = _flat(body, body.divisions if divisions is None else divisions, flat)
        _write(path, points, _flat_groups(body, points, cells, flat), order, version)
        return path
    if divisions is None and not hexahedra:
        points, cells = _unstructured(body, body.size if size is None else size, rim)
    else:
        points, cells = bricks(body.grid(body.divisions if divisions is None else divisions))
        if not hexahedra:
            cells = cells[:, np.array(KUHN)].reshape(-1, 4)
    kind = part_kind(3, cells.shape[1]).name
    groups = [*_group_parts(body, points, cells, kind), ("solid", 3, cells)]
    _write(path, points, groups, order, version)
    return path


def _checked_request(
    name: str,
    *,
    size: float | None,
    rim: float | None,
    divisions: Sequence[int] | None,
    order: int,
    hexahedra: bool,
    version: str,
) -> Primitive:
    if name not in BODIES:
        raise CaseError("no such body", key="NAME", got=name, cure=did_you_mean(name, list(BODIES)))
    if size is not None and (divisions is not None or hexahedra):
        cure = "give --divisions alone for bricks, --size alone for tetrahedra"
        raise CaseError("bricks have divisions, not a size", key="--size", got=size, cure=cure)
    if size is not None and not 0 < size < np.inf:
        raise CaseError(key="--size", got=size, expected="a length in metres above 0")
    if rim is not None:
        _check_rim(name, rim, size, structured=divisions is not None or hexahedra)
    if divisions is not None and not (len(divisions) == 3 and all(count >= 1 for count in divisions)):
        raise CaseError(key="--divisions", got=list(divisions), expected="three numbers from 1")
    if order not in (1, 2) or (order == 2 and hexahedra):
        raise CaseError(key="--order", got=order, expected="1" if hexahedra else "1 or 2")
    if version not in VERSIONS:
        raise CaseError(key="--format", got=version, expected=" or ".join(VERSIONS))
    return BODIES[name]


def _check_grid(name: str, flat: str, *, structured: bool) -> None:
    """A section that is revolved is no parallelogram and is meshed by Gmsh alone."""
    body = BODIES[name]
    if flat in ("quad", "line") and body.revolved:
        cure = "--flat triangle, or no --flat for the quarter"
        raise CaseError(f"the section of {name} is no parallelogram", key="--flat", got=flat, cure=cure)
    if flat and structured and body.revolved:
        cure = "give --size, and --rim for finer edges at roots and bonded rims"
        raise CaseError(f"the section of {name} is meshed by Gmsh", key="--divisions", got="given", cure=cure)


def _check_rim(name: str, rim: float, size: float | None, *, structured: bool) -> None:
    body = BODIES[name]
    if structured:
        raise CaseError("bricks have divisions, not a size", key="--rim", got=rim, cure="give --size")
    if not body.rims:
        having = ", ".join(other for other in BODIES if BODIES[other].rims)
        raise CaseError(f"{name} has no bonded face", key="--rim", got=rim, expected=f"one of {having}")
    largest = body.size if size is None else size
    if not 0 < rim <= largest:
        raise CaseError(
            key="--rim", got=rim, expected=f"a length in metres above 0, at most --size {largest:g}"
        )


def _unstructured(
    body: Primitive, size: float, rim: float | None, dimension: int = 3
) -> tuple[Floats, Integers]:
    """Points (n, 3) and tetrahedra (e, 4), or triangles (e, 3) of the section, by Gmsh, in its numbering."""
    options = {"Mesh.MeshSizeMin": rim or size, "Mesh.MeshSizeMax": size}
    with gmsh_session(**options) as gmsh:
        build = body.build if dimension == 3 else body.section
        assert build
        build(gmsh)
        gmsh.model.occ.synchronize()
        if rim is not None:
            places = _rim_curves(gmsh, body) if dimension == 3 else _rim_points(gmsh, body)
            grade(gmsh, places, size, rim, "Curves" if dimension == 3 else "Points")
        try:
            gmsh.model.mesh.generate(dimension)
        except Exception as error:
            raise CaseError(
                f"Gmsh cannot mesh the body ({error})", key="--size", got=size, cure=f"try {body.size:g}"
            ) from None
        numbers, coordinates, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(KINDS["tetra" if dimension == 3 else "triangle"].gmsh)
    order = np.argsort(numbers)
    cells = np.searchsorted(numbers[order], nodes)
    used, cells = np.unique(cells, return_inverse=True)
    cells = cells.reshape(-1, dimension + 1)
    # Faces in x-z have their normal along y, where the plane of z and x is seen from behind.
    return coordinates.reshape(-1, 3)[order[used]], cells if dimension == 3 else cells[:, [0, 2, 1]]


def grade(gmsh: Any, places: Sequence[int], size: float, rim: float, kind: str = "Curves") -> None:
    """Let edges grow from `rim` at the curves, or Points, with the distance from them, to `size`."""
    field = gmsh.model.mesh.field
    distance, length = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, f"{kind}List", places)
    field.setNumber(distance, "Sampling", SAMPLING)
    values = {
        "InField": distance,
        "SizeMin": rim,
        "SizeMax": size,
        "DistMin": 0,
        "DistMax": (size - rim) / GROWTH,
    }
    for name, value in values.items():
        field.setNumber(length, name, value)
    field.setAsBackgroundMesh(length)
    for source in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0)


def _rim_curves(gmsh: Any, body: Primitive) -> list[int]:
    """Curves of the model on planes of rims and on none of symmetry."""
    symmetry = [planes for name, planes in body.faces.items() if name.startswith("symmetry")]
    found = []
    for dimension, tag in gmsh.model.getEntities(1):
        box = np.array(gmsh.model.getBoundingBox(dimension, tag)).reshape(2, 3)
        on = [np.allclose(box[:, "xyz".index(a)], level, atol=BOX_MARGIN) for a, level in body.rims]
        cut = [np.allclose(box[:, "xyz".index(a)], level, atol=BOX_MARGIN) for (a, level), *_ in symmetry]
        if any(on) and not any(cut):
            found.append(tag)
    return found


def _rim_points(gmsh: Any, body: Primitive) -> list[int]:
    """Points of the section on planes of rims."""
    places = {tag: gmsh.model.getValue(0, tag, []) for _, tag in gmsh.model.getEntities(0)}
    return [
        tag
        for tag, place in places.items()
        if any(abs(place["xyz".index(axis)] - level) < BOX_MARGIN for axis, level in body.rims)
    ]


def bricks(grid: Floats) -> tuple[Floats, Integers]:
    """Points (n, 3), x running fastest, and bricks (e, 8) of a grid (nz + 1, ny + 1, nx + 1, 3)."""
    index = np.arange(grid[..., 0].size).reshape(grid.shape[:3])
    lower = [index[:-1, :-1, :-1], index[:-1, :-1, 1:], index[:-1, 1:, 1:], index[:-1, 1:, :-1]]
    upper = [index[1:, :-1, :-1], index[1:, :-1, 1:], index[1:, 1:, 1:], index[1:, 1:, :-1]]
    return grid.reshape(-1, 3), np.stack([corner.ravel() for corner in lower + upper], axis=1)


def _flat(body: Primitive, divisions: Sequence[int], kind: str) -> tuple[Floats, Integers]:
    """Points and cells of the section half way along y (in z-x) or of the axis along x; triangles are halves of quadrilaterals."""
    d = KINDS[kind].dimension
    nx, _, nz = divisions
    grid = body.grid((nx, 2, 2 * nz if d == 2 else 2))[:, 1]
    grid = grid[::2] if d == 2 else grid[1:2]
    index = np.arange(grid[..., 0].size).reshape(grid.shape[:2])
    corners = [index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]
    cells = np.stack([c.ravel() for c in (corners if d == 2 else (index[:, :-1], index[:, 1:]))], axis=1)
    if kind == "triangle":
        cells = cells[:, ((0, 1, 2), (0, 2, 3))].reshape(-1, 3)
    return grid.reshape(-1, 3), cells


def _flat_groups(
    body: Primitive, points: Floats, cells: Integers, kind: str
) -> list[tuple[str, int, Integers]]:
    """Name, dimension, parts (m, corners) of the groups that cut a section or an axis."""
    d = KINDS[kind].dimension
    spanned = "xz"[:d]
    sides = outer_sides(kind, cells, len(points))
    groups: list[tuple[str, int, Integers]] = []
    for name, planes in body.faces.items():
        on = sides[_on(points, planes)[sides].all(axis=1)]
        if all(axis in spanned for axis, _ in planes) and len(on):
            groups.append((name, d - 1, on))
    for name, lines in body.edges.items():
        kept = [line for line in lines if all(axis in spanned for axis, _ in line)]
        if kept:
            nodes = np.flatnonzero(np.any([_on(points, line) for line in kept], axis=0))
            groups.append((name, 0, nodes[:, None]))
    return [*groups, ("solid", d, cells)]


def _group_parts(
    body: Primitive, points: Floats, cells: Integers, kind: str
) -> list[tuple[str, int, Integers]]:
    """Name, dimension, parts (m, corners) of the body's groups."""
    sides = outer_sides(kind, cells, len(points))
    edges = np.stack([sides, np.roll(sides, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = unique_rows(edges, len(points))
    groups = [(name, 2, sides[_on(points, planes)[sides].all(axis=1)]) for name, planes in body.faces.items()]
    for name, lines in body.edges.items():
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
    options = {
        "Mesh.MshFileVersion": float(version),
        "Mesh.Binary": 0,
        "Mesh.SaveAll": 0,
        "Mesh.SecondOrderLinear": 1,
    }
    with gmsh_session(**options) as gmsh:
        mesh = gmsh.model.mesh
        for tag, (name, dimension, _) in enumerate(groups, start=1):
            gmsh.model.addDiscreteEntity(dimension, tag)
            gmsh.model.addPhysicalGroup(dimension, [tag], tag, name)
        mesh.addNodes(groups[-1][1], len(groups), np.arange(1, len(points) + 1), points.ravel())
        for tag, (_, dimension, parts) in enumerate(groups, start=1):
            kind = part_kind(dimension, parts.shape[1])
            mesh.addElementsByType(tag, kind.gmsh, [], (parts + 1).ravel())
        if order == 2:
            mesh.setOrder(2)
        part = path.with_name(
            f"{path.stem}.part{path.suffix}"
        )  # a mesh that is there already stays until this is whole
        try:
            gmsh.write(str(part))
        except Exception as error:
            raise CaseError(f"the mesh cannot be written ({error})", key="--out", got=str(path)) from None
    with writing(path, "--out"):
        try:
            whole = part.read_bytes().rstrip().endswith(b"$EndElements")
            if path.suffix == ".msh" and not whole:  # Gmsh says nothing of a full disk
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            part.replace(path)
        except OSError:
            part.unlink(missing_ok=True)
            raise
