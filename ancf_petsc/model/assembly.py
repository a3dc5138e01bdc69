"""Forces, energies and tangents of a model at states x, PETSc vectors of the owned nodal vectors.

Rows are complete where they are owned, so only ghost positions travel.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.algebra.graph import neighbours
from ancf_petsc.kernel.interface import Means
from ancf_petsc.model.matrix import Layout, Matrix
from ancf_petsc.model.model import Model
from ancf_petsc.parallel.exchange import combined


class Assembly:
    """Evaluates a model at states x, PETSc vectors of the owned nodal vectors.

    start (n, 3): the undeformed state. States, forces and directions have the components of unknowns, see `model/frames`; what
    `local` and `along_axes` give has those along the axes.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.comm = model.comm
        n = model.owned
        self._positions = model.reference.copy()
        self._second = model.reference.copy()
        self._force = np.zeros_like(model.reference)
        self.start = model.frames.to_frames(model.reference[:n].copy())
        self.driven = np.flatnonzero(model.drive[:n] >= 0)
        self.driven_by = model.drive[:n].ravel()[self.driven]
        self._ghosts = self._ghost_scatter()

    # --- vectors

    def vector(self) -> PETSc.Vec:
        """A new vector of the owned nodal vectors, zero."""
        return PETSc.Vec().createMPI((3 * self.model.owned, None), bsize=3, comm=self.comm)

    def reference_vector(self) -> PETSc.Vec:
        """The undeformed state."""
        x = self.vector()
        x.array[:] = self.start.ravel()
        return x

    def along_axes(self, field: NDArray) -> NDArray[np.float64]:
        """A field (n, 3) of unknowns on owned nodal vectors with components along the axes; itself where there are no frames."""
        return self.model.frames.to_axes(field.copy()) if self.model.frames else field

    def local(self, x: PETSc.Vec, into: NDArray | None = None) -> NDArray:
        """Values (v, 3) of x at owned nodal vectors and ghosts, along the axes; valid until the next call with the same `into`."""
        return self.model.frames.to_axes(self.spread(x, self._positions if into is None else into))

    def spread(self, x: PETSc.Vec, values: NDArray) -> NDArray:
        """Values (v, 3) of x at owned nodal vectors and ghosts, as they are. Collective."""
        values[: self.model.owned] = x.array_r.reshape(-1, 3)
        if self._ghosts is not None:
            scatter, ghosts, _ = self._ghosts
            scatter.scatter(x, ghosts, addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)
            values[self.model.owned :] = ghosts.array_r.reshape(-1, 3)
        return values

    def with_ghosts(self, field: NDArray, into: NDArray) -> NDArray:
        """A field (n, 3) on owned nodal vectors with its values at ghosts, in `into` (v, 3). Collective."""
        if self._ghosts is None:
            into[:] = field
            return into
        self._ghosts[2].array[:] = field.ravel()
        return self.spread(self._ghosts[2], into)

    def set_driven(self, x: PETSc.Vec, s: float) -> None:
        """Put the driven degrees of freedom of x where they belong at pseudo-time s."""
        values = np.array([drive.value(s) for drive in self.model.drives] or [0.0])
        x.array[self.driven] = self.start.ravel()[self.driven] + values[self.driven_by]

    def external_force(self, s: float) -> NDArray:
        """Dead loads on the owned nodal vectors (n, 3) at pseudo-time s."""
        total = np.zeros((self.model.owned, 3))
        for load in self.model.loads:
            total += load.ramp.value(s) * load.pattern
        return total

    @cached_property
    def graph(self) -> tuple[NDArray, NDArray]:
        """Pointers (n + 1,) and columns of the owned nodal vectors that share a cell with each: owned ones, then ghosts."""
        return neighbours(self.model.cells, len(self.model.reference), self.model.owned)

    # --- forces and energies

    def internal_force(self, x: PETSc.Vec) -> tuple[NDArray, float]:
        """Q (n, 3) of the owned nodal vectors, valid until the next call, and the smallest det F of this rank's cells."""
        positions, force = self.local(x), self._force
        force[:] = 0.0
        smallest = np.inf
        for region in self.model.regions:
            found = region.kernels.internal_force(
                (positions,), self.model.tables, region.parameters, region.cells, force
            )
            smallest = min(smallest, found)
        return self.model.frames.to_frames(force[: self.model.owned]), smallest

    def mean_force(self, x0: PETSc.Vec, x1: PETSc.Vec) -> tuple[NDArray, float]:
        """Forces (n, 3) between two states whose work is exactly the growth of the energy, and the smallest det F1."""
        states = self._two_states(x0, x1)
        force = self._force
        force[:] = 0.0
        smallest = np.inf
        for region in self.model.regions:
            assert region.kernels.mean_force is not None
            found = region.kernels.mean_force(
                states, self.model.tables, region.parameters, region.cells, force
            )
            smallest = min(smallest, found)
        return self.model.frames.to_frames(force[: self.model.owned]), smallest

    def _two_states(self, x0: PETSc.Vec, x1: PETSc.Vec) -> tuple[NDArray, NDArray]:
        return self.local(x0, into=self._second), self.local(x1)

    def smallest_det(self, x: PETSc.Vec) -> float:
        """Smallest det F over all cells."""
        return combined(self.comm, self.internal_force(x)[1], MPI.MIN)

    def strain_energy(self, x: PETSc.Vec) -> float:
        """Strain energy of the whole body."""
        positions = self.local(x)
        own = [
            region.kernels.energy((positions,), self.model.tables, region.parameters, region.own_cells)
            for region in self.model.regions
        ]
        return combined(self.comm, sum(own))

    def tangent_product(self, x: PETSc.Vec, direction: PETSc.Vec) -> NDArray:
        """The tangent at x times a direction: (n, 3) on owned nodal vectors, driven rows and columns included."""
        positions = self.local(x)
        fields = (positions, self.local(direction, into=np.empty_like(positions)))
        force = np.zeros_like(positions)
        for region in self.model.regions:
            region.kernels.tangent_product(fields, self.model.tables, region.parameters, region.cells, force)
        return self.model.frames.to_frames(force[: self.model.owned])

    def fields(self, x: PETSc.Vec) -> Means:
        """Green-Lagrange strain (e, 9), Cauchy stress (e, 9) and det F (e,) of this rank's cells."""
        positions, e = self.local(x), len(self.model.cells)
        means = Means(np.empty((e, 9)), np.empty((e, 9)), np.empty(e))
        for region in self.model.regions:
            region.kernels.fields((positions,), self.model.tables, region.parameters, region.cells, means)
        return means

    # --- matrices

    @cached_property
    def layout(self) -> Layout:
        """Where the numbers of this body's matrices lie."""
        return Layout(self.model, self.graph)

    def create_matrix(self, *, symmetric: bool = True) -> Matrix:
        """A matrix for tangents and masses, zero."""
        return Matrix(self.layout, symmetric=symmetric)

    def tangent(self, x: PETSc.Vec, matrix: Matrix) -> None:
        """Make the matrix the tangent at x. Collective."""
        matrix.clear()
        self.add_tangent(x, matrix)
        matrix.finish()

    def add_tangent(self, x: PETSc.Vec, matrix: Matrix) -> None:
        """Add the tangent at x to a matrix that is not finished yet. Collective."""
        positions = self.local(x)
        for region in self.model.regions:
            region.kernels.tangent(
                (positions,), self.model.tables, region.parameters, region.cells, matrix.target
            )

    def add_mean_tangent(self, x0: PETSc.Vec, x1: PETSc.Vec, matrix: Matrix) -> None:
        """Add the derivative of `mean_force` with respect to x1 to a matrix that is not finished yet. Collective."""
        states = self._two_states(x0, x1)
        for region in self.model.regions:
            assert region.kernels.mean_tangent is not None
            region.kernels.mean_tangent(
                states, self.model.tables, region.parameters, region.cells, matrix.target
            )

    # --- ghosts

    def _ghost_scatter(self):
        """PETSc's scatter to the ghosts, the vector it fills and one to fill it from; None on one rank."""
        if self.comm.size == 1:
            return None
        numbers = self.model.ghost_numbers.astype(PETSc.IntType)
        ghosts = PETSc.Vec().createSeq(3 * len(numbers), bsize=3, comm=PETSc.COMM_SELF)
        source = PETSc.IS().createBlock(3, numbers, comm=PETSc.COMM_SELF)
        x = self.vector()
        scatter = PETSc.Scatter().create(x, source, ghosts, None)
        return scatter, ghosts, x
