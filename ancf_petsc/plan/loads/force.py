"""A dead force, spread over a group by the shape functions."""

from __future__ import annotations

import numpy as np

from ancf_petsc.input.loads import ForceSpec
from ancf_petsc.mesh.groups import parts_for_load
from ancf_petsc.model.body import Body, Floats
from ancf_petsc.model.load import Load
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.plan.part import Part


def enter(spec: ForceSpec, part: Part, key: str) -> Floats:
    """Share (v,) of each nodal vector in the force."""
    group = part.group(spec.group, f"{key}.group")
    return part.space.shares(*parts_for_load(part.mesh, group))


def share(spec: ForceSpec, body: Body, entered: Floats | None, ramp: Ramp) -> Load:
    """Its shares of the total."""
    assert entered is not None
    return Load(np.outer(entered, spec.total), ramp)
