"""The laws, each one block: energy psi, first Piola-Kirchhoff stress P, tangent A.

    psi = energy(F, p)             energy per undeformed volume
    P   = stress(F, p)             P = dpsi/dF
    K   = tangent(F, u, v, p)      K_ik = A_iJkL u_J v_L with A = dP/dF

F, P and K are tuples of nine numbers, row by row; u and v are material vectors (tuples of three); p is the
array of the law's parameters. The tangent is given as the block it makes between two shape functions with
gradients u and v: unit vectors for u and v give all of A. `parameters` makes p of Young's modulus and
Poisson's ratio.

For steps that keep energy a law may have a discrete gradient between two states, with F = (F0 + F1) / 2:

    P = mean_stress(F0, F1, p)         P = F S, S symmetric, S : (E1 - E0) = psi(F1) - psi(F0)
    K = mean_tangent(F0, F1, u, v, p)  as `tangent`, with A = dP/dF1

Sources: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed. (2008), sections
6.4 and 6.5; Gonzalez, Exact energy and momentum conserving algorithms for general models in nonlinear
elasticity, CMAME 190 (2000) 1763; the first law is the one of Olshevskiy et al. (2017), Eqs. (7)-(9), with
the misprint of (9) mended (docs/theory.md).
"""

from __future__ import annotations

from collections.abc import Callable
from math import log, log1p
from typing import NamedTuple

import numpy as np
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
    inlined,
    inner,
    inverse_transpose,
    outer,
    scale,
    trace,
    transpose,
)

SAME_STRAIN = 1e-6  # below it a correction of second order in the difference of strains is less than rounding


class Law(NamedTuple):
    """A hyperelastic law: see the head of this module.

    condenses: `plane_stress` and beams take its parameters.
    """

    name: str
    title: str
    energy: Callable
    stress: Callable
    tangent: Callable
    parameters: Callable[[float, float], NDArray[np.float64]]
    mean_stress: Callable | None = None
    mean_tangent: Callable | None = None
    condenses: bool = False


def lame_parameters(young: float, poisson: float) -> NDArray[np.float64]:
    """Lame's first parameter and the shear modulus, in the unit of `young`."""
    return np.array([young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))])


def plane_stress(parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lame's parameters of a plane law whose stress across the plane vanishes: the first one condensed."""
    lame, shear = parameters
    return np.array([2 * lame * shear / (lame + 2 * shear), shear])


# --- St Venant-Kirchhoff: S = lambda tr(E) I + 2 mu E, E = (FᵀF - I) / 2


@inlined
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


@inlined
def svk_second_stress(E, p):
    """Second Piola-Kirchhoff stress from the Green-Lagrange strain."""
    return add(scale(p[0] * trace(E), IDENTITY), scale(2.0 * p[1], E))


@inlined
def svk_energy(F, p):
    E = green_lagrange(F)
    return 0.5 * p[0] * trace(E) ** 2 + p[1] * contract(E, E)


@inlined
def svk_stress(F, p):
    return dot(F, svk_second_stress(green_lagrange(F), p))


@inlined
def svk_tangent(F, u, v, p):
    S = svk_second_stress(green_lagrange(F), p)
    Fu, Fv = apply(F, u), apply(F, v)
    material = add(scale(p[0], outer(Fu, Fv)), scale(p[1], outer(Fv, Fu)))
    along = add(scale(p[1] * inner(u, v), gram(transpose(F))), scale(inner(u, apply(S, v)), IDENTITY))
    return add(material, along)


@inlined
def middle(A, B):
    """(A + B) / 2."""
    return scale(0.5, add(A, B))


@inlined
def svk_mean_stress(F0, F1, p):
    S = svk_second_stress(middle(green_lagrange(F0), green_lagrange(F1)), p)
    return dot(middle(F0, F1), S)


@inlined
def svk_mean_tangent(F0, F1, u, v, p):
    F = middle(F0, F1)
    S = svk_second_stress(middle(green_lagrange(F0), green_lagrange(F1)), p)
    volumetric = scale(p[0], outer(apply(F, u), apply(F1, v)))
    shear = add(outer(apply(F, v), apply(F1, u)), scale(inner(u, v), dot(F, transpose(F1))))
    material = add(volumetric, scale(p[1], shear))
    return scale(0.5, add(material, scale(inner(u, apply(S, v)), IDENTITY)))


# --- compressible neo-Hooke: psi = mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2


@inlined
def neo_hooke_energy(F, p):
    if determinant(F) <= 0.0:
        return np.inf
    E = green_lagrange(F)
    log_J = log_det(E)
    return p[1] * (trace(E) - log_J) + 0.5 * p[0] * log_J**2


@inlined
def log_det(E):
    """ln J from the Green-Lagrange strain: small strains lose no digits, as the discrete gradient needs."""
    linear = trace(E)
    quadratic = 0.5 * (linear * linear - contract(E, E))
    return 0.5 * log1p(2.0 * linear + 4.0 * quadratic + 8.0 * determinant(E))


@inlined
def neo_hooke_stress(F, p):
    J = determinant(F)
    log_J = log(J) if J > 0.0 else np.nan
    return add(scale(p[1], F), scale(p[0] * log_J - p[1], inverse_transpose(F, J)))


@inlined
def neo_hooke_tangent(F, u, v, p):
    J = determinant(F)
    log_J = log(J) if J > 0.0 else np.nan
    inverse = inverse_transpose(F, J)
    gu, gv = apply(inverse, u), apply(inverse, v)
    volumetric = add(scale(p[0], outer(gu, gv)), scale(p[1] - p[0] * log_J, outer(gv, gu)))
    return add(volumetric, scale(p[1] * inner(u, v), IDENTITY))


@inlined
def neo_hooke_second_stress(C, p):
    """S and C^-1 from C = FᵀF."""
    inverse = inverse_transpose(C, determinant(C))
    log_J = 0.5 * log(determinant(C)) if determinant(C) > 0.0 else np.nan
    return add(scale(p[1], IDENTITY), scale(p[0] * log_J - p[1], inverse)), inverse, log_J


@inlined
def neo_hooke_correction(F0, F1, S, p):
    """N = E1 - E0, N : N and the factor of N that makes S a discrete gradient; 0 where the states are the
    same.
    """
    N = add(green_lagrange(F1), scale(-1.0, green_lagrange(F0)))
    length = contract(N, N)
    if length < SAME_STRAIN**2:
        return N, length, 0.0
    rise = neo_hooke_energy(F1, p) - neo_hooke_energy(F0, p)
    return N, length, (rise - contract(S, N)) / length


@inlined
def neo_hooke_mean_stress(F0, F1, p):
    S, _, _ = neo_hooke_second_stress(middle(gram(F0), gram(F1)), p)
    N, _, factor = neo_hooke_correction(F0, F1, S, p)
    return dot(middle(F0, F1), add(S, scale(factor, N)))


@inlined
def neo_hooke_mean_tangent(F0, F1, u, v, p):
    F = middle(F0, F1)
    S, inverse, log_J = neo_hooke_second_stress(middle(gram(F0), gram(F1)), p)
    N, length, factor = neo_hooke_correction(F0, F1, S, p)
    S1, _, _ = neo_hooke_second_stress(gram(F1), p)
    pull = add(S1, scale(-1.0, S))
    parts = (inverse, log_J, pull, N, length, factor)
    a = apply(F, apply(neo_hooke_mean_growth((F1[0], F1[1], F1[2]), v, parts, p), u))
    b = apply(F, apply(neo_hooke_mean_growth((F1[3], F1[4], F1[5]), v, parts, p), u))
    c = apply(F, apply(neo_hooke_mean_growth((F1[6], F1[7], F1[8]), v, parts, p), u))
    material = (a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2])
    geometric = 0.5 * inner(u, apply(add(S, scale(factor, N)), v))
    return add(material, scale(geometric, IDENTITY))


@inlined
def neo_hooke_mean_growth(w, v, parts, p):
    """Change of the mean S when row w of F1 grows along v."""
    inverse, log_J, pull, N, length, factor = parts
    dE = middle(outer(w, v), outer(v, w))
    turned = dot(inverse, dot(dE, inverse))
    dS = add(scale(p[1] - p[0] * log_J, turned), scale(0.5 * p[0] * contract(inverse, dE), inverse))
    if length < SAME_STRAIN**2:
        return dS
    slope = (contract(pull, dE) - contract(dS, N) - 2.0 * factor * contract(N, dE)) / length
    return add(dS, add(scale(factor, dE), scale(slope, N)))


LAWS = {
    law.name: law
    for law in (
        Law(
            "svk",
            "St Venant-Kirchhoff",
            svk_energy,
            svk_stress,
            svk_tangent,
            lame_parameters,
            svk_mean_stress,
            svk_mean_tangent,
            condenses=True,
        ),
        Law(
            "neo_hooke",
            "compressible neo-Hooke",
            neo_hooke_energy,
            neo_hooke_stress,
            neo_hooke_tangent,
            lame_parameters,
            neo_hooke_mean_stress,
            neo_hooke_mean_tangent,
        ),
    )
}


def law_named(name: str) -> Law:
    """The law called `name`. Raises CaseError with the laws there are."""
    if name not in LAWS:
        raise CaseError(key="material.law", got=name, expected="a law", cure=did_you_mean(name, tuple(LAWS)))
    return LAWS[name]
