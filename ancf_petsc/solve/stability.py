"""Why a load path ends: whether the tangent lost definiteness, where, at what stretch, and what to do."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from ancf_petsc.material.models import LAWS
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.solve.linear.solver import negative_pivots_of
from ancf_petsc.solve.newton import Newton

NEAR_SOFTEST = 0.1
"""Added to the stretch at which a law is softest: a weakest element below is taken for the reason."""
LARGEST_TO_FACTOR = 300_000


def weakest_cell(assembly: Assembly, x: PETSc.Vec) -> tuple[float, float, int, np.ndarray, str]:
    """Smallest principal stretch of all cells, with det F, the cell's number, its undeformed centroid, its law."""
    model = assembly.model
    strain, _, det = assembly.fields(x)
    stretch = np.sqrt(np.maximum(np.linalg.eigvalsh(2 * strain.reshape(-1, 3, 3) + np.eye(3))[:, 0], 0.0))
    found = (np.inf, 0.0, -1, np.zeros(3), "")
    if len(stretch):
        e = int(np.argmin(stretch))
        law = next(region.law.name for region in model.regions if region.first <= e < region.last)
        centroid = model.reference[model.position_cells()[e]].mean(axis=0)
        found = (float(stretch[e]), float(det[e]), int(model.cell_numbers[e]), centroid, law)
    return min(assembly.comm.allgather(found), key=lambda item: item[0])


def why_it_ends(newton: Newton, x: PETSc.Vec, s: float, reason: str, smallest_step: float) -> str:
    """One line for the user. Collective."""
    assembly = newton.assembly
    stretch, det, cell, centroid, law = weakest_cell(assembly, x)
    pivots = None
    if assembly.model.dof <= LARGEST_TO_FACTOR:
        assembly.tangent(x, newton.matrix)
        pivots = negative_pivots_of(newton.matrix.mat)
    place = ", ".join(f"{c:.6g}" for c in centroid)
    line = (
        f"no equilibrium beyond pseudo-time {s:.6g}: steps of {smallest_step:g} still fail ({reason}); "
        f"{_definiteness(pivots)}; "
        f"weakest element {cell} at ({place}): smallest stretch {stretch:.3f}, det F {det:.3f}"
    )
    return f"{line}; {_cure(law, stretch, pivots)}"


def _definiteness(pivots: int | None) -> str:
    if pivots is None:
        return "the tangent could not be factored"
    if pivots:
        return f"the tangent at the last state has lost definiteness ({pivots} negative pivots)"
    return "the tangent at the last state is still positive definite"


def _cure(law: str, stretch: float, pivots: int | None) -> str:
    softest = LAWS[law].softest
    if softest is not None and stretch < softest + NEAR_SOFTEST:
        others = " or ".join(f'"{other.name}"' for other in LAWS.values() if other.softest is None)
        return (
            f"{law} carries no more force below a stretch of {softest:.3f}: the path ends here whatever the "
            f"step size, and sooner on finer meshes; law = {others} goes on"
        )
    if pivots:
        return "the body buckles or folds here: smaller loads, other supports, or damped dynamics go past it"
    return "try a smaller statics.smallest_step, a smoother ramp or a finer mesh where elements are crushed"
