"""Compiling all kernels of a law ahead of a run, on one cell, with the types a run has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ancf_petsc.kernel.compiled import CACHE_FOLDER
from ancf_petsc.kernel.constant import add_mass, add_mass_blocks, mass_product
from ancf_petsc.kernel.graph import block_starts, neighbours
from ancf_petsc.kernel.mean import make_mean_kernels
from ancf_petsc.kernel.tet3413 import geometry, make_kernels
from ancf_petsc.material.models import Law


def is_compiled(laws: Sequence[Law], *, mean: bool = False) -> bool:
    """Whether the machine code of all these laws is in the cache."""
    return all(_mark(law, mean).exists() for law in laws)


def compile_kernels(laws: Sequence[Law], *, mean: bool = False) -> None:
    """Compile the kernels of element 3413 for each law, or load them from the cache.

    mean: those between two states too, for the energy-momentum step.
    """
    points = np.vstack((np.zeros(3), np.eye(3)))
    cells = np.arange(4, dtype=np.int32).reshape(1, 4)
    gradients, volumes = np.empty((1, 3, 3)), np.empty(1)
    geometry(points, cells, gradients, volumes)
    pointers, columns = neighbours(cells, 4, 4)
    starts = block_starts(cells, 4, pointers, columns, pointers, columns, 3)
    strides, driven, values = np.full((4, 2), 12, np.int32), np.zeros(4, np.uint8), np.zeros(144)
    tables, force = (cells, gradients, volumes), np.zeros((4, 3))
    for law in laws:
        kernels, p = make_kernels(law), law.parameters(1.0, 0.3)
        kernels.internal_force(points, *tables, p, 0, 1, force)
        kernels.energy(points, *tables, p, 0, 1)
        kernels.tangent(points, *tables, p, 0, 1, starts, strides, 144, driven, values)
        kernels.tangent_product(points, points, *tables, p, 0, 1, force)
        kernels.fields(points, *tables, p, 0, 1, np.empty((1, 9)), np.empty((1, 9)), np.empty(1))
        if mean and law.mean_stress is not None:
            between = make_mean_kernels(law)
            between.force(points, points, *tables, p, 0, 1, force)
            between.tangent(points, points, *tables, p, 0, 1, starts, strides, 144, driven, values)
        _mark(law, mean).touch()
    _compile_mass(cells, pointers, columns, points, driven, values)


def _compile_mass(cells, pointers, columns, points, driven, values) -> None:
    mass = np.zeros(len(columns))
    add_mass(cells, np.ones(1), np.eye(4), 0, 1, pointers, columns, mass)
    mass_product(pointers, columns, mass, points, np.empty((4, 3)))
    none = np.zeros_like(pointers)
    add_mass_blocks(pointers, columns, mass, 1.0, pointers, none, 144, driven, values)


def _mark(law: Law, mean: bool):  # noqa: FBT001
    return CACHE_FOLDER / f"{law.name}{'.mean' * mean}.compiled"
