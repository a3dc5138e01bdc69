"""The laws, each one block: energy psi, first Piola-Kirchhoff stress P, tangent A.

    psi = energy(F, p)             energy per undeformed volume
    P   = stress(F, p)             P = dpsi/dF
    K   = tangent(F, u, v, p)      K_ik = A_iJkL u_J v_L with A = dP/dF

F, P and K are tuples of nine numbers, row by row; u and v are material vectors (tuples of three); p is the array of the law's
parameters. The tangent is given as the block it makes between two shape functions with gradients u and v: unit vectors for u
and v give all of A. `parameters` makes p of Young's modulus and Poisson's ratio.

Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed. (2008), sections 6.4 and 6.5;
the first law is the one of Olshevskiy et al. (2017), Eqs. (7)-(9), with the misprint of (9) mended (docs/theory.md).
"""

from __future__ import annotations

from collections.abc import Callable
from math import log
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.material.tensor import (
    IDENTITY,
    add,
    apply,
    contract,
    determinant,
    dot,
    gram,
    inner,
    inverse_transpose,
    outer,
    scale,
    trace,
    transpose,
)


class Law(NamedTuple):
    """A hyperelastic law: see the head of this module."""

    name: str
    title: str
    energy: Callable
    stress: Callable
    tangent: Callable
    parameters: Callable[[float, float], NDArray[np.float64]]


def lame_parameters(young: float, poisson: float) -> NDArray[np.float64]:
    """Lame's first parameter and the shear modulus, in the unit of `young`."""
    return np.array([young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))])


# --- St Venant-Kirchhoff: S = lambda tr(E) I + 2 mu E, E = (FᵀF - I) / 2


@register_jitable
def green_lagrange(F):
    """Green-Lagrange strain (FᵀF - I) / 2."""
    c = gram(F)
    return (
        0.5 * (c[0] - 1.0),
        0.5 * c[1],
        0.5 * c[2],
        0.5 * c[3],
        0.5 * (c[4] - 1.0),
        0.5 * c[5],
        0.5 * c[6],
        0.5 * c[7],
        0.5 * (c[8] - 1.0),
    )


@register_jitable
def svk_second_stress(E, p):
    """Second Piola-Kirchhoff stress from the Green-Lagrange strain."""
    return add(scale(p[0] * trace(E), IDENTITY), scale(2.0 * p[1], E))


@register_jitable
def svk_energy(F, p):
    E = green_lagrange(F)
    return 0.5 * p[0] * trace(E) ** 2 + p[1] * contract(E, E)


@register_jitable
def svk_stress(F, p):
    return dot(F, svk_second_stress(green_lagrange(F), p))


@register_jitable
def svk_tangent(F, u, v, p):
    S = svk_second_stress(green_lagrange(F), p)
    Fu, Fv = apply(F, u), apply(F, v)
    material = add(scale(p[0], outer(Fu, Fv)), scale(p[1], outer(Fv, Fu)))
    along = add(scale(p[1] * inner(u, v), gram(transpose(F))), scale(inner(u, apply(S, v)), IDENTITY))
    return add(material, along)


# --- compressible neo-Hooke: psi = mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2


@register_jitable
def neo_hooke_energy(F, p):
    J = determinant(F)
    if J <= 0.0:
        return np.inf
    log_J = log(J)
    return 0.5 * p[1] * (contract(F, F) - 3.0) - p[1] * log_J + 0.5 * p[0] * log_J**2


@register_jitable
def neo_hooke_stress(F, p):
    J = determinant(F)
    log_J = log(J) if J > 0.0 else np.nan
    return add(scale(p[1], F), scale(p[0] * log_J - p[1], inverse_transpose(F, J)))


@register_jitable
def neo_hooke_tangent(F, u, v, p):
    J = determinant(F)
    log_J = log(J) if J > 0.0 else np.nan
    inverse = inverse_transpose(F, J)
    gu, gv = apply(inverse, u), apply(inverse, v)
    volumetric = add(scale(p[0], outer(gu, gv)), scale(p[1] - p[0] * log_J, outer(gv, gu)))
    return add(volumetric, scale(p[1] * inner(u, v), IDENTITY))


LAWS = {
    law.name: law
    for law in (
        Law("svk", "St Venant-Kirchhoff", svk_energy, svk_stress, svk_tangent, lame_parameters),
        Law(
            "neo_hooke",
            "compressible neo-Hooke",
            neo_hooke_energy,
            neo_hooke_stress,
            neo_hooke_tangent,
            lame_parameters,
        ),
    )
}


def law_named(name: str) -> Law:
    """The law called `name`. Raises CaseError with the laws there are."""
    if name not in LAWS:
        raise CaseError(key="material.law", got=name, expected="a law", cure=did_you_mean(name, tuple(LAWS)))
    return LAWS[name]
