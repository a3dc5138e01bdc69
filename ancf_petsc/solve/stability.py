"""Why a load path ends: whether the tangent lost definiteness, where, at what stretch, and what to do."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from ancf_petsc.errors import NoEquilibrium
from ancf_petsc.material.limits import uniaxial_limit
from ancf_petsc.material.models import LAWS
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.cause import Cause, cause_of, flattened
from ancf_petsc.solve.critical import Watch
from ancf_petsc.solve.events import CriticalPoint
from ancf_petsc.solve.linear.solver import negative_pivots_of
from ancf_petsc.solve.newton import Newton
from ancf_petsc.solve.weakest import stretches, weakest_cell

CRUSHED = 0.1
"""Of det F: no law here was measured there."""
DYNAMICS = 'statics.after_limit = "dynamics"'
PAST_A_LIMIT = (
    f'a displacement in place of the force, statics.control = "arc_length" or {DYNAMICS} goes past it'
)
LOST = 0.05
"""Of the largest lowest eigenvalue: a path that ends where it is smaller ends because of it."""
FLAT = 0.02
"""Of det F at a quadrature point."""
FAR, FURTHER = 0.05, 0.1
"""How much pseudo-time, at most, and which part of that passed, shorter steps have to gain: the step was too long then."""
LARGEST_TO_FACTOR = 300_000


def beyond_the_law(assembly: Assembly, x: PETSc.Vec) -> str | None:
    """What makes a state doubtful though it is in equilibrium: elements beyond the limit of svk, or crushed; None where
    nothing does. Collective.
    """
    model, comm = assembly.model, assembly.comm
    stretch, det = stretches(assembly, x)
    own, weak = model.numbering.own_cells, np.zeros(len(det), bool)
    for region in model.regions:
        limit = uniaxial_limit(region.law, region.parameters) if not model.element.is_beam else None
        if limit is not None:
            weak[region.first : region.last] = stretch[region.first : region.last] < limit
    counts = np.array([(weak & own).sum(), ((det < CRUSHED) & own).sum(), own.sum()])
    beyond, crushed, total = combined(comm, counts)
    if not beyond and not crushed:
        return None
    weakest = weakest_cell(assembly, x)
    if beyond:
        return (
            f"{beyond} of {total} elements are pressed so far that {weakest.law} carries the less the more they are pressed, "
            f"{weakest.words()}; "
            f"forces depend on the mesh there: {_laws_without_limit(weakest.law)} has no such limit"
        )
    return f"{crushed} of {total} elements are crushed below {CRUSHED:g} of their volume, {weakest.words()}; take a finer mesh"


@dataclass(frozen=True)
class Last:
    """The last state of a path, and what was tried from there.

    s, x: the state. reason: why Newton's method failed. step: the shortest one allowed. tried: pseudo-time that was aimed at.
    beyond: pseudo-time and state that shorter steps than allowed led to, the same where none did. limit: the critical point it
    runs into.
    """

    s: float
    x: PETSc.Vec
    reason: str
    step: float
    tried: float
    beyond: tuple[float, PETSc.Vec]
    limit: CriticalPoint | None = None


def why_it_ends(newton: Newton, watch: Watch, last: Last) -> NoEquilibrium:
    """The error to raise: it names the event that ends the path. Collective."""
    weakest = weakest_cell(newton.assembly, last.x)
    cause, lost = _cause(newton, watch, last)
    found = "; ".join(filter(None, (cause.words(), lost)))
    line = (
        f"no equilibrium beyond pseudo-time {last.s:.6g}: steps of {last.step:g} still fail ({last.reason}); "
        f"{found}; weakest {weakest.words()}; {cure_of(cause, last)}"
    )
    facts = {"kind": cause.kind, "pseudo_time": last.s, **weakest.facts(), **cause.facts()}
    return NoEquilibrium(line, facts)


def _cause(newton: Newton, watch: Watch, last: Last) -> tuple[Cause, str]:
    """What ends the path, and what is known of the tangent, for the message."""
    s, x = last.beyond
    far = s - last.s > max(min(2.0 * last.step, FAR), FURTHER * last.s)
    if s >= last.tried or far:
        return Cause("step_too_long", more={"reached": s}), f"shorter ones lead on to pseudo-time {s:.6g}"
    newton.set_pseudo_time(s)
    value = watch.look_closely(x)
    pivots = None
    if newton.assembly.model.dof <= LARGEST_TO_FACTOR:
        pivots = negative_pivots_of(newton.matrix.mat)
    singular = bool(pivots) or last.limit is not None or value < LOST * watch.largest
    lost = last.limit.words() if last.limit else _definiteness(pivots, singular=singular)
    flat = flattened(newton.assembly, x, FLAT)
    if flat is not None and (flat.at_edge or not singular):
        return flat, lost
    cause = cause_of(newton.assembly, x, watch.lowest.mode if singular else None)
    if cause.kind == "lost_definiteness" and not singular:
        return Cause("step_too_long", more={"reached": s}), lost
    if cause.kind == "lost_definiteness" and last.limit and last.limit.kind == "limit point":
        return replace(cause, kind="limit_point"), lost
    return cause, lost


def _definiteness(pivots: int | None, *, singular: bool) -> str:
    if pivots:
        return f"the tangent at the last state has lost definiteness ({pivots} negative pivots)"
    if singular:
        return "the tangent at the last state is about to lose definiteness"
    if pivots is None:
        return "the tangent could not be factored"
    return "the tangent at the last state is still positive definite"


def cure_of(cause: Cause, last: Last) -> str:
    """What helps."""
    if cause.kind == "step_too_long":
        return f"take a statics.smallest_step below {last.step:g}, more statics.steps or a smoother ramp"
    if cause.kind == "material_limit":
        return (
            "the path ends here whatever the step size, and sooner on finer meshes; "
            f"{_laws_without_limit(cause.law)} goes on"
        )
    if cause.kind == "surface_fold":
        return (
            "the finer the mesh, the sooner and narrower the folds: what goes on is a larger radius at the place, "
            "a stroke that stays before, or a mesh that is coarse on purpose"
        )
    if cause.kind == "inverted_element":
        others = _laws_without_limit(cause.law)
        other = f"; {others} resists" if others else ""
        return f"round the edge or keep the mesh coarse there: the finer, the sooner{other}"
    if last.limit is not None:
        return PAST_A_LIMIT
    return f"the body buckles or folds here: smaller loads, other supports, or {DYNAMICS} goes past it"


def _laws_without_limit(present: str = "") -> str:
    """Other laws that carry more force the more they are pressed, as one writes them; "" where there is none."""
    example = {name: law.parameters(1.0, 0.3) for name, law in LAWS.items()}
    names = [name for name in LAWS if name != present and uniaxial_limit(LAWS[name], example[name]) is None]
    return "law = " + " or ".join(f'"{name}"' for name in names) if names else "another law"
