"""Why a load path ends: whether the tangent lost definiteness, where, at what stretch, and what to do."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from ancf_petsc.errors import NoEquilibrium
from ancf_petsc.material.models import LAWS
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.events import CriticalPoint
from ancf_petsc.solve.linear.solver import negative_pivots_of
from ancf_petsc.solve.newton import Newton
from ancf_petsc.solve.weakest import stretches, weakest_cell

NEAR_SOFTEST = 0.1
"""Added to the stretch at which a law is softest: a weakest element below is taken for the reason."""
CRUSHED = 0.1
"""Of det F: no law here was measured there."""
PAST_A_LIMIT = 'a displacement in place of the force, or statics.control = "arc_length", goes past it'
LARGEST_TO_FACTOR = 300_000


def beyond_the_law(assembly: Assembly, x: PETSc.Vec) -> str | None:
    """What makes a state doubtful though it is in equilibrium: elements beyond the limit of svk, or crushed; None where
    nothing does. Collective.
    """
    model, comm = assembly.model, assembly.comm
    stretch, det = stretches(assembly, x)
    own, weak = model.numbering.own_cells, np.zeros(len(det), bool)
    for region in model.regions:
        if region.law.softest is not None:
            weak[region.first : region.last] = stretch[region.first : region.last] < region.law.softest
    counts = np.array([(weak & own).sum(), ((det < CRUSHED) & own).sum(), own.sum()])
    beyond, crushed, total = combined(comm, counts)
    if not beyond and not crushed:
        return None
    weakest = weakest_cell(assembly, x)
    if beyond:
        return (
            f"{beyond} of {total} elements are pressed so far that {weakest.law} carries the less the more they are pressed, "
            f"{weakest.words()}; "
            f"forces depend on the mesh there: {_laws_without_limit()} has no such limit"
        )
    return f"{crushed} of {total} elements are crushed below {CRUSHED:g} of their volume, {weakest.words()}; take a finer mesh"


def why_it_ends(
    newton: Newton,
    x: PETSc.Vec,
    s: float,
    reason: str,
    smallest_step: float,
    limit: CriticalPoint | None = None,
) -> NoEquilibrium:
    """The error to raise. Collective."""
    assembly = newton.assembly
    weakest = weakest_cell(assembly, x)
    pivots = None
    if limit is None and assembly.model.dof <= LARGEST_TO_FACTOR:
        assembly.tangent(x, newton.matrix)
        pivots = negative_pivots_of(newton.matrix.mat)
    line = (
        f"no equilibrium beyond pseudo-time {s:.6g}: steps of {smallest_step:g} still fail ({reason}); "
        f"{limit.words() if limit else _definiteness(pivots)}; weakest {weakest.words()}"
    )
    kind = "limit_point" if limit else "lost_definiteness" if pivots else "step_too_long"
    facts = {"kind": kind, "pseudo_time": s, **weakest.facts()}
    return NoEquilibrium(f"{line}; {_cure(weakest.law, weakest.stretch, pivots, limit)}", facts)


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
