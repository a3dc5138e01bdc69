"""Compiling all kernels of a law ahead of a run, on one cell, with the types a run has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ancf_petsc.kernel.compiled import CACHE_FOLDER
from ancf_petsc.kernel.graph import block_starts, neighbours
from ancf_petsc.kernel.tet3413 import geometry, make_kernels
from ancf_petsc.material.models import Law


def is_compiled(laws: Sequence[Law]) -> bool:
    """Whether the machine code of all these laws is in the cache."""
    return all(_mark(law).exists() for law in laws)


def compile_kernels(laws: Sequence[Law]) -> None:
    """Compile the kernels of element 3413 for each law, or load them from the cache."""
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
        _mark(law).touch()


def _mark(law: Law):
    return CACHE_FOLDER / f"{law.name}.compiled"
