"""How far a law carries: loss of ellipticity, of force in uniaxial stress, of a free surface's stability.

All of it is computed from the law's stress and tangent, so that it holds for any law; states are principal stretches of isotropic
laws. Sources: J. K. Knowles and E. Sternberg, Arch. Ration. Mech. Anal. 63 (1977) 321 (ellipticity); M. A. Biot, Mechanics of
incremental deformations (1965), and for the impedance matrix of a free surface Y. B. Fu and A. Mielke, Proc. R. Soc. A 458 (2002)
2523.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import schur

from ancf_petsc.material.models import Law

Floats = NDArray[np.float64]
SMALLEST_STRETCH, LARGEST_STRETCH = 0.05, 6.0
"""Between them limits are looked for."""
SCAN, SHARP = 0.05, 1e-9
DIRECTIONS = tuple(np.linspace(0.0, np.pi / 2, 7))
"""Of waves on a surface, from the axis of the first stretch towards that of the third; others follow by symmetry."""
DECAYS = 1e-6
"""Of the wave number: surface waves that decay slower do not."""


def stress(law: Law, parameters: Floats, F: ArrayLike) -> Floats:
    """First Piola-Kirchhoff stress (3, 3), in the unit of the moduli."""
    return np.array(law.stress(_tuple(F), tuple(parameters))).reshape(3, 3)


def moduli(law: Law, parameters: Floats, F: ArrayLike) -> Floats:
    """A_iJkL = dP_iJ / dF_kL (3, 3, 3, 3)."""
    F, p, A = _tuple(F), tuple(parameters), np.empty((3, 3, 3, 3))
    axes = [tuple(row) for row in np.eye(3)]
    for J, L in product(range(3), range(3)):
        A[:, J, :, L] = np.array(law.tangent(F, axes[J], axes[L], p)).reshape(3, 3)
    return A


def ellipticity(law: Law, parameters: Floats, F: ArrayLike) -> float:
    """The smallest eigenvalue of the acoustic tensor A_iJkL n_J n_L over all directions n, over that of the undeformed state.

    Where it is 0 or less no equilibrium of a body with such a point is stable, whatever its supports.
    """
    n = _directions()
    undeformed = np.linalg.eigvalsh(np.einsum("iJkL,nJ,nL->nik", moduli(law, parameters, np.eye(3)), n, n))
    now = np.linalg.eigvalsh(np.einsum("iJkL,nJ,nL->nik", moduli(law, parameters, F), n, n))
    return float(now.min() / undeformed.min())


def uniaxial_limit(law: Law, parameters: Floats) -> float | None:
    """The stretch in compression at which the force in uniaxial stress is largest, so that a body carries the less the more it is
    pressed below; None where there is no such stretch.
    """
    return _uniaxial_limit(law, tuple(map(float, parameters)))


@lru_cache
def _uniaxial_limit(law: Law, parameters: tuple[float, ...]) -> float | None:
    p = np.array(parameters)

    def slope(stretch: float) -> float:
        """Of the force over the stretch, the stretches across following."""
        across = balanced(law, p, lambda t: (stretch, t, t))
        if across is None:
            return np.nan
        A = np.einsum("iikk->ik", moduli(law, p, np.diag((stretch, across, across))))
        return float(A[0, 0] - A[0, 1:] @ np.linalg.solve(A[1:, 1:], A[1:, 0]))

    above = 1.0
    for stretch in np.arange(1.0 - SCAN, SMALLEST_STRETCH, -SCAN).tolist():
        if slope(stretch) <= 0.0:
            return _zero(slope, stretch, above)
        above = stretch
    return None


def balanced(law: Law, parameters: Floats, stretches: Callable[[float], ArrayLike]) -> float | None:
    """The number t nearest to 1 at which the stress along the second axis vanishes for principal stretches (3,) of t, and grows
    with t; None where there is none.
    """

    def across(t: float) -> float:
        return float(stress(law, parameters, np.diag(np.asarray(stretches(t), float)))[1, 1])

    grid = np.geomspace(SMALLEST_STRETCH, LARGEST_STRETCH, 60)
    values = np.array([across(t) for t in grid])
    rising = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
    if not len(rising):
        return None
    k = min(rising, key=lambda i: abs(np.log(grid[i])))
    return _zero(across, float(grid[k]), float(grid[k + 1]))


def surface_margin(
    law: Law, parameters: Floats, along: float, transverse: float = 1.0, *, in_plane: bool = False
) -> float:
    """How far a free surface with these two principal stretches in it is from folding: the smallest eigenvalue of its impedance
    matrix over that of the undeformed one. 0 or less: surface waves grow, the shorter the faster; -inf beyond ellipticity.

    The stretch across follows from the surface being free of stress. in_plane: waves along the first axis that move in the plane
    of it and the normal, as in plane bodies; else waves in all directions.
    """
    p = np.asarray(parameters, float)
    across = balanced(law, p, lambda t: (along, t, transverse))
    if across is None:
        return -np.inf
    angles, moving = ((0.0,), slice(0, 2)) if in_plane else (DIRECTIONS, slice(0, 3))
    now, undeformed = moduli(law, p, np.diag((along, across, transverse))), moduli(law, p, np.eye(3))
    return min(_impedance(now, angle, moving) for angle in angles) / _impedance(undeformed, 0.0, moving)


def critical_surface_stretch(
    law: Law, parameters: Floats, transverse: float = 1.0, *, in_plane: bool = False
) -> float | None:
    """The largest stretch at which a free surface folds under compression, Biot's. transverse: the other principal stretch in the
    surface, 1 in plane strain. in_plane: as of `surface_margin`. None where no surface folds.
    """
    return _critical(law, tuple(map(float, parameters)), float(transverse), in_plane=in_plane)


@lru_cache(maxsize=256)
def _critical(law: Law, parameters: tuple[float, ...], transverse: float, *, in_plane: bool) -> float | None:
    p = np.array(parameters)

    def margin(along: float) -> float:
        return surface_margin(law, p, along, transverse, in_plane=in_plane)

    above = max(1.0, transverse) + SCAN
    if margin(above) <= 0.0:
        return above
    for along in np.arange(above - SCAN, SMALLEST_STRETCH, -SCAN).tolist():
        if margin(along) <= 0.0:
            return _zero(margin, along, above)
        above = along
    return None


def _impedance(A: Floats, angle: float, moving: slice) -> float:
    """Smallest eigenvalue of the impedance matrix Z of the half-space X2 > 0 for waves of wave number 1: a displacement of its
    surface a exp(i n.X) that decays inwards takes the force Z a. -inf where not all waves decay. moving: components that may.
    """
    n = np.array([np.cos(angle), 0.0, np.sin(angle)])
    A = A[moving, :, moving, :]
    Q, R, T = np.einsum("iJkL,J,L->ik", A, n, n), np.einsum("iJk,J->ik", A[:, :, :, 1], n), A[:, 1, :, 1]
    if np.linalg.eigvalsh(T)[0] <= 0.0:
        return -np.inf
    # a = v exp(-s X2): (T s^2 - i s (R + R^T) - Q) v = 0, as eigenvalues of a matrix of twice the size. Decaying waves span an
    # invariant subspace, which is well defined where eigenvectors coincide, as they do undeformed.
    inverse = np.linalg.inv(T)
    m = len(T)
    companion = np.block([[np.zeros((m, m)), np.eye(m)], [inverse @ Q, 1j * inverse @ (R + R.T)]])
    _, basis, decaying = schur(companion, output="complex", sort=lambda s: s.real > DECAYS)
    if decaying != m:
        return -np.inf
    U = basis[:, :m]
    Z = T @ U[m:] @ np.linalg.inv(U[:m]) - 1j * R.T
    return float(np.linalg.eigvalsh((Z + Z.conj().T) / 2)[0])


def _directions() -> Floats:
    """Unit vectors (n, 3) over half a sphere."""
    count = 400
    z = 1.0 - (np.arange(count) + 0.5) / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    around = np.sqrt(1.0 - z**2)
    return np.concatenate((np.stack((around * np.cos(angle), around * np.sin(angle), z), axis=1), np.eye(3)))


def _zero(function: Callable[[float], float], below: float, above: float) -> float:
    """Where a function changes sign, by halving; it may be infinite on one side."""
    positive = function(above) > 0.0
    while above - below > SHARP:
        middle = (below + above) / 2
        if (function(middle) > 0.0) == positive:
            above = middle
        else:
            below = middle
    return (below + above) / 2


def _tuple(F: ArrayLike) -> tuple[float, ...]:
    return tuple(np.asarray(F, float).ravel().tolist())
