"""Calls of every kernel on one deformed cell, with the types a run has.

Whoever iterates makes each call before asking for the next one: later arguments may hold what earlier calls wrote.
`warmup` compiles the kernels by them, `selfcheck` compares machine code with the same functions run by Python.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.algebra import blocks, coarse
from ancf_petsc.algebra.envelope import envelope, factorise, solve_fields
from ancf_petsc.algebra.graph import block_starts, neighbours
from ancf_petsc.element.element import Element
from ancf_petsc.kernel import motion
from ancf_petsc.kernel.adaptive import leap
from ancf_petsc.kernel.choice import RING, kernel_set
from ancf_petsc.kernel.constant import MassCells, add_mass, add_mass_blocks, mass_product
from ancf_petsc.kernel.explicit import EXPLICIT
from ancf_petsc.kernel.implicit import Scheme, Test, alpha_steps
from ancf_petsc.kernel.interface import Means, Span, Target
from ancf_petsc.kernel.revolution import Revolution
from ancf_petsc.kernel.tables import nodes_with_slopes
from ancf_petsc.material.models import Law

DISTORTION = 0.05
"""Of a cell of size 1: enough that every law answers with numbers of its own."""


class Call(NamedTuple):
    """A kernel and its arguments, some of which it writes to."""

    kernel: Callable
    arguments: tuple[Any, ...]


def one_cell(element: Element) -> NDArray[np.float64]:
    """Nodal vectors (a, 3) of the reference cell."""
    d = element.cell.dimension
    positions = np.zeros((element.functions, 3))
    positions[:, :d] = element.node_coordinates[element.node]
    for j in range(d):
        positions[element.slot == j + 1] = np.eye(3)[j]
    return positions


def deformed(positions: NDArray, seed: int) -> NDArray[np.float64]:
    """Nodal vectors (a, 3) near given ones, each time the same."""
    return positions + DISTORTION * np.random.default_rng(seed).uniform(-1.0, 1.0, positions.shape)


def law_calls(
    element: Element, law: Law, *, mean: bool = False, moving: bool = False, axisymmetric: bool = False
) -> Iterator[Call]:
    """Calls of the kernels of an element and a law.

    mean: those between two states too, for the energy-momentum step. moving: the loops over steps of motions. axisymmetric: of
    a body of revolution, on a ring of radius 1.
    """
    n, d = element.functions, element.cell.dimension
    cells, reference = np.arange(n, dtype=np.int32).reshape(1, n), one_cell(element)
    reference[element.slot == 0, 0] += float(axisymmetric)
    before, after = deformed(reference, 1), deformed(reference, 2)
    graph, matrix = _matrix(cells)
    chosen = kernel_set(element, axisymmetric=axisymmetric)
    more = {"revolution": Revolution(radial=0, axis=1, angle=1.0)} if chosen is RING else {}
    tables = chosen.cells(element, cells, reference, axes=np.eye(3)[:, :d], **more)
    kernels, p = chosen.kernels(law), law.parameters(1.0, 0.3)
    rest = (tables, p, Span(0, 1))
    yield Call(kernels.internal_force, ((before,), *rest, np.zeros((n, 3))))
    yield Call(kernels.energy, ((before,), *rest))
    yield Call(kernels.tangent, ((before,), *rest, matrix))
    yield Call(kernels.tangent_product, ((before, after), *rest, np.zeros((n, 3))))
    yield Call(kernels.fields, ((before,), *rest, Means(np.empty((1, 9)), np.empty((1, 9)), np.empty(1))))
    if mean and kernels.mean_force is not None and kernels.mean_tangent is not None:
        yield Call(kernels.mean_force, ((before, after), *rest, np.zeros((n, 3))))
        yield Call(kernels.mean_tangent, ((before, after), *rest, matrix))
    if moving and chosen.force_of_all is not None:
        body = (chosen.force_of_all(law, tables), tuple(tables), p, (0, 1))
        yield from _motion_calls(body, before, graph)


def common_calls(element: Element) -> Iterator[Call]:
    """Calls of what depends on no law: mass, half matrix, incomplete factor, coarse space."""
    n = element.functions
    cells = np.arange(n, dtype=np.int32).reshape(1, n)
    graph, matrix = _matrix(cells)
    yield from _mass_calls(element, cells, graph, matrix)
    yield from _block_calls(graph)


def _matrix(cells: NDArray) -> tuple[tuple[NDArray, NDArray], Target]:
    """The graph of one cell's nodal vectors, and its matrix as kernels take it."""
    n = cells.shape[1]
    pointers, columns = neighbours(cells, n, n)
    starts = block_starts(cells, n, pointers, columns, pointers, columns, 3)
    strides, driven, values = np.full((n, 2), 3 * n, np.int32), np.zeros(n, np.uint8), np.zeros(9 * n * n)
    return (pointers, columns), Target(starts, strides, len(values), driven, values)


def _mass_calls(element: Element, cells: NDArray, graph: tuple, matrix: tuple) -> Iterator[Call]:
    n, (pointers, columns), (driven, values) = element.functions, graph, matrix[3:]
    maps, slot = np.tile(np.eye(3), (1, nodes_with_slopes(element), 1, 1)), element.slot.astype(np.int32)
    mass, shape_mass = np.zeros(len(columns)), deformed(np.eye(n), 3)
    for lumped in (True, False):
        mass_cells = MassCells(cells, np.ones((1, 1)), shape_mass[None], slot, maps)
        yield Call(add_mass, (mass_cells, lumped, Span(0, 1), graph, mass))
    yield Call(mass_product, (pointers, columns, mass, deformed(np.zeros((n, 3)), 4), np.empty((n, 3))))
    none = np.zeros_like(pointers)
    yield Call(add_mass_blocks, (graph, mass, 2.0, (pointers, none, 9 * n * n, driven), values))


def _block_calls(graph: tuple[NDArray, NDArray]) -> Iterator[Call]:
    pointers, columns = graph
    n = len(pointers) - 1
    upper, right = blocks.upper_pattern(pointers, columns)
    whole = deformed(np.eye(3 * n), 5)
    values = (whole + whole.T).ravel()
    half = (upper, right, np.zeros((len(right), 9)), np.ones((n, 9)))
    factor, pivots = np.zeros((len(right), 9), np.float32), np.zeros((n, 9), np.float32)
    yield Call(blocks.copy_half, (values, pointers, *half[::2], half[3]))
    x, lent = deformed(np.zeros((n, 3)), 6), deformed(np.zeros((n, 3)), 7)
    lent.setflags(write=False)  # as PETSc lends its arrays
    none = np.zeros_like(pointers)
    for given in (x, lent):
        yield Call(blocks.symmetric_product, (*half, given, np.empty((n, 3))))
    yield Call(blocks.add_ghost_product, (values, 0, pointers, columns, x, np.zeros((n, 3))))
    yield Call(blocks.factorise, (*half, factor, pivots))
    work = np.zeros((n, 3), np.float32)
    yield Call(blocks.solve_factors, (upper, right, factor, pivots, lent, work, np.empty((n, 3))))
    rigid = (np.zeros(n, np.int64), x, np.ones(n), deformed(np.ones((n, 3)), 8))
    motion = np.zeros(6)
    yield Call(coarse.restrict, (*rigid, n, lent, motion))
    yield Call(coarse.add_motion, (*rigid, n, motion, np.zeros((n, 3))))
    yield Call(coarse.add_coarse_matrix, (half, (values, 0, none, columns), *rigid, np.zeros((6, 6))))


def _motion_calls(body: tuple, x: NDArray, graph: tuple[NDArray, NDArray]) -> Iterator[Call]:
    """body: as `motion.System` has it."""
    n = len(x)
    rows = np.repeat(np.arange(n), np.diff(graph[0]))
    values = np.where(graph[1] == rows, 1.0, 0.1)
    starts = envelope(*graph)
    kept = np.zeros((1, starts[-1]))
    yield Call(factorise, (starts, *graph, values, np.ones(n, bool), kept[0]))
    which, share = np.zeros(3, np.int64), np.ones((n, 3))
    yield Call(solve_fields, (starts, kept, which, deformed(np.zeros((n, 3)), 9), np.empty((3, n))))
    buffers = (np.empty((n, 3)), np.empty((3, n)))
    system = tuple(motion.System(body, 0.3, (starts, kept, which, share), (*graph, values), buffers))
    factors, patterns = np.array([[1.0], [0.5]]), deformed(np.zeros((1, n, 3)), 10)
    now = (factors[0], patterns)
    y = np.stack((x, deformed(np.zeros((n, 3)), 11)))
    course = ((0.0, 0.02, 1e-12, 4), (0.01, 0.1, 1e-6, 1e-6, 1.1))
    yield Call(leap, (y, EXPLICIT["5dp"].as_arguments, course, now, system))
    yield from _implicit_calls(y, (factors, patterns), system)
    state = (y[0].copy(), y[1].copy(), np.zeros((n, 3)))
    yield Call(motion.march, (state, 0.01, (factors, patterns), system))
    values_of_balance = np.empty((n, 3))
    y.setflags(write=False)  # as PETSc lends its arrays
    yield Call(motion.unbalance, ((y[0], y[1], share), 0.5, now, system, values_of_balance))
    yield Call(motion.rates, (y, now, system, np.empty((2, n, 3))))


def _implicit_calls(y: NDArray, loads: tuple, system: tuple) -> Iterator[Call]:
    n = y.shape[1]
    a, d, *buffers = np.zeros((5, n, 3))
    scheme = Scheme(h=0.01, alpha_m=0.7, alpha_f=0.6, beta=0.3, gamma=0.6, damping=0.3)
    starts, factor = np.arange(3 * n + 1), np.full(3 * n, scheme.h * np.sqrt(scheme.beta / scheme.alpha_m))
    pointers = np.zeros(3 * n + 1, np.int32)  # PETSc's integers
    yield Call(envelope, (pointers, pointers))
    yield Call(factorise, (starts, pointers, pointers, factor, np.zeros(3 * n, bool), np.empty(3 * n)))
    test = Test(1e-7, 0.0, 0.0, 0.5, 20)
    rules = (tuple(scheme), tuple(test), (starts, factor), tuple(buffers))
    state, progress = (y[0].copy(), y[1].copy(), a, d), (0, 0, 0, np.inf, False, False)
    yield Call(alpha_steps, (state, progress, rules, loads, system))
