"""Critical points of a load path: where equilibria lose their stability.

What is looked at after accepted steps: the negative pivots of the last tangent where it was factored, which cost nothing,
and its lowest eigenvalue (`lowest`), two iterations a state. What seems unstable is looked at again with the tangent of the
state itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

from ancf_petsc.solve.linear.solver import negative_pivots_of
from ancf_petsc.solve.lowest import LowestMode
from ancf_petsc.solve.newton import Newton

FIRST, PASSING, CLOSE = 8, 2, 12
"""Iterations for the lowest mode: of the first state, of states along the path, where the value itself counts."""
LARGEST_TO_COUNT = 300_000
WORTH, PATIENCE = 300, 10
NEAR = 0.5
"""Of the largest lowest eigenvalue: below it every state is looked at."""
NEUTRAL = 1e-5
"""Of the largest lowest eigenvalue: smaller ones are 0, such as that of a square column for the direction it buckles in."""
SHIFT = 1e-3
MOST_TRIALS, SHARP = 8, 1e-4


@dataclass
class Known:
    """A state looked at. value: lowest eigenvalue."""

    s: float
    x: PETSc.Vec
    value: float


class Watch:
    """Looks at the states of a path. history: (s, lowest eigenvalue), newest last. negative: directions, None unknown."""

    def __init__(self, newton: Newton) -> None:
        self.newton = newton
        self.lowest = LowestMode(newton)
        self.history: list[tuple[float, float]] = []
        self.negative: int | None = 0
        self._first = True
        self._spent = self._passed = 0  # linear iterations, and outputs, since the last look

    def destroy(self) -> None:
        """Free PETSc's objects."""
        self.lowest.destroy()

    def state(self) -> dict[str, Any]:
        """What was seen so far."""
        return {
            "lowest": self.lowest.state(),
            "history": [list(seen) for seen in self.history],
            "negative": self.negative,
            "first": self._first,
            "since": [self._spent, self._passed],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state."""
        self.lowest.restore(state["lowest"])
        self.history = [(s, value) for s, value in state["history"]]
        self.negative, self._first = state["negative"], state["first"]
        self._spent, self._passed = state["since"]

    @property
    def stable(self) -> bool:
        """Whether the last state looked at was."""
        return self.negative == 0

    @property
    def share(self) -> float:
        """The last lowest eigenvalue over the largest so far."""
        largest = self.largest
        return self.history[-1][1] / largest if self.history and largest > 0.0 else 1.0

    @property
    def largest(self) -> float:
        """The largest lowest eigenvalue so far."""
        return max((value for _, value in self.history), default=0.0)

    def begin(self, s: float) -> bool:
        """See the tangent that the linear solver holds: that of the state the path begins with. Once; returns whether
        this is it.
        """
        first, self._first = self._first, False
        if first:
            self.history.append((s, self.lowest.look(FIRST)))
        return first

    def see(self, s: float, x: PETSc.Vec, *, fresh: bool, at_output: bool, effort: int) -> bool:
        """See a converged state. fresh: the linear solver holds a tangent of this state or of the iterate before it.
        effort: linear iterations it took. Returns whether it was looked at.

        Where tangents are factored every state is. Elsewhere a look costs some three iterations of the linear solver: it
        is taken at the last output, at those after WORTH iterations or PATIENCE outputs, and wherever 0 is near.
        """
        newton = self.newton
        self._spent += effort
        self._passed += at_output
        due = at_output and (self._spent >= WORTH or self._passed >= PATIENCE or s == 1.0)
        if not (newton.linear.direct or due or self.share < NEAR):
            return False
        self._spent = self._passed = 0
        if not fresh:
            newton.tangent_at(x)
        value, pivots = self.lowest.look(PASSING), newton.linear.negative_pivots()
        if (value < 0.0 or pivots) and self.negative == 0:
            if fresh:
                newton.tangent_at(x)
            value = self.lowest.look(CLOSE)
            pivots = self.count(value)
        if pivots is None:
            pivots = 0 if value > 0.0 else self.negative
        self.negative = pivots
        self.history.append((s, value))
        return True

    def forget_last(self) -> None:
        """The last state looked at is none of the path."""
        self.history.pop()
        self.negative = 0

    def count(self, value: float) -> int | None:
        """Negative pivots of the tangent held, its lowest eigenvalue being `value`; None where nobody can count them.
        None are counted where all of them are 0 but for rounding.
        """
        if abs(value) <= NEUTRAL * self.largest:
            return 0
        pivots = self.newton.linear.negative_pivots()
        if pivots is None and value > 0.0:
            return 0
        if pivots is None and self.newton.assembly.model.dof <= LARGEST_TO_COUNT:
            pivots = negative_pivots_of(self.newton.matrix.mat)
        return pivots

    def look_closely(self, x: PETSc.Vec) -> float:
        """The lowest eigenvalue at x."""
        self.newton.tangent_at(x)
        return self.lowest.look(CLOSE)

    def find_mode(self, x: PETSc.Vec) -> None:
        """The lowest mode at x, near a critical point. Of several with eigenvalues near 0 the same on any number of ranks: a
        shift is large beside the differences that rounding makes between them.
        """
        lowest = self.lowest
        lowest.restart()
        self.newton.tangent_at(x, SHIFT * self.largest * lowest.scale)
        lowest.look(CLOSE)

    def locate(self, before: Known, after: Known) -> tuple[Known, Known, float]:
        """Close in on the critical point: states before and after it, which replace those given, and where it is.

        Equilibria between are found from the straight line between the two; the zero of the lowest eigenvalue by the
        method of false position (Illinois).
        """
        side, weights, found = 0, [before.value, after.value], after.s
        for _ in range(MOST_TRIALS):
            width = after.s - before.s
            if width <= SHARP * max(abs(after.s), width):
                break
            part = weights[0] / (weights[0] - weights[1]) if weights[0] > 0.0 > weights[1] else 0.5
            guess = before.s + width * min(max(part, 0.02), 0.98)
            close, found = abs(guess - found) <= SHARP * max(abs(guess), width), guess
            known = self._between(before, after, guess)
            if known is None:
                break
            if known.value > 0.0:
                before.x.destroy()
                before, weights[0] = known, known.value
                weights[1] *= 0.5 if side > 0 else 1.0
                side = 1
            else:
                after.x.destroy()
                after, weights[1] = known, known.value
                weights[0] *= 0.5 if side < 0 else 1.0
                side = -1
            if close:
                break
        if before.value > 0.0 > after.value:
            found = before.s + (after.s - before.s) * before.value / (before.value - after.value)
        return before, after, found

    def _between(self, before: Known, after: Known, s: float) -> Known | None:
        x = before.x.copy()
        x.scale((after.s - s) / (after.s - before.s))
        x.axpy((s - before.s) / (after.s - before.s), after.x)
        self.newton.assembly.set_driven(x, s)
        if not self.newton.solve(s, x).converged:
            x.destroy()
            return None
        return Known(s, x, self.look_closely(x))
