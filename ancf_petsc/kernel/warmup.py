"""Compiling all kernels of a law ahead of a run, on one cell, with the types a run has."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.algebra import blocks, coarse
from ancf_petsc.algebra.envelope import envelope, factorise, solve_fields
from ancf_petsc.algebra.graph import block_starts, neighbours
from ancf_petsc.element.element import Element
from ancf_petsc.jit import CACHE_FOLDER
from ancf_petsc.kernel.choice import way_of
from ancf_petsc.kernel.constant import add_mass, add_mass_blocks, mass_product
from ancf_petsc.kernel.implicit import Progress, Scheme, Test
from ancf_petsc.kernel.motion import MotionKernels
from ancf_petsc.kernel.tables import nodes_with_slopes
from ancf_petsc.material.models import Law


def is_compiled(element: Element, laws: Sequence[Law], *, mean: bool = False, moving: bool = False) -> bool:
    """Whether the machine code of the element with all these laws is in the cache."""
    return all(_mark(element, law, mean=mean, moving=moving).exists() for law in laws)


def compile_kernels(
    element: Element, laws: Sequence[Law], *, mean: bool = False, moving: bool = False
) -> None:
    """Compile the kernels of an element for each law, or load them from the cache.

    mean: those between two states too, for the energy-momentum step. moving: the loops over steps of motions.
    """
    n, d = element.functions, element.cell.dimension
    cells = np.arange(n, dtype=np.int32).reshape(1, n)
    positions = one_cell(element)
    pointers, columns = neighbours(cells, n, n)
    starts = block_starts(cells, n, pointers, columns, pointers, columns, 3)
    strides, driven, values = np.full((n, 2), 3 * n, np.int32), np.zeros(n, np.uint8), np.zeros(9 * n * n)
    way, force = way_of(element), np.zeros((n, 3))
    tables = way.tables(element, cells, positions, axes=np.eye(3)[:, :d])
    matrix = (starts, strides, len(values), driven, values)
    for law in laws:
        kernels, p = way.kernels(law), law.parameters(1.0, 0.3)
        kernels.internal_force(positions, *tables, p, 0, 1, force)
        kernels.energy(positions, *tables, p, 0, 1)
        kernels.tangent(positions, *tables, p, 0, 1, *matrix)
        kernels.tangent_product(positions, positions, *tables, p, 0, 1, force)
        kernels.fields(positions, *tables, p, 0, 1, np.empty((1, 9)), np.empty((1, 9)), np.empty(1))
        if mean and law.mean_stress is not None:
            between = way.mean_kernels(law)
            between.force(positions, positions, *tables, p, 0, 1, force)
            between.tangent(positions, positions, *tables, p, 0, 1, *matrix)
        if moving and way.motion is not None:
            _compile_motion(way.motion(law), (*tables, p), positions, (pointers, columns))
        _mark(element, law, mean=mean, moving=moving).touch()
    _compile_mass(element, cells, pointers, columns, driven, values)
    _compile_blocks(pointers, columns, values)


def one_cell(element: Element) -> NDArray[np.float64]:
    """Nodal vectors (a, 3) of the reference cell."""
    d = element.cell.dimension
    positions = np.zeros((element.functions, 3))
    positions[:, :d] = element.node_coordinates[element.node]
    for j in range(d):
        positions[element.slot == j + 1] = np.eye(3)[j]
    return positions


def _compile_mass(element: Element, cells, pointers, columns, driven, values) -> None:
    n, mass = element.functions, np.zeros(len(columns))
    maps = np.tile(np.eye(3), (1, nodes_with_slopes(element), 1, 1))
    slot = element.slot.astype(np.int32)
    add_mass(cells, np.ones(1), np.eye(n), slot, maps, False, 0, 1, pointers, columns, mass)
    mass_product(pointers, columns, mass, np.zeros((n, 3)), np.empty((n, 3)))
    none = np.zeros_like(pointers)
    add_mass_blocks(pointers, columns, mass, 1.0, pointers, none, 9 * n * n, driven, values)


def _compile_blocks(pointers, columns, values) -> None:
    n = len(pointers) - 1
    upper, right = blocks.upper_pattern(pointers, columns)
    half = (upper, right, np.zeros((len(right), 9)), np.ones((n, 9)))
    factor, pivots = np.zeros((len(right), 9), np.float32), np.zeros((n, 9), np.float32)
    blocks.copy_half(values, pointers, *half[::2], half[3])
    x, lent, work = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3), np.float32)
    lent.setflags(write=False)  # as PETSc lends its arrays
    none = np.zeros_like(pointers)
    for given in (x, lent):
        blocks.symmetric_product(*half, given, np.empty((n, 3)))
    blocks.add_ghost_product(values, 0, none, columns, x, np.empty((n, 3)))
    blocks.factorise(*half, factor, pivots)
    blocks.solve_factors(upper, right, factor, pivots, lent, work, np.empty((n, 3)))
    rigid = (np.zeros(n, np.int64), x, np.zeros(n), x)
    coarse.restrict(*rigid, n, lent, np.zeros(6))
    coarse.add_motion(*rigid, n, np.zeros(6), np.empty((n, 3)))
    coarse.add_coarse_matrix(half, (values, 0, none, columns), *rigid, np.zeros((6, 6)))


def _compile_motion(kernels: MotionKernels, body: tuple, x: NDArray, graph: tuple[NDArray, NDArray]) -> None:
    n = len(x)
    still, factors, patterns = np.zeros((n, 3)), np.zeros((1, 1)), np.zeros((1, n, 3))
    starts = envelope(*graph)
    kept = np.zeros((1, starts[-1]))
    mass = (starts, kept, np.zeros(3, np.int64), still)
    factorise(starts, *graph, np.zeros(len(graph[1])), np.zeros(n, bool), kept[0])
    solve_fields(starts, kept, mass[2], still, np.empty((3, n)))
    weighed = (*graph, np.zeros(len(graph[1])))
    force, work, values = np.empty((n, 3)), np.empty((3, n)), np.empty((n, 3))
    y, system = np.stack((x, still)), (0.0, body, factors[0], patterns, mass, force, work)
    span, control = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0, 1.0)
    kernels.leap(y, span, 0, control, 0.0, weighed, system, np.empty((7, 2, n, 3)), np.empty((2, n, 3)))
    _compile_implicit(kernels, body, y, (factors, patterns), weighed)
    y.setflags(write=False)  # as PETSc lends its arrays
    kernels.rates(y, *system, np.empty((2, n, 3)))
    kernels.march(x.copy(), still, values, 0.0, 0.0, body, factors, patterns, mass, weighed, force, work)
    kernels.unbalance(y[0], y[1], 0.0, still, body, factors[0], patterns, weighed, force, values)


def _compile_implicit(kernels: MotionKernels, body: tuple, y: NDArray, loads: tuple, graph: tuple) -> None:
    n = y.shape[1]
    v, a, d, share, *buffers = np.zeros((8, n, 3))
    starts = np.arange(3 * n + 1)
    factor = np.zeros(3 * n)
    pointers = np.zeros(3 * n + 1, np.int32)  # PETSc's integers
    envelope(pointers, pointers)
    factorise(starts, pointers, pointers, factor, np.zeros(3 * n, bool), factor)
    progress, scheme = Progress(0, 0, 0, np.inf, True, False), Scheme(1.0, 1.0, 1.0, 1.0, 1.0, 0.0)
    test, solver = Test(1.0, 0.0, 0.0, 1.0, 0), (starts, factor)
    kernels.alpha(
        y[0].copy(), v, a, d, progress, 0, scheme, test, loads, body, graph, share, solver, tuple(buffers)
    )


def _mark(element: Element, law: Law, *, mean: bool, moving: bool) -> Path:
    """The file that says: compiled. Elements computed the same way share their machine code."""
    way = way_of(element).kernels.__module__.rpartition(".")[2]
    return CACHE_FOLDER / f"{way}.{law.name}{'.mean' * mean}{'.motion' * moving}.compiled"
