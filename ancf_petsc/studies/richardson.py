"""Richardson extrapolation: the order a ladder of levels shows, its limit, and how uncertain that is.

A value q at size h is taken for q = limit + c h**order. The order is fitted, not assumed. What is left between the finest
level and the limit is its error, `gap`. The limit's uncertainty is

    (Fs - 1) gap + spread + singular

Fs = 1.25 (Roache, Verification and Validation, 1998) where the three finest levels and the three before them show the same
order, else 2; spread: how far the limits of those two triples are apart; singular: how much farther the limit is with the
order that growing strains predict, where that is lower than the order seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

ORDERS = (0.3, 7.0)
"""Outside of these a ladder is not taken for one that converges."""
LEVELS = 4
"""The finest so many levels are looked at."""
EQUAL = 1e-8
"""Levels that differ by less, relatively, have converged: iterations end at about this accuracy."""
SAME_ORDER = 1.3
"""Orders whose ratio is below are the same."""
DRIFT = 2.0
"""Orders of two triples whose ratio is above contradict each other."""
CONFIRMED, UNCONFIRMED = 1.25, 2.0
"""Factors of safety Fs."""
BEYOND = 1.0
"""An order may be larger by this than the element's, or than growing strains allow, before it is called an accident."""
NEAR = 0.25
"""How far from its own order that of an integrator may seem."""
FOLDED = 0.66
"""A stretch below which free surfaces fold: Biot's of svk is 0.640 to 0.658, a crease of neo_hooke forms at 0.65."""
DEEPER = 0.02
"""By which the smallest stretch has to fall from one level to the next to be on its way down."""
ASYMPTOTIC, NOT_ASYMPTOTIC, TOO_FEW = "asymptotic", "not asymptotic", "too few levels"

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LadderLimit:
    """order, limit and uncertainty (absolute) are None where nothing is claimed. gap: |finest - limit|."""

    verdict: str
    words: str
    order: float | None = None
    limit: float | None = None
    uncertainty: float | None = None
    gap: float | None = None


@dataclass(frozen=True)
class Ladder:
    """Levels, coarse to fine.

    sizes, values (l,). formal: the highest order that a smooth problem would show, None where it is not known.
    exact: the order that there must be, as of an integrator, None where it is not known.
    stretches (l,): the smallest stretch in the body at each level, None where there is none to be read.
    """

    sizes: Sequence[float]
    values: Sequence[float]
    formal: float | None = None
    stretches: Sequence[float] | None = None
    exact: float | None = None


def extrapolate(ladder: Ladder) -> LadderLimit:
    """Order, limit and uncertainty of a ladder, or why it has none."""
    h, q, stretch = _levels(ladder)
    if len(h) < 3:
        return LadderLimit(TOO_FEW, f"{len(h)} level{'s' * (len(h) != 1)}; an order needs three")
    scale = float(np.abs(q).max())
    steps = np.diff(q)
    if np.abs(steps).max() <= EQUAL * scale:
        noise = float(np.abs(steps).max())
        words = "all levels give the same value: nothing is left to extrapolate"
        return LadderLimit(ASYMPTOTIC, words, None, float(q[-1]), noise, 0.0)
    if (steps[:-1] * steps[1:] <= 0).any():
        return _refused("values do not change in one direction from level to level")
    triples = [fitted_order(h[k : k + 3], q[k : k + 3]) for k in range(len(h) - 2)]
    problem = _problem(triples, ladder, h, stretch)
    if problem:
        return _refused(problem)
    found = _limit(h, q, triples, stretch)
    if found.limit is not None and abs(found.limit) <= EQUAL * scale:
        found = replace(found, limit=0.0)  # what is left is rounding, and nothing is relative to it
    exact = ladder.exact
    seen = [found.order, *(triple[0] for triple in triples[-1:] if triple)]
    odd = [order for order in seen if exact and order and abs(order - exact) > NEAR]
    if odd:
        return _refused(
            f"the order {odd[0]:.2g} is not the integrator's, {exact:g}: steps are too long to show it"
        )
    return found


def _refused(words: str) -> LadderLimit:
    return LadderLimit(NOT_ASYMPTOTIC, words)


def _levels(ladder: Ladder) -> tuple[Floats, Floats, Floats | None]:
    """The finest levels, each size once, coarse to fine."""
    h, q = np.array(ladder.sizes, float), np.array(ladder.values, float)
    order = np.argsort(-h, kind="stable")
    keep = [k for n, k in enumerate(order) if n == 0 or h[k] < h[order[n - 1]] * (1 - 1e-6)][-LEVELS:]
    stretch = None if ladder.stretches is None else np.array(ladder.stretches, float)[keep]
    return h[keep], q[keep], stretch


def fitted_order(h: Floats, q: Floats) -> tuple[float, float] | None:
    """Order and limit through three levels of any ratio; None where no order fits."""
    ratio = (q[0] - q[1]) / (q[1] - q[2])

    def miss(p: float) -> float:
        return (h[0] ** p - h[1] ** p) / (h[1] ** p - h[2] ** p) - ratio

    h = h / h[2]
    low, high = 1e-3, 3.0 * ORDERS[1]
    if miss(low) > 0 or miss(high) < 0:
        return None
    p = float(brentq(miss, low, high, xtol=1e-10))
    return p, float(q[2] + (q[2] - q[1]) / (h[1] ** p - 1.0))


def _problem(
    triples: list[tuple[float, float] | None], ladder: Ladder, h: Floats, stretch: Floats | None
) -> str:
    """Why levels that go one way are still no convergence; empty where nothing speaks against it."""
    finest = triples[-1]
    if finest is None or not ORDERS[0] < finest[0] < ORDERS[1]:
        if finest is None:
            return "differences between levels do not shrink as sizes do: no order fits"
        return f"the order {finest[0]:.2g} is outside {ORDERS[0]:g} to {ORDERS[1]:g}"
    if stretch is not None and stretch[-1] < FOLDED and stretch[-1] < stretch[-2] - DEEPER:
        return (
            f"the smallest stretch falls with refinement, to {stretch[-1]:.2f}: surfaces fold there, "
            "and without self-contact there is no limit"
        )
    allowed = _strain_order(h, stretch)
    if allowed is not None and finest[0] > allowed + BEYOND:
        return (
            f"the order {finest[0]:.2g} is an accident: strains grow with refinement, "
            f"and with them it must fall to {allowed:.2g}"
        )
    if ladder.formal is not None and finest[0] > ladder.formal + BEYOND:
        return f"the order {finest[0]:.2g} is an accident: the element's is {ladder.formal:.2g} at most"
    return _drift(triples)


def _drift(triples: list[tuple[float, float] | None]) -> str:
    """Whether the three finest levels and the three before them contradict each other."""
    finest = triples[-1]
    if len(triples) < 2 or finest is None:
        return ""
    before = triples[-2]
    if before is None or not ORDERS[0] < before[0] < ORDERS[1]:
        return "the levels before the finest three show no order"
    ratio = finest[0] / before[0]
    if max(ratio, 1.0 / ratio) > DRIFT:
        return f"the order drifts from {before[0]:.2g} to {finest[0]:.2g}"
    return ""


def _limit(
    h: Floats, q: Floats, triples: list[tuple[float, float] | None], stretch: Floats | None
) -> LadderLimit:
    """The limit with its uncertainty; of four levels, order and limit by least squares."""
    finest = triples[-1]
    assert finest is not None
    order, limit = finest if len(h) == 3 else _least_squares(h, q, finest[0])
    gap = abs(q[-1] - limit)
    factor, spread = UNCONFIRMED, 0.0
    if len(triples) > 1 and triples[-2] is not None:
        spread = abs(finest[1] - triples[-2][1])
        ratio = finest[0] / triples[-2][0]
        factor = CONFIRMED if 1 / SAME_ORDER < ratio < SAME_ORDER else UNCONFIRMED
    if spread > gap + abs(q[-1] - finest[1]):
        return _refused("the limits of the three finest levels and of the three before are too far apart")
    singular, words = 0.0, ""
    expected = _strain_order(h, stretch)
    if expected is not None and ORDERS[0] < expected < order:
        farther = abs((q[-1] - q[-2]) / ((h[-2] / h[-1]) ** expected - 1.0))
        singular = max(0.0, farther - gap)
        words = f"; strains grow with refinement (a singular place): the order should fall to {expected:.2g}"
    elif order < 1.5:
        words = "; a low order, as singular places (re-entrant corners, bonded rims) give it"
    uncertainty = (factor - 1.0) * gap + spread + singular
    levels = f"order {order:.2g} from {len(h)} levels"
    return LadderLimit(ASYMPTOTIC, f"{levels}{words}", order, float(limit), float(uncertainty), float(gap))


def _least_squares(h: Floats, q: Floats, near: float) -> tuple[float, float]:
    """Order and limit of more than three levels: weighted by 1/h, so that fine levels count more."""
    weights = np.sqrt(1.0 / h / (1.0 / h).sum())

    def solved(p: float) -> tuple[float, Floats]:
        matrix = np.stack([np.ones_like(h), (h / h[-1]) ** p], axis=1)
        found, *_ = np.linalg.lstsq(weights[:, None] * matrix, weights * q, rcond=None)
        return float(np.linalg.norm(weights * (matrix @ found - q))), found

    tried = near * np.geomspace(1 / DRIFT, DRIFT, 401)
    best = float(tried[np.argmin([solved(p)[0] for p in tried])])
    return best, float(solved(best)[1][0])


def _strain_order(h: Floats, stretch: Floats | None) -> float | None:
    """The order that growing strains allow: strains ~ h**-a at a singular place give energies and forces 2 (1 - a).

    None where strains converge, or are not known: increments that shrink are no singularity.
    """
    if stretch is None or (stretch <= 0).any() or (stretch >= 1).any():
        return None
    h, strain = h[-3:] / h[-1], -np.log(stretch[-3:])
    first, second = np.diff(strain)
    if first <= 0 or second <= 0:
        return None

    def miss(a: float) -> float:
        return (h[2] ** -a - h[1] ** -a) / (h[1] ** -a - h[0] ** -a) - second / first

    if miss(1e-6) >= 0:
        return None
    return 2.0 * (1.0 - (float(brentq(miss, 1e-6, 1.0)) if miss(1.0) > 0 else 1.0))
