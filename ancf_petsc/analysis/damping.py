"""The damping alpha of a case: a number, or critical for a mode: alpha = 4 pi / T, Olshevskiy et al.
(2017), Eq. (16).
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt

from petsc4py import PETSc

from ancf_petsc.errors import CaseError, NoEquilibrium
from ancf_petsc.input.load import Case
from ancf_petsc.input.schema import CriticalMode
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.mass import Mass
from ancf_petsc.solve.events import CriticalPoint
from ancf_petsc.solve.rise import Rise, rising

log = logging.getLogger("ancf")
STATIC_TOLERANCE, SMALLEST_STEP = 1e-9, 1e-3
RIGID = 1e-9
"""Of the scale of omega squared: what is below is a rigid motion."""


@dataclass(frozen=True)
class Damping:
    """alpha in 1 / unit of time, and where it comes from, in words."""

    alpha: float
    source: str = ""


def damping_of(case: Case, assembly: Assembly, mass: Mass) -> Damping:
    """The damping the case asks for. Raises CaseError where there is no such mode. Collective."""
    asked = case.spec.dynamics.damping  # type: ignore[union-attr]
    if isinstance(asked, CriticalMode):
        x = assembly.reference_vector()
        number, state = asked.critical, "the unloaded body"
    elif asked == "critical":
        x = static_answer(case, assembly)
        number, state = 1, "the body under its loads at rest"
    else:
        return Damping(float(asked))
    from ancf_petsc.solve.modes import modes_at

    modes = modes_at(assembly, mass, x, number)
    x.destroy()
    if len(modes.omega_squared) < number or modes.omega_squared[number - 1] <= RIGID * modes.scale:
        raise _refused(case, f"mode {number} of {state} does not vibrate: it is a rigid motion or unstable")
    omega = sqrt(modes.omega_squared[number - 1])
    return Damping(2 * omega, f"= 4 pi / T, critical for mode {number} of {state}: T = {2 * pi / omega:.6g}")


def static_answer(
    case: Case,
    assembly: Assembly,
    on_event: Callable[[CriticalPoint, PETSc.Vec], None] = lambda event, x: log.warning("%s", event.words()),
) -> PETSc.Vec:
    """The body at rest under its loads and moves as they are at the end; on_event: told of critical points on the path
    there. Collective.
    """
    rise = Rise(rising(assembly.model, 1.0), STATIC_TOLERANCE)
    try:
        return rise.run([1.0], SMALLEST_STEP, on_event=on_event)
    except NoEquilibrium as error:
        raise _refused(case, f"there is no static answer to the loads ({error})") from error


def _refused(case: Case, why: str) -> CaseError:
    return CaseError(
        why,
        file=case.file,
        key="dynamics.damping",
        expected="a mode to damp critically",
        cure="give a number, or { critical = n } with a mode of the unloaded body that vibrates "
        "(ancf modes lists them)",
    )
