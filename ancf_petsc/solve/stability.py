"""Why a load path ends: whether the tangent lost definiteness, where, at what stretch, and what to do."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ancf_petsc.material.models import LAWS
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.events import CriticalPoint
from ancf_petsc.solve.linear.solver import negative_pivots_of
from ancf_petsc.solve.newton import Newton

NEAR_SOFTEST = 0.1
"""Added to the stretch at which a law is softest: a weakest element below is taken for the reason."""
CRUSHED = 0.1
"""Of det F: no law here was measured there."""
PAST_A_LIMIT = 'a displacement in place of the force, or statics.control = "arc_length", goes past it'
LARGEST_TO_FACTOR = 300_000
ALIKE = 1e-6
"""Stretches of cells that differ by less, relatively, are taken as equal: rounding depends on the number of ranks."""


def weakest_cell(assembly: Assembly, x: PETSc.Vec) -> tuple[float, float, int, np.ndarray, str]:
    """Smallest principal stretch of all cells, with det F, the cell's number, its undeformed centroid, its law.

    Of cells that are stretched alike, the one with the lowest number, whatever the number of ranks. Collective.
    """
    model = assembly.model
    stretch, det = _stretches(assembly, x)
    least = combined(assembly.comm, float(stretch.min(initial=np.inf)), MPI.MIN)
    alike = np.flatnonzero(stretch <= least * (1.0 + ALIKE))
    found = (np.inf, 0.0, np.iinfo(np.int64).max, np.zeros(3), "")
    if len(alike):
        e = int(alike[np.argmin(model.cell_numbers[alike])])
        law = next(region.law.name for region in model.regions if region.first <= e < region.last)
        centroid = model.origin + model.reference[model.position_cells()[e]].mean(axis=0)
        found = (float(stretch[e]), float(det[e]), int(model.cell_numbers[e]), centroid, law)
    return min(assembly.comm.allgather(found), key=lambda item: item[2])


def beyond_the_law(assembly: Assembly, x: PETSc.Vec) -> str | None:
    """What makes a state doubtful though it is in equilibrium: elements beyond the limit of svk, or crushed; None where
    nothing does. Collective.
    """
    model, comm = assembly.model, assembly.comm
    stretch, det = _stretches(assembly, x)
    own, weak = model.numbering.own_cells, np.zeros(len(det), bool)
    for region in model.regions:
        if region.law.softest is not None:
            weak[region.first : region.last] = stretch[region.first : region.last] < region.law.softest
    counts = np.array([(weak & own).sum(), ((det < CRUSHED) & own).sum(), own.sum()])
    beyond, crushed, total = combined(comm, counts)
    if not beyond and not crushed:
        return None
    smallest, volume, cell, centroid, law = weakest_cell(assembly, x)
    place = ", ".join(f"{c:.6g}" for c in centroid)
    worst = f"element {cell} at ({place}) has a stretch of {smallest:.3f}, det F {volume:.3f}"
    if beyond:
        return (
            f"{beyond} of {total} elements are pressed so far that {law} carries the less the more they are pressed: {worst}; "
            f"forces depend on the mesh there: {_laws_without_limit()} has no such limit"
        )
    return f"{crushed} of {total} elements are crushed below {CRUSHED:g} of their volume: {worst}; take a finer mesh there"


def _stretches(assembly: Assembly, x: PETSc.Vec) -> tuple[np.ndarray, np.ndarray]:
    """Smallest principal stretch and det F (e,) of this rank's cells."""
    strain, _, det = assembly.fields(x)
    squares = np.linalg.eigvalsh(2 * strain.reshape(-1, 3, 3) + np.eye(3))[:, 0]
    return np.sqrt(np.maximum(squares, 0.0)), det


def why_it_ends(
    newton: Newton,
    x: PETSc.Vec,
    s: float,
    reason: str,
    smallest_step: float,
    limit: CriticalPoint | None = None,
) -> str:
    """One line for the user. Collective."""
    assembly = newton.assembly
    stretch, det, cell, centroid, law = weakest_cell(assembly, x)
    pivots = None
    if limit is None and assembly.model.dof <= LARGEST_TO_FACTOR:
        assembly.tangent(x, newton.matrix)
        pivots = negative_pivots_of(newton.matrix.mat)
    place = ", ".join(f"{c:.6g}" for c in centroid)
    line = (
        f"no equilibrium beyond pseudo-time {s:.6g}: steps of {smallest_step:g} still fail ({reason}); "
        f"{limit.words() if limit else _definiteness(pivots)}; "
        f"weakest element {cell} at ({place}): smallest stretch {stretch:.3f}, det F {det:.3f}"
    )
    return f"{line}; {_cure(law, stretch, pivots, limit)}"


def _definiteness(pivots: int | None) -> str:
    if pivots is None:
        return "the tangent could not be factored"
    if pivots:
        return f"the tangent at the last state has lost definiteness ({pivots} negative pivots)"
    return "the tangent at the last state is still positive definite"


def _laws_without_limit() -> str:
    return "law = " + " or ".join(f'"{law.name}"' for law in LAWS.values() if law.softest is None)


def _cure(law: str, stretch: float, pivots: int | None, limit: CriticalPoint | None) -> str:
    softest = LAWS[law].softest
    if softest is not None and stretch < softest + NEAR_SOFTEST:
        return (
            f"{law} carries no more force below a stretch of {softest:.3f}: the path ends here whatever the "
            f"step size, and sooner on finer meshes; {_laws_without_limit()} goes on"
        )
    if limit is not None:
        return PAST_A_LIMIT
    if pivots:
        return "the body buckles or folds here: smaller loads, other supports, or damped dynamics go past it"
    return "try a smaller statics.smallest_step, a smoother ramp or a finer mesh where elements are crushed"
