"""Which kernels compute an element: those of beams, those of solids, or a fast path that equals them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.kernel import point_beam, point_ring, point_solid, tet3413
from ancf_petsc.kernel.interface import Cells, Floats, Kernels
from ancf_petsc.kernel.revolution import Revolution, RingCells, ring_tables
from ancf_petsc.kernel.tables import make_tables, nodes_with_slopes
from ancf_petsc.material.models import Law


class KernelSet(NamedTuple):
    """cells(element, cells (e, a), reference (v, 3), **of make_tables): what kernels take of the cells; of bodies of revolution
    the keyword revolution too.

    force_of_all(law, cells): address of the internal forces of all cells, for the loops of `kernel/motion`, where they are used.
    """

    name: str
    cells: Callable[..., tuple]
    kernels: Callable[[Law], Kernels]
    force_of_all: Callable[[Law, tuple], int] | None = None


def _any_cells(element: Element, cells: NDArray[np.int32], reference: Floats, **more) -> Cells:
    corners, slopes = _places(element, cells, reference)
    return make_tables(element, cells, corners, directions=slopes, **more)


def _rings(
    element: Element,
    cells: NDArray[np.int32],
    reference: Floats,
    *,
    revolution: Revolution,
    axes: Floats,
    quadrature: str = "default",
    numbers: NDArray | None = None,
    **_: object,
) -> RingCells:
    corners, slopes = _places(element, cells, reference)
    more: dict[str, Any] = {"directions": slopes, "quadrature": quadrature, "numbers": numbers}
    return ring_tables(element, cells, corners, revolution=revolution, axes=axes, **more)


def _places(element: Element, cells: NDArray[np.int32], reference: Floats) -> tuple[Floats, Floats]:
    """Undeformed corners (e, c, 3) and slopes (e, s, d, 3)."""
    corners = reference[cells[:, np.flatnonzero(element.slot == 0)[: len(element.cell.corners)]]]
    s, d = nodes_with_slopes(element), element.cell.dimension
    slopes = reference[cells[:, np.flatnonzero(element.slot > 0)]].reshape(len(cells), s, d, 3)
    return corners, slopes


def _tetrahedra(
    element: Element, cells: NDArray[np.int32], reference: Floats, **_: object
) -> tet3413.Tetrahedra:
    return tet3413.tetrahedra(cells, reference)


SOLID = KernelSet("solid", _any_cells, point_solid.make_kernels)
RING = KernelSet("ring", _rings, point_ring.make_kernels)
BEAM = KernelSet("beam", _any_cells, point_beam.make_kernels)
FAST = {"3413": KernelSet("tet3413", _tetrahedra, tet3413.make_kernels, tet3413.force_of_all)}


def kernel_set(element: Element, *, axisymmetric: bool = False) -> KernelSet:
    """The kernels of an element, in a body of revolution where it is axisymmetric."""
    if axisymmetric:
        return RING
    return BEAM if element.is_beam else FAST.get(element.code, SOLID)
