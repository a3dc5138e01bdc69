"""The most compressed element of a state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined

ALIKE = 1e-6
"""Stretches of cells that differ by less, relatively, are taken as equal: rounding depends on the number of ranks."""


@dataclass(frozen=True)
class WeakestCell:
    """stretch: the smallest principal one of the cell's mean strain, with the mean det F. cell: its number in the mesh file.
    place (3,): its undeformed centroid. law: of its material.
    """

    stretch: float
    det: float
    cell: int
    place: np.ndarray
    law: str

    def words(self) -> str:
        """For a message."""
        place = ", ".join(f"{c:.6g}" for c in self.place)
        return f"element {self.cell} at ({place}): smallest stretch {self.stretch:.3f}, det F {self.det:.3f}"

    def facts(self) -> dict[str, Any]:
        """For the summary."""
        return {
            "smallest_stretch": self.stretch,
            "det_F": self.det,
            "element": self.cell,
            "place": list(map(float, self.place)),
        }


def stretches(assembly: Assembly, x: PETSc.Vec) -> tuple[np.ndarray, np.ndarray]:
    """Smallest principal stretch and det F (e,) of this rank's cells, of their mean strains."""
    strain, _, det = assembly.fields(x)
    squares = np.linalg.eigvalsh(2 * strain.reshape(-1, 3, 3) + np.eye(3))[:, 0]
    return np.sqrt(np.maximum(squares, 0.0)), det


def weakest_cell(assembly: Assembly, x: PETSc.Vec) -> WeakestCell:
    """The cell of smallest principal stretch. Of cells that are stretched alike, the one with the lowest number, whatever the
    number of ranks. Collective.
    """
    model = assembly.model
    stretch, det = stretches(assembly, x)
    least = combined(assembly.comm, float(stretch.min(initial=np.inf)), MPI.MIN)
    alike = np.flatnonzero(stretch <= least * (1.0 + ALIKE))
    found = WeakestCell(np.inf, 0.0, np.iinfo(np.int64).max, np.zeros(3), "")
    if len(alike):
        e = int(alike[np.argmin(model.cell_numbers[alike])])
        law = next(region.law.name for region in model.regions if region.first <= e < region.last)
        centroid = model.origin + model.reference[model.position_cells()[e]].mean(axis=0)
        found = WeakestCell(float(stretch[e]), float(det[e]), int(model.cell_numbers[e]), centroid, law)
    return min(assembly.comm.allgather(found), key=lambda item: item.cell)
