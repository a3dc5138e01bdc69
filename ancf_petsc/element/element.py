"""What an element is: a row of data, from which coordinates, shape functions and tables follow.

Axes: q point, a shape function (node by node, the position first, then the slopes), k direction in the
reference cell.

Source: Olshevskiy et al., Nonlinear Dynamics 88 (2017) 2457, Sec. 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ancf_petsc.element import dncm, shape
from ancf_petsc.element.cell import CELLS, PARTS, Cell, Corners, Geometry, cell_geometry
from ancf_petsc.element.quadrature import Rule, rule, rule_of_degree
from ancf_petsc.element.shape import ElementTables
from ancf_petsc.errors import CaseError, did_you_mean

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Node:
    """A node at the mean of some corners (2: middle of an edge, 3 or 4: centre of a face) and its vectors."""

    corners: Corners
    vectors: int


@dataclass(frozen=True, eq=False)
class Element:
    """One element of the catalogue.

    code: dncm. cell: the reference cell. kinds: meshio's names of the cells it accepts, the natural one
    first. corner, edge, face: nodal vectors on each corner, middle of an edge, centre of a face. monomials:
    as `shape.monomials` reads them. condensed: the monomials hold one more value for each face centre, which
    follows from the face's corners. complete: the degree up to which every polynomial is reproduced. points:
    number of quadrature points by name: default; exact (the energy of svk); mass (exact, of bodies of revolution
    too); reduced where it is safe (no energy-free motion but the rigid ones); ring where bodies of revolution need
    more than default. continuity: derivatives that are continuous between elements.
    """

    code: str
    name: str
    cell_name: str
    kinds: tuple[str, ...]
    monomials: str
    complete: int
    points: dict[str, int]
    corner: int = 1
    edge: int = 0
    face: int = 0
    condensed: bool = False
    continuity: int = 0

    def __post_init__(self) -> None:
        vectors = sum(node.vectors for node in self.nodes)
        if (vectors, self.cell.dimension) != (self.dncm.functions, self.dncm.dimension):
            raise ValueError(
                f"element {self.code}: its nodes carry {vectors} vectors in dimension {self.cell.dimension}, "
                f"its code says {self.dncm.functions} in dimension {self.dncm.dimension}"
            )
        wanted = vectors + len(self.cell.facets) * self.condensed
        if len(self.exponents) != wanted:
            raise ValueError(f"element {self.code}: {len(self.exponents)} monomials, expected {wanted}")

    @cached_property
    def dncm(self) -> dncm.Dncm:
        return dncm.parse(self.code)

    @property
    def cell(self) -> Cell:
        return CELLS[self.cell_name]

    @property
    def components(self) -> int:
        """Components m of a nodal vector."""
        return self.dncm.components

    @property
    def functions(self) -> int:
        """Number of shape functions, which are nodal vectors of one element."""
        return self.dncm.functions

    @property
    def has_slopes(self) -> bool:
        return self.corner > 1

    @property
    def is_beam(self) -> bool:
        """Whether its strains are those of an axis, stretched and bent."""
        return self.cell.dimension < min(self.components, 2)

    @property
    def is_plane(self) -> bool:
        """Whether its cells lie in a plane and its points move in it."""
        return self.cell.dimension == self.components == 2

    @property
    def is_curved(self) -> bool:
        """Whether edges of a deformed cell are curved."""
        return self.has_slopes or self.edge > 0

    @cached_property
    def nodes(self) -> tuple[Node, ...]:
        """Corners, then middles of edges, then centres of faces, as the element has them."""
        corners = tuple((c,) for c in range(len(self.cell.corners)))
        every = ((corners, self.corner), (self.cell.edges, self.edge), (self.cell.facets, self.face))
        return tuple(Node(part, vectors) for parts, vectors in every if vectors for part in parts)

    @cached_property
    def node_coordinates(self) -> Floats:
        """(n, k) nodes in the reference cell."""
        return np.array([self.cell.centre(node.corners) for node in self.nodes], dtype=float)

    @cached_property
    def node(self) -> Integers:
        """(a) the node of each shape function."""
        return np.repeat(np.arange(len(self.nodes)), [node.vectors for node in self.nodes])

    @cached_property
    def slot(self) -> Integers:
        """(a) 0 for a position, j for the slope along axis j."""
        return np.concatenate([np.arange(node.vectors) for node in self.nodes])

    @cached_property
    def exponents(self) -> tuple[tuple[int, ...], ...]:
        """(p, k) of the monomials."""
        return shape.monomials(self.cell.dimension, self.monomials)

    @cached_property
    def degree(self) -> int:
        """Highest total degree of the monomials."""
        return max(sum(row) for row in self.exponents)

    @cached_property
    def exact_coefficients(self) -> shape.Matrix:
        """W^-1 (p, a) in fractions: shape function a is the sum of its coefficients times the monomials."""
        d = self.cell.dimension
        orders = [tuple(int(k == j) for k in range(1, d + 1)) for j in range(d + 1)]
        functionals = [
            (self.cell.centre(node.corners), orders[j]) for node in self.nodes for j in range(node.vectors)
        ]
        if self.condensed:
            functionals += [(self.cell.centre(facet), orders[0]) for facet in self.cell.facets]
        try:
            inverse = shape.shape_coefficients(self.exponents, functionals)
        except ValueError as error:
            raise ValueError(f"element {self.code}: {error}") from error
        return self._condense(inverse) if self.condensed else inverse

    def _condense(self, inverse: shape.Matrix) -> shape.Matrix:
        """Coefficients (p, a) with the values at face centres, the last columns, following the corners."""
        n = self.functions
        centres = self._condensed_face_centres()
        return [
            [
                kept + sum(f * c[a] for f, c in zip(row[n:], centres, strict=True) if c[a])
                for a, kept in enumerate(row[:n])
            ]
            for row in inverse
        ]

    def _condensed_face_centres(self) -> list[list[Fraction]]:
        """(f, a) of r_f = (1/3) sum r_i + (1/6) sum (grad r)_i (X_f - X_i) over the corners i of face f."""
        rows = []
        for facet in self.cell.facets:
            row = [Fraction(0)] * self.functions
            centre = self.cell.centre(facet)
            for corner in facet:
                first = corner * self.corner
                row[first] = Fraction(1, 3)
                for k, (x, xi) in enumerate(zip(centre, self.cell.corners[corner], strict=True)):
                    row[first + 1 + k] = (x - xi) / 6
            rows.append(row)
        return rows

    @cached_property
    def coefficients(self) -> Floats:
        """W^-1 (p, a), rounded once."""
        return np.array(self.exact_coefficients, dtype=float)

    def values(self, points: ArrayLike) -> Floats:
        """Shape functions (q, a) at points (q, k) of the reference cell."""
        return self.derivative(points, (0,) * self.cell.dimension)

    def gradients(self, points: ArrayLike) -> Floats:
        """Gradients (q, a, k) with respect to xi at points (q, k) of the reference cell."""
        orders = np.eye(self.cell.dimension, dtype=int)
        return np.stack([self.derivative(points, order) for order in orders.tolist()], axis=-1)

    def derivative(self, points: ArrayLike, order: Sequence[int]) -> Floats:
        """(q, a) derivative of the orders along each xi_k, as (2,) for the second one of a beam."""
        return shape.tabulate(self.exponents, self.coefficients, points, order)

    def rule(self, name: str = "default") -> Rule:
        """The quadrature called default, reduced, exact or mass. Raises CaseError where there is none."""
        if name not in self.points:
            raise CaseError(
                key="mesh.rule",
                got=name,
                expected=f"a quadrature of element {self.code}",
                cure=did_you_mean(name, tuple(self.points)),
            )
        return rule(self.cell_name, self.points[name])

    def tables(self, name: str = "default") -> ElementTables:
        """Shape functions at the points of a named quadrature."""
        chosen = self.rule(name)
        return self.tables_at(chosen.points, chosen.weights)

    def part_tables(self, corners: Corners, degree: int) -> ElementTables:
        """Shape functions on the part of the cell with these corners: an edge, a face, or one corner.

        Weights sum to the measure of the reference part (1 on edges and quads, 1/2 on triangles): times the
        length of the edge or the length of the cross product of two edges of the face they measure the part.
        Exact to `degree`.
        """
        x = np.array([self.cell.corners[c] for c in corners], dtype=float)
        if len(corners) == 1:
            return self.tables_at(x, np.ones(1))
        chosen = rule_of_degree(PARTS[len(corners)].name, degree)
        origin = x[0] if PARTS[len(corners)].is_simplex else x.mean(axis=0)
        edges = x[[1, -1][: chosen.points.shape[1]]] - x[0]
        return self.tables_at(origin + chosen.points @ edges, chosen.weights)

    def tables_at(self, points: Floats, weights: Floats) -> ElementTables:
        """Shape functions at any points (q, k) of the reference cell."""
        return ElementTables(
            points, weights, self.values(points), self.gradients(points), self.node, self.slot
        )

    def geometry(self, points: ArrayLike, numbers: ArrayLike | None = None) -> Geometry:
        """Affine maps of cells from their corners (e, corners, 2 or 3); see `cell_geometry`."""
        return cell_geometry(self.cell, points, element=self.code, numbers=numbers)
