"""The mass of the body: one number per pair of nodal vectors that share a cell, constant in time.

Consistent, m_ab = ∫ rho N_a N_b dV by the element's exact rule, or lumped: the row sums on the diagonal.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.element.element import Element
from ancf_petsc.kernel.constant import add_mass, mass_product
from ancf_petsc.system.assembly import Assembly


class Mass:
    """The mass matrix of an assembly's owned rows.

    values (nnz,): one number per entry of `assembly.graph`. diagonal (n,). bounds: within which the eigenvalues of the matrix
    over its diagonal lie, whatever is held: those of one cell (Wathen, IMA J. Numer. Anal. 7 (1987) 449).
    """

    def __init__(self, assembly: Assembly, element: Element, *, lumped: bool = False) -> None:
        self.assembly = assembly
        self.comm = assembly.comm
        self.lumped = lumped
        model, (pointers, columns) = assembly.model, assembly.graph
        tables = element.tables("mass")
        weights = tables.weights / tables.weights.sum()
        shape = np.einsum("q,qa,qb->ab", weights, tables.values, tables.values)
        shape = np.diag(shape.sum(axis=1)) if lumped else shape
        self.values = np.zeros(len(columns))
        for region in model.regions:
            cell_mass = (region.density or 0.0) * model.volumes
            add_mass(model.cells, cell_mass, shape, region.first, region.last, pointers, columns, self.values)
        rows = np.repeat(np.arange(model.owned), np.diff(pointers))
        self.diagonal = self.values[columns == rows]
        scale = 1.0 / np.sqrt(np.diag(shape))
        eigenvalues = np.linalg.eigvalsh(scale[:, None] * shape * scale)
        self.bounds = (float(eigenvalues[0]), float(eigenvalues[-1]))
        self._field = np.zeros_like(model.reference)

    def times(self, field: NDArray, into: NDArray | None = None) -> NDArray[np.float64]:
        """Mass times a field (n, 3) on owned nodal vectors; driven ones are no exception. Collective."""
        result = np.empty((self.assembly.model.owned, 3)) if into is None else into
        mass_product(*self.assembly.graph, self.values, self.assembly.with_ghosts(field, self._field), result)
        return result

    def add_to_matrix(self, factor: float) -> None:
        """Add factor times the mass to the matrix the assembly is filling."""
        self.assembly.add_mass(self.values, factor)

    def kinetic_energy(self, velocity: NDArray) -> float:
        """Kinetic energy of the whole body. Collective."""
        return self.comm.allreduce(0.5 * float(np.vdot(velocity, self.times(velocity))))

    def momenta(self, x: PETSc.Vec, velocity: NDArray) -> tuple[NDArray, NDArray]:
        """Linear and angular momentum (3,), the latter about the origin. Collective."""
        carried = self.times(velocity)
        linear = carried.sum(axis=0)
        angular = np.cross(x.array_r.reshape(-1, 3), carried).sum(axis=0)
        both = self.comm.allreduce(np.concatenate((linear, angular)), MPI.SUM)
        return both[:3], both[3:]

    def centre(self) -> NDArray[np.float64]:
        """Centre of mass (3,) of the undeformed body. Collective."""
        n = self.assembly.model.owned
        share = self.times(np.ones((n, 3)))[:, :1]
        sums = np.concatenate(((share * self.assembly.model.reference[:n]).sum(axis=0), share.sum(axis=0)))
        total = self.comm.allreduce(sums, MPI.SUM)
        return total[:3] / total[3]
