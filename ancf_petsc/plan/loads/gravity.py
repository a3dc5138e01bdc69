"""Weight: an acceleration on all mass."""

from __future__ import annotations

import numpy as np

from ancf_petsc.input.loads import GravitySpec
from ancf_petsc.model.body import Body, Floats
from ancf_petsc.model.load import Load
from ancf_petsc.model.mass import lumped_masses, uniform_masses
from ancf_petsc.model.ramp import Ramp
from ancf_petsc.plan.part import Part


def enter(spec: GravitySpec, part: Part, key: str) -> None:
    """Nothing: the mass is that of the body's cells."""


def share(spec: GravitySpec, body: Body, entered: Floats | None, ramp: Ramp) -> Load:
    """Mass times acceleration."""
    return Load(np.outer(nodal_mass(body, lumped=body.lumped), spec.acceleration), ramp, spec.acceleration)


def nodal_mass(body: Body, *, lumped: bool) -> Floats:
    """The mass that gravity pulls at (n,) of the owned nodal vectors: the mass matrix, `model/mass`, times a unit translation.

    That is ∫ rho N_a dV for the consistent matrix; with the lumped one its diagonal at positions and nothing at slopes, so
    that a free body falls as a whole with either.
    """
    density = np.empty(len(body.cells))
    for region in body.regions:
        density[region.first : region.last] = region.density or 0.0
    share = density[:, None] * (lumped_masses(body) if lumped else uniform_masses(body))
    sums = np.bincount(body.cells.ravel(), share.ravel(), minlength=len(body.reference))
    return sums[: body.owned].astype(float)
