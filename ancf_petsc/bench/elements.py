"""The whole catalogue of elements: what compiling it takes, and what a quadrature point costs."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np
from mpi4py import MPI

from ancf_petsc.algebra.graph import block_starts, neighbours
from ancf_petsc.bench.yardstick import timed
from ancf_petsc.element.catalog import element
from ancf_petsc.kernel.choice import kernel_set
from ancf_petsc.kernel.interface import Span, Target
from ancf_petsc.kernel.samples import one_cell
from ancf_petsc.material.models import LAWS

COMPILING = """
from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.kernel.warmup import compile_kernels
from ancf_petsc.material.models import LAWS
for element in ELEMENTS.values():
    compile_kernels(element, list(LAWS.values()), mean=True, moving=True)
"""
ENOUGH_POINTS = 3_000
AMPLITUDE, STEP = 0.01, 1e-4  # of the size of a cell


def compile_catalogue(comm: MPI.Comm, *, repetitions: int) -> dict[str, Any]:
    """Seconds of a process that compiles all kernels of all elements and laws, its folder for machine code empty."""
    samples: list[float] = []
    processor = _processor_time()
    for _ in range(repetitions if comm.rank == 0 else 0):
        with tempfile.TemporaryDirectory() as place:
            begun = time.perf_counter()
            subprocess.run(
                [sys.executable, "-c", COMPILING], env=os.environ | {"ANCF_CACHE_DIR": place}, check=True
            )
            samples.append(time.perf_counter() - begun)
    facts = {"processor_seconds": (_processor_time() - processor) / max(1, len(samples))}
    return {"samples": comm.bcast(samples), "error": None, "facts": facts}


def _processor_time() -> float:
    """Seconds that processes started here have computed."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def points(comm: MPI.Comm, *, code: str, kernel: str, law: str, repetitions: int) -> dict[str, Any]:
    """ns a quadrature point of the residual or the tangent of an element, cells of random states.

    Checked: the force against differences of the energy, the tangent against the elements' directional derivative.
    """
    cells = _Cells(code, law)
    work = {"residual": cells.force, "tangent": cells.tangent}[kernel]
    error = {"residual": cells.force_error, "tangent": cells.tangent_error}[kernel]()
    count, n = cells.count * cells.points, cells.functions
    seconds = timed(comm, work, repetitions)
    samples = [1e9 * spent / count for spent in seconds]
    pairs = n * (n + 1) // 2
    return {"samples": samples, "error": error, "facts": {"points": cells.points, "pairs": pairs}}


class _Cells:
    """Cells of one element that share nothing, each in another state."""

    def __init__(self, code: str, law: str) -> None:
        row, chosen = element(code), LAWS[law]
        chosen_set, n, d = kernel_set(row), row.functions, row.cell.dimension
        self.functions, self.points = n, row.points["default"]
        self.count = max(1, ENOUGH_POINTS // self.points)
        v = self.count * n
        cells = np.arange(v, dtype=np.int32).reshape(self.count, n)
        reference = np.tile(one_cell(row), (self.count, 1))
        random = np.random.default_rng(1)
        self.x, self.direction = reference.copy(), np.zeros((v, 3))
        self.x[:, :d] += AMPLITUDE * random.normal(size=(v, d))
        self.direction[:, :d] = random.normal(size=(v, d))
        self.kernels = chosen_set.kernels(chosen)
        tables = chosen_set.cells(row, cells, reference, axes=np.eye(3)[:, :d])
        self.arguments = (tables, chosen.parameters(1.0, 0.3), Span(0, self.count))
        pointers, columns = neighbours(cells, v, v)
        starts = block_starts(cells, v, pointers, columns, pointers, columns, 3)
        self.values, self.result = np.zeros(9 * len(columns)), np.zeros((v, 3))
        strides = np.full((v, 2), 3 * n, np.int32)
        self.matrix = Target(starts, strides, len(self.values), np.zeros(v, np.uint8), self.values)

    def force(self) -> None:
        self.kernels.internal_force((self.x,), *self.arguments, self.result)

    def tangent(self) -> None:
        self.kernels.tangent((self.x,), *self.arguments, self.matrix)

    def force_error(self) -> float:
        self.result[:] = 0.0
        self.force()
        found = float(np.sum(self.result * self.direction))
        ahead, behind = (
            self.kernels.energy((self.x + h * self.direction,), *self.arguments) for h in (STEP, -STEP)
        )
        return abs((ahead - behind) / 2 / STEP - found) / float(abs(self.result * self.direction).sum())

    def tangent_error(self) -> float:
        n = self.functions
        self.values[:] = self.result[:] = 0.0
        self.tangent()
        blocks = self.values.reshape(self.count, n, 3, n, 3)
        found = np.einsum("eaibj,ebj->eai", blocks, self.direction.reshape(self.count, n, 3))
        self.kernels.tangent_product((self.x, self.direction), *self.arguments, self.result)
        wanted = self.result.reshape(found.shape)
        return float(abs(found - wanted).max() / abs(wanted).max())
