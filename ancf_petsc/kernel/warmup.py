"""Compiling all kernels of a law ahead of a run, on one cell, with the types a run has."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.kernel.choice import way_of
from ancf_petsc.kernel.compiled import CACHE_FOLDER
from ancf_petsc.kernel.constant import add_mass, add_mass_blocks, mass_product
from ancf_petsc.kernel.graph import block_starts, neighbours
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


def _compile_motion(kernels: MotionKernels, body: tuple, x: NDArray, graph: tuple[NDArray, NDArray]) -> None:
    n = len(x)
    still, factors, patterns = np.zeros((n, 3)), np.zeros((1, 1)), np.zeros((1, n, 3))
    mass = (np.zeros((0, 0, 0)), np.zeros(3, np.int64), still)
    weighed = (*graph, np.zeros(len(graph[1])))
    force, sums, values = np.empty((n, 3)), np.empty((3, n)), np.empty((n, 3))
    y = np.stack((x, still))
    y.setflags(write=False)  # as PETSc lends its arrays
    kernels.rates(y, 0.0, body, factors[0], patterns, mass, force, sums, np.empty((2, n, 3)))
    kernels.march(x.copy(), still, values, 0.0, 0.0, body, factors, patterns, mass, weighed, force, sums)
    kernels.unbalance(y[0], y[1], 0.0, still, body, factors[0], patterns, weighed, force, values)


def _mark(element: Element, law: Law, *, mean: bool, moving: bool) -> Path:
    """The file that says: compiled. Elements computed the same way share their machine code."""
    way = way_of(element).kernels.__module__.rpartition(".")[2]
    return CACHE_FOLDER / f"{way}.{law.name}{'.mean' * mean}{'.motion' * moving}.compiled"
