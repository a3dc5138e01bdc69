"""How exactly each linear system of Newton's method is solved.

After a linear solve that reduces its residual by eta the next out-of-balance force is about eta r + C r^2. Solving far
better than C r is wasted, and so is going beyond the tolerance. C is learnt from the iterations so far. A new tangent
costs as much as several iterations of the linear solver, so eta stays well below C r: SHARE of it.

After Eisenstat and Walker, Choosing the forcing terms in an inexact Newton method, SIAM J. Sci. Comput. 17 (1996) 16.
"""

from __future__ import annotations

LOOSEST, TIGHTEST = 0.1, 1e-10
AIM = 0.5
SHARE = 0.01


class Forcing:
    """Forcing terms eta for out-of-balance forces r over the force scale."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self._curvature = 100.0
        self._last: tuple[float, float] | None = None

    def start(self) -> None:
        """A new Newton solve begins."""
        self._last = None

    def learn(self, residual: float) -> None:
        """See the out-of-balance force that the last linear solve led to."""
        if self._last is None:
            return
        before, eta = self._last
        found = max(residual - eta * before, 0.0) / before**2
        self._curvature = min(max(found, 0.3 * self._curvature, 1.0), 1e6)

    @property
    def curvature(self) -> float:
        """C, as it is known so far."""
        return self._curvature

    @curvature.setter
    def curvature(self, value: float) -> None:
        self._curvature = value

    def term(self, residual: float) -> float:
        """The reduction to ask for at an out-of-balance force `residual`."""
        wanted = max(SHARE * self._curvature * residual, AIM * self.tolerance / residual)
        eta = min(max(wanted, TIGHTEST), LOOSEST)
        self._last = (residual, eta)
        return eta
