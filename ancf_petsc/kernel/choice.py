"""Which kernels compute an element: those of beams, those of any element, or a fast path that equals them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.kernel import beam, generic, mean, mean_beam, mean_generic, motion, tet3413
from ancf_petsc.kernel.mean import MeanKernels
from ancf_petsc.kernel.motion import MotionKernels
from ancf_petsc.kernel.tables import make_tables, nodes_with_slopes
from ancf_petsc.kernel.tet3413 import Kernels
from ancf_petsc.material.models import Law

Floats = NDArray[np.float64]


class Way(NamedTuple):
    """tables(element, cells (e, a), reference (v, 3), **of make_tables): what kernels take of the cells.

    motion: loops over whole steps of a motion, where there are such.
    """

    tables: Callable[..., tuple]
    kernels: Callable[[Law], Kernels]
    mean_kernels: Callable[[Law], MeanKernels]
    motion: Callable[[Law], MotionKernels] | None = None


def _generic_tables(element: Element, cells: NDArray[np.int32], reference: Floats, **more) -> tuple:
    corners = reference[cells[:, np.flatnonzero(element.slot == 0)[: len(element.cell.corners)]]]
    s, d = nodes_with_slopes(element), element.cell.dimension
    slopes = reference[cells[:, np.flatnonzero(element.slot > 0)]].reshape(len(cells), s, d, 3)
    return make_tables(element, cells, corners, directions=slopes, **more)


def _tables_3413(element: Element, cells: NDArray[np.int32], reference: Floats, **_: object) -> tuple:
    gradients, volumes = np.empty((len(cells), 3, 3)), np.empty(len(cells))
    tet3413.geometry(reference, cells, gradients, volumes)
    return cells, gradients, volumes


ANY = Way(_generic_tables, generic.make_kernels, mean_generic.make_mean_kernels)
BEAM = Way(_generic_tables, beam.make_kernels, mean_beam.make_mean_kernels)
FAST = {"3413": Way(_tables_3413, tet3413.make_kernels, mean.make_mean_kernels, motion.make_motion_kernels)}


def way_of(element: Element) -> Way:
    """How an element is computed."""
    return BEAM if element.is_beam else FAST.get(element.code, ANY)
