"""Reference cells and the affine map of a cell, X = X0 + J xi.

Simplices: the corners 0, e1, .. ed; X0 is the first corner. Boxes (line, quad, hexahedron): [-1/2, 1/2]^d; X0
is the centre. The columns of J are edge vectors of the cell. Corners are numbered as in meshio and VTK. Cells
of the plane and beams lie in x-y.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ancf_petsc.errors import MeshError

Floats = NDArray[np.float64]
Corners = tuple[int, ...]

# Relative to the size of the cell; and the condition number beyond which half of the digits are gone.
PARALLELEPIPED = 1e-9
WORST_CONDITION = 1e8


@dataclass(frozen=True, eq=False)
class Cell:
    """A reference cell.

    corners: coordinates, exact. edges: pairs of corners. facets: corners of the boundary parts of dimension d
    - 1, turned so that the normal points outwards (right hand in space; to the right of the edge in the
    plane). volume: of the reference cell.
    """

    name: str
    corners: tuple[tuple[Fraction, ...], ...]
    edges: tuple[Corners, ...]
    facets: tuple[Corners, ...]
    volume: Fraction

    @property
    def dimension(self) -> int:
        return len(self.corners[0])

    @property
    def is_simplex(self) -> bool:
        return self.name in ("triangle", "tetra")

    def centre(self, corners: Corners) -> tuple[Fraction, ...]:
        """Exact mean of some corners: a corner, the middle of an edge, the centre of a face."""
        return tuple(
            sum(x, Fraction(0)) / len(corners) for x in zip(*(self.corners[c] for c in corners), strict=True)
        )


def _box(name: str, corners: str, edges: tuple[Corners, ...], facets: tuple[Corners, ...]) -> Cell:
    half = {"0": Fraction(-1, 2), "1": Fraction(1, 2)}
    return Cell(name, tuple(tuple(half[x] for x in c) for c in corners.split()), edges, facets, Fraction(1))


def _simplex(name: str, corners: str, edges: tuple[Corners, ...], facets: tuple[Corners, ...]) -> Cell:
    points = tuple(tuple(Fraction(int(x)) for x in c) for c in corners.split())
    return Cell(name, points, edges, facets, Fraction(1, 2 if len(points) == 3 else 6))


CELLS = {
    cell.name: cell
    for cell in (
        _box("line", "0 1", edges=((0, 1),), facets=((0,), (1,))),
        _simplex("triangle", "00 10 01", edges=((0, 1), (1, 2), (0, 2)), facets=((0, 1), (1, 2), (2, 0))),
        _box(
            "quad",
            "00 10 11 01",
            edges=((0, 1), (1, 2), (2, 3), (0, 3)),
            facets=((0, 1), (1, 2), (2, 3), (3, 0)),
        ),
        _simplex(
            "tetra",
            "000 100 010 001",
            edges=((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
            facets=((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)),
        ),
        _box(
            "hexahedron",
            "000 100 110 010 001 101 111 011",
            edges=(
                *((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6)),
                *((6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7)),
            ),
            facets=((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3)),
        ),
    )
}
# What the part of a cell with so many corners is; four corners in space are a face of a brick.
PARTS = {2: CELLS["line"], 3: CELLS["triangle"], 4: CELLS["quad"]}


class Geometry(NamedTuple):
    """The affine maps X = origin + jacobian xi of cells.

    origin (e, m), jacobian (e, d, d) with edge vectors as columns, inverse (e, d, d), determinant (e).
    """

    origin: Floats
    jacobian: Floats
    inverse: Floats
    determinant: Floats


def cell_geometry(
    cell: Cell, points: ArrayLike, *, element: str = "", numbers: ArrayLike | None = None
) -> Geometry:
    """The affine maps of cells from their corners `points` (e, corners, 2 or 3).

    Plane cells use x and y. The jacobian of a line is its length, so that slopes are along its axis.
    `element` and `numbers` (e) are what messages call the element and the cells. Raises MeshError for a cell
    that is inside out or flat, too badly conditioned, or a box that is no parallelepiped.
    """
    d = cell.dimension
    points = np.asarray(points, dtype=float)[..., : max(d, 2)]
    report = _Reporter(cell, element, points, numbers)
    reference = np.array(cell.corners, dtype=float)
    if cell.is_simplex:
        origin = points[:, 0]
        columns = np.swapaxes(points[:, 1:] - origin[:, None], 1, 2)
    else:
        origin = points.mean(axis=1)
        slopes = reference * (4.0 / len(reference))
        columns = np.einsum("eci,ck->eik", points - origin[:, None], slopes)
        _check_parallelepiped(report, points, origin, columns, reference)
    jacobian = np.linalg.norm(columns, axis=1)[..., None] if d == 1 else columns
    cofactors, determinant = _cofactors(jacobian)
    report.any(determinant <= 0, "is inside out or flat", "a positive volume", "turn or remove it")
    inverse = cofactors / determinant[:, None, None]
    condition = np.linalg.norm(jacobian, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
    report.any(
        ~(condition < WORST_CONDITION * d),
        "is too flat for its shape functions",
        f"a condition number of its edge vectors below {WORST_CONDITION:.0e}",
        "mesh this place again",
    )
    return Geometry(origin, jacobian, inverse, determinant)


def _cofactors(J: Floats) -> tuple[Floats, Floats]:
    """Inverse times determinant (e, d, d) and determinant (e) of matrices of one, two or three columns."""
    d = J.shape[1]
    if d == 1:
        return np.ones_like(J), J[:, 0, 0]
    if d == 2:
        rows = np.stack((J[:, 1, 1], -J[:, 0, 1], -J[:, 1, 0], J[:, 0, 0]), axis=1).reshape(-1, 2, 2)
    else:
        x, y, z = np.moveaxis(J, 2, 0)
        rows = np.stack((np.cross(y, z), np.cross(z, x), np.cross(x, y)), axis=1)
    return rows, np.einsum("ei,ei->e", rows[:, 0], J[:, :, 0])


def _check_parallelepiped(report, points: Floats, origin: Floats, columns: Floats, reference: Floats) -> None:
    """Corners (e, c, i) must be where the affine map puts them, up to the rounding of coordinates."""
    image = origin[:, None] + np.einsum("eik,ck->eci", columns, reference)
    size = np.linalg.norm(points.max(axis=1) - points.min(axis=1), axis=1)
    rounding = 16 * np.finfo(float).eps * np.abs(points).max(axis=(1, 2))
    off = np.abs(points - image).max(axis=(1, 2)) > PARALLELEPIPED * size + rounding
    report.any(
        off, "is no parallelepiped", f"opposite edges equal to {PARALLELEPIPED:.0e}", "use a tetrahedral mesh"
    )


class _Reporter(NamedTuple):
    """Raises a MeshError that names the first cell of a mask."""

    cell: Cell
    element: str
    points: Floats
    numbers: ArrayLike | None

    def any(self, mask: NDArray[np.bool_], problem: str, expected: str, cure: str) -> None:
        if not mask.any():
            return
        first = int(np.argmax(mask))
        number = first if self.numbers is None else np.asarray(self.numbers)[first]
        centre = ", ".join(f"{x:g}" for x in self.points[first].mean(axis=0))
        others = f" (and {mask.sum() - 1} more)" if mask.sum() > 1 else ""
        name = f"element {self.element}: " if self.element else ""
        raise MeshError(
            f"{name}{self.cell.name} {number} at ({centre}){others} {problem}",
            key="mesh.file",
            expected=expected,
            cure=cure,
        )
