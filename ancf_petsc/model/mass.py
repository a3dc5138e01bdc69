"""The mass of the body: one number per pair of nodal vectors that share a cell, constant in time.

Consistent, m_ab = ∫ rho N_a N_b dV by the element's exact rule, or lumped: the diagonal scaled to the
whole mass, which for linear tetrahedra and bricks are the row sums.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.element.element import Element
from ancf_petsc.kernel.constant import MassCells, add_mass, mass_product
from ancf_petsc.kernel.revolution import linear
from ancf_petsc.kernel.tables import map_functions
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.body import Body
from ancf_petsc.model.matrix import Matrix
from ancf_petsc.parallel.exchange import combined

CHUNK = 1000
"""Cells whose mass matrices are looked at together."""


class Mass:
    """The mass matrix of an assembly's owned rows.

    values (nnz,): one number per entry of `assembly.graph`. diagonal (n,).
    """

    def __init__(self, assembly: Assembly, *, lumped: bool = False) -> None:
        self.assembly = assembly
        self.comm = assembly.comm
        self.lumped = lumped
        model, (pointers, columns) = assembly.model, assembly.graph
        self._slot = model.element.slot.astype(np.int32)
        self._shape = mean_products(model.element, model.measures.shape[1])
        self.values = np.zeros(len(columns))
        for region in model.regions:
            cell_mass = (region.density or 0.0) * model.measures
            cells = MassCells(model.cells, cell_mass, self._shape, self._slot, model.slope_maps)
            add_mass(cells, lumped, region.cells, (pointers, columns), self.values)
        rows = np.repeat(np.arange(model.owned), np.diff(pointers))
        self.diagonal = self.values[columns == rows]
        self._field = np.zeros_like(model.reference)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Within which the eigenvalues of the matrix over its diagonal lie, whatever is held: those of
        single cells (Wathen, IMA J. Numer. Anal. 7 (1987) 449). Collective.
        """
        model = self.assembly.model
        maps, row, measures = model.slope_maps, model.element, model.measures
        low, high = np.inf, 0.0
        alike = not maps.shape[1] and measures.shape[1] == 1
        cells = np.arange(min(len(maps), 1) if alike else len(maps))
        for chosen in np.array_split(cells, len(cells) // CHUNK + 1):
            chunk = maps[chosen]
            shape = np.einsum("em,mab->eab", measures[chosen], self._shape)
            half = np.stack([map_functions(shape[:, a], chunk, row) for a in range(row.functions)], axis=1)
            mass = np.stack([map_functions(half[:, :, b], chunk, row) for b in range(row.functions)], axis=2)
            scale = 1.0 / np.sqrt(np.einsum("eaa->ea", mass))
            values = np.linalg.eigvalsh(scale[:, :, None] * mass * scale[:, None, :])
            low, high = min(low, values.min(initial=np.inf)), max(high, values.max(initial=0.0))
        return combined(self.comm, low, MPI.MIN), combined(self.comm, high, MPI.MAX)

    def times(self, field: NDArray, into: NDArray | None = None) -> NDArray[np.float64]:
        """Mass times a field (n, 3) of unknowns on owned nodal vectors; driven ones are no exception. Collective."""
        frames = self.assembly.model.frames
        result = np.empty((self.assembly.model.owned, 3)) if into is None else into
        local = frames.to_axes(self.assembly.with_ghosts(field, self._field))
        mass_product(*self.assembly.graph, self.values, local, result)
        return frames.to_frames(result)

    def add_to(self, matrix: Matrix, factor: float = 1.0) -> None:
        """Add factor times the mass to a matrix that is not finished yet."""
        matrix.add_mass(self.values, factor)

    def kinetic_energy(self, velocity: NDArray) -> float:
        """Kinetic energy of the whole body. Collective."""
        return combined(self.comm, 0.5 * float(np.vdot(velocity, self.times(velocity))))

    def momenta(self, x: PETSc.Vec, velocity: NDArray) -> tuple[NDArray, NDArray]:
        """Linear and angular momentum (3,), the latter about the file's origin. Collective.

        Around a body of revolution all but the linear one along the axis cancels.
        """
        carried = self.assembly.along_axes(self.times(velocity))
        linear = carried[self.assembly.model.own_positions].sum(axis=0)
        moments = self.assembly.along_axes(x.array_r.reshape(-1, 3)).T @ carried
        angular = np.array([moments[i, j] - moments[j, i] for i, j in ((1, 2), (2, 0), (0, 1))])
        both = combined(self.comm, np.concatenate((linear, angular)))
        revolution = self.assembly.model.revolution
        if revolution is not None:
            return np.where(np.arange(3) == revolution.axis, both[:3], 0.0), np.zeros(3)
        return both[:3], both[3:] + np.cross(self.assembly.model.origin, both[:3])

    def centre(self) -> NDArray[np.float64]:
        """Centre of mass (3,) of the undeformed body, in the file's coordinates. Collective."""
        model = self.assembly.model
        uniform = np.zeros((model.owned, 3))
        uniform[model.own_positions] = 1.0
        share = self.assembly.along_axes(self.times(model.frames.to_frames(uniform)))[:, 0]
        moment = share @ model.reference[: model.owned]
        total = share[model.own_positions].sum()
        sums = combined(self.comm, np.append(moment, total))
        return model.origin + sums[:3] / sums[3]


def mean_products(element: Element, terms: int = 1) -> NDArray[np.float64]:
    """Means of N_a N_b times 1, xi_1, .. over the reference cell (m, a, b), exact; terms: how many m."""
    tables = element.tables("mass")
    weights = tables.weights / tables.weights.sum()
    factors = weights[:, None] * linear(tables.points)[:, :terms]
    return np.einsum("qm,qa,qb->mab", factors, tables.values, tables.values)


def lumped_masses(body: Body) -> NDArray[np.float64]:
    """Part of the volume of each cell that a lumped mass gives to its nodal vectors (e, a), 0 for slopes."""
    diagonals = np.einsum("maa->ma", mean_products(body.element, body.measures.shape[1]))
    shares = body.measures @ np.where(body.element.slot == 0, diagonals, 0.0)
    return shares * (body.volumes / shares.sum(axis=1))[:, None]


def uniform_masses(body: Body) -> NDArray[np.float64]:
    """Integrals of the functions of the nodal vectors over each cell (e, a): what a uniform acceleration pulls at."""
    tables, terms = body.element.tables("mass"), body.measures.shape[1]
    weights = tables.weights / tables.weights.sum()
    means = (weights[:, None] * linear(tables.points)[:, :terms]).T @ tables.values
    return body.mapped(body.measures @ means)
