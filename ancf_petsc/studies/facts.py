"""Sizes of a run that are known before it starts, and an estimate of what it will cost, to begin with the cheapest."""

from __future__ import annotations

from dataclasses import dataclass

from ancf_petsc.input.load import Case
from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.mesh.check import statistics
from ancf_petsc.plan.plan import make_plan

EXPLICIT = ("central_difference", "runge_kutta_4", "runge_kutta_5dp")
START = 1.0
"""Seconds of every run: Python, MPI, PETSc."""
FACTOR = 5e-7
"""Seconds of one Newton iteration, by dof**GROWTH: 0.2 to 0.3 s at 36,000 degrees of freedom of 3-10-1-3. Ratios between
runs matter; what is measured corrects the rest."""
GROWTH = 1.3
ITERATIONS = 4
EVALUATION = 2e-7
"""Seconds of one evaluation of forces by degree of freedom."""
UNKNOWN_STEPS = 20
"""Steps an interval of outputs, where a tolerance decides."""


@dataclass(frozen=True)
class Facts:
    """elements and dof of a run; h: mean size of its elements, (volume/elements)**(1/dimension); order: degree up to
    which its element's polynomials are complete.
    """

    elements: int
    dof: int
    h: float
    order: int


def facts_of(case: Case) -> Facts:
    """Of a case, from its mesh. Raises CaseError where the case cannot be planned on its mesh."""
    plan = make_plan(case)
    mesh = statistics(plan.mesh)
    return Facts(
        elements=mesh.cells,
        dof=plan.element.components * plan.space.vectors,
        h=(mesh.volume / mesh.cells) ** (1.0 / mesh.dimension),
        order=plan.element.complete,
    )


def step_count(spec: CaseSpec) -> float:
    """Steps of time or load that a run will take, about."""
    statics, dynamics = spec.statics, spec.dynamics
    if statics is not None:
        return statics.steps or len(statics.times or statics.strokes or (1,))
    assert dynamics is not None
    if dynamics.step is not None:
        return max(dynamics.duration / dynamics.step, dynamics.outputs)
    tightness = (1e-6 / (dynamics.tolerance or 1e-6)) ** 0.2
    return UNKNOWN_STEPS * tightness * dynamics.outputs


def estimate(spec: CaseSpec, facts: Facts) -> float:
    """Seconds that a run may take, to compare runs by."""
    steps = step_count(spec)
    if spec.dynamics is not None and spec.dynamics.integrator in EXPLICIT:
        return START + steps * EVALUATION * facts.dof
    return START + steps * ITERATIONS * FACTOR * facts.dof**GROWTH
