"""Dead forces and weight on the nodes of a plan: what CalculiX counts among the forces of a node, and we do not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.input.load import Case
from ancf_petsc.input.loads import ForceSpec, GravitySpec
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.plan.plan import Plan
from ancf_petsc.plan.ramps import Ramps

Floats = NDArray[np.float64]


def forces(case: Case, plan: Plan) -> tuple[Floats, list[Ramp]]:
    """Forces (n, 3, r) of the [[load]]s of type force on the nodes in use, by ramp, and the r ramps."""
    return _by_ramp(case, plan, ForceSpec)


def weight(case: Case, plan: Plan) -> tuple[Floats, list[Ramp]]:
    """Forces (n, 3, r) of gravity on the nodes in use, by ramp, and the r ramps."""
    return _by_ramp(case, plan, GravitySpec)


def _by_ramp(case: Case, plan: Plan, kind: type) -> tuple[Floats, list[Ramp]]:
    make = Ramps(case.spec, case.file)
    loads = [
        (number, load, make.of_load(load.ramp))
        for number, load in enumerate(case.spec.load)
        if isinstance(load, kind)
    ]
    ramps = list(dict.fromkeys(ramp for _, _, ramp in loads))
    total = np.zeros((plan.space.vectors, 3, len(ramps)))
    mass = nodal_mass(case, plan) if kind is GravitySpec and loads else None
    for number, load, ramp in loads:
        shares = plan.loads[number] if mass is None else mass
        total[:, :, ramps.index(ramp)] += np.outer(shares, load.vector)
    return total, ramps


def nodal_mass(case: Case, plan: Plan) -> Floats:
    """The mass (n,) of the nodes in use: each material's, shared by the shape functions."""
    d, section = plan.element.cell.dimension, case.spec.section
    corners = plan.mesh.cells[:, : len(plan.element.cell.corners)]
    thickness = (section.thickness or 1.0) if section else 1.0
    mass = np.zeros(plan.space.vectors)
    for number, material in enumerate(case.spec.material):
        cells = corners[plan.material == number]
        if len(cells) and material.density:
            amount = material.density * thickness * float(plan.space.sizes(d, cells).sum())
            mass += amount * plan.space.shares(d, cells)
    return mass


def on_group(loads: tuple[Floats, list[Ramp]], members: NDArray[np.bool_], s: float) -> Floats:
    """The force (3,) on the nodes of a group, members (n,), at the pseudo-time s."""
    values, ramps = loads
    return sum(
        (values[members, :, k].sum(axis=0) * ramp.value(s) for k, ramp in enumerate(ramps)), np.zeros(3)
    )
