"""Frequencies and shapes of small vibrations about a state, by SLEPc: K phi = omega^2 M phi."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc
from slepc4py import SLEPc

from ancf_petsc.errors import AncfError
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.mass import Mass
from ancf_petsc.model.matrix import Matrix
from ancf_petsc.solve.petsc import direct_package

TOLERANCE = 1e-10


@dataclass(frozen=True)
class Modes:
    """omega_squared (m,) ascending, negative where the state is unstable; shapes (m, n, 3), of mass 1, on
    owned nodal vectors. scale: largest stiffness over largest mass, what a small omega squared is small against.
    """

    omega_squared: NDArray[np.float64]
    shapes: NDArray[np.float64]
    scale: float

    @property
    def frequencies(self) -> NDArray[np.float64]:
        """Cycles per unit of time (m,); 0 where omega squared is not positive."""
        return np.sqrt(np.maximum(self.omega_squared, 0.0)) / (2 * np.pi)


def modes_at(assembly: Assembly, mass: Mass, x: PETSc.Vec, count: int) -> Modes:
    """The `count` modes of lowest omega squared of the tangent at x, driven degrees of freedom held.
    Collective.

    Driven degrees of freedom have stiffness but no mass: their eigenvalues are infinite and never seen. The
    inverse is taken at a shift below zero, about the lowest omega squared of the body's size (stiffness over mass,
    over the number of nodes squared), so that rigid motions do no harm.
    """
    stiffness = assembly.create_matrix()
    assembly.tangent(x, stiffness)
    inertia = assembly.create_matrix()
    mass.add_to(inertia)
    inertia.close()
    scale = _scale(stiffness, mass)
    free = assembly.comm.allreduce(int((assembly.model.drive[: assembly.model.owned] < 0).sum()))
    solver = _solver(
        stiffness, inertia, min(count, free), -1e-3 * scale / (assembly.model.dof / 3) ** (4 / 3)
    )
    try:
        solver.solve()
        found = solver.getConverged()
        if found < min(count, free):
            raise AncfError(
                f"only {found} of {count} modes were found: ask for fewer, or look at the material"
            )
        return _collect(solver, assembly, min(count, free), scale)
    finally:
        for item in (solver, inertia, stiffness):
            item.destroy()


def _scale(stiffness: Matrix, mass: Mass) -> float:
    """Largest stiffness over largest mass. Collective."""
    heaviest = max(mass.comm.allgather(float(mass.diagonal.max(initial=0.0))))
    return stiffness.largest_diagonal / heaviest


def _solver(stiffness: Matrix, inertia: Matrix, count: int, shift: float) -> SLEPc.EPS:
    solver = SLEPc.EPS().create(stiffness.comm)
    solver.setOptionsPrefix("modes_")
    solver.setOperators(stiffness.mat, inertia.mat)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(nev=count)
    solver.setTolerances(TOLERANCE, 500)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(shift)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    ksp = transform.getKSP()
    ksp.setType(PETSc.KSP.Type.PREONLY)
    ksp.getPC().setType(PETSc.PC.Type.CHOLESKY)
    ksp.getPC().setFactorSolverType(direct_package("modes_st_"))
    solver.setFromOptions()
    return solver


def _collect(solver: SLEPc.EPS, assembly: Assembly, count: int, scale: float) -> Modes:
    values, shapes = np.empty(count), np.empty((count, assembly.model.owned, 3))
    shape = assembly.vector()
    for k in range(count):
        values[k] = solver.getEigenpair(k, shape).real
        shapes[k] = shape.array_r.reshape(-1, 3)
    shape.destroy()
    order = np.argsort(values, kind="stable")
    return Modes(values[order], shapes[order], scale)
