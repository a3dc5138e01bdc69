"""What happens at a critical point of a path: it is named, and the path ends there, goes on, or takes the stable branch."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.errors import NoEquilibrium
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.parallel.fields import field
from ancf_petsc.solve.cause import Cause, cause_of
from ancf_petsc.solve.critical import Known, Watch
from ancf_petsc.solve.descent import stable_neighbour
from ancf_petsc.solve.extrapolation import filled

ACROSS = 1e-4
"""Cosine between mode and loads below which the path goes on straight and another one branches off."""
BEYOND = 0.02
"""How far after a critical point its branch is entered, over its distance from the last stable state."""
log = logging.getLogger("ancf")


@dataclass(frozen=True)
class CriticalPoint:
    """Where equilibria lose their stability: at pseudo-time s, between two of them.

    kind: bifurcation, limit point or loss of stability. negative: directions in which the state that showed it is
    unstable, None if nobody counted. place, direction (3,): where the mode moves most, undeformed and in the file's
    coordinates, and whither. done: what was done. cause: what loses its stability, see `Cause`; None where nobody looked.
    """

    kind: str
    pseudo_time: float
    between: tuple[float, float]
    negative_directions: int | None
    place: tuple[float, ...]
    direction: tuple[float, ...]
    done: str
    cause: str | None = None

    def words(self) -> str:
        """One line."""
        many = "at least 1" if self.negative_directions is None else str(self.negative_directions)
        directions = "direction" if many.endswith("1") and len(many) < 3 else "directions"
        found = (
            f" ({many} negative {directions} of the tangent after it)"
            if self.negative_directions != 0
            else ""
        )
        place, along = (", ".join(f"{c:.4g}" for c in v) for v in (self.place, self.direction))
        return (
            f"{self.kind} at pseudo-time {self.pseudo_time:.6g}{found}; "
            f"its mode moves most at ({place}) along ({along}); {self.done}"
        )

    def facts(self) -> dict:
        """For the summary."""
        return asdict(self)


class Crossing:
    """Judges the states of a path. policy: report, stop or follow. `on_event(event, x)` sees the state nearest to it."""

    def __init__(
        self, watch: Watch, policy: str, on_event: Callable[[CriticalPoint, PETSc.Vec], None]
    ) -> None:
        self.watch, self.policy, self.on_event = watch, policy, on_event
        self.newton, self.model = watch.newton, watch.newton.assembly.model
        self._stable: Known | None = None
        self._ends: NoEquilibrium | None = None
        self._followed = False

    def judge(
        self,
        s: float,
        target: float,
        trial: PETSc.Vec,
        smallest: float,
        *,
        at_hand: bool,
        at_output: bool,
        effort: int,
    ) -> tuple[float, PETSc.Vec] | None:
        """The state to go on with after an accepted one at s, or None for a shorter step. at_hand: whether the linear solver
        holds a tangent of the trial state, or of the iterate before it. effort: linear iterations it took. Collective.
        """
        watch, was = self.watch, self.watch.negative
        if not watch.see(target, trial, fresh=at_hand, at_output=at_output, effort=effort):
            return target, trial
        if watch.stable:
            if was != 0:
                log.info("  stable again at pseudo-time %.6g", target)
            self.remember(target, trial)
            return target, trial
        if was != 0:
            if was != watch.negative:
                log.info("  pseudo-time %.6g: %s negative directions", target, watch.negative)
            return target, trial
        if self._followed and (target - s) / 4 >= smallest:
            watch.forget_last()
            return None
        return self._cross(s, target, trial)

    def remember(self, s: float, x: PETSc.Vec) -> None:
        """The last state known to be stable."""
        if self._stable is not None:
            self._stable.x.destroy()
        self._stable = Known(s, x.copy(), self.watch.history[-1][1] if self.watch.history else np.inf)

    def state(self) -> dict[str, Any]:
        """What it knows between steps."""
        known = self._stable
        stable = None if known is None else [known.s, field(known.x), known.value]
        return {"stable": stable, "followed": self._followed}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state."""
        self._followed = state["followed"]
        if state["stable"] is not None:
            s, rows, value = state["stable"]
            self._stable = Known(s, filled(self.newton.assembly.vector(), rows), value)

    def stop_if_asked(self) -> None:
        """Raise NoEquilibrium where the path was to end at a critical point, and has reached it."""
        if self._ends is not None:
            raise self._ends

    def limit_point(self, s: float, x: PETSc.Vec, smallest: float) -> CriticalPoint | None:
        """The limit point that a path ends at, if the lowest eigenvalue falls to 0 over its last states as it does there:
        its square in a straight line, which reaches 0 within a few of the smallest steps.
        """
        watch = self.watch
        self.newton.set_pseudo_time(s)
        value = watch.look_closely(x)
        earlier = [(t, v) for t, v in watch.history if t < s and v > 1.2 * value]
        if value <= 0.0 or not earlier:
            return None
        t, v = earlier[-1]
        found = s + (s - t) * value**2 / (v**2 - value**2)
        watch.history.append((s, value))
        if found - s > 5 * smallest or watch.share > 0.5:
            return None
        kind = "limit point" if self._along(x, t, s) > ACROSS else "bifurcation"
        share = f"the smallest eigenvalue of the tangent fell to {100 * watch.share:.2g} % of its largest"
        event = CriticalPoint(
            kind, found, (s, found), 0, *place_of(self.newton.assembly, watch.lowest.mode), share
        )
        self.on_event(event, x)
        return event

    def _cross(self, s: float, target: float, trial: PETSc.Vec) -> tuple[float, PETSc.Vec]:
        watch, newton, count = self.watch, self.newton, self.watch.negative
        assert self._stable is not None
        if newton.linear.is_cheap_to_factor and not newton.linear.direct:
            newton.factor_from_now_on(s)
        start = self._stable.s
        known = Known(target, trial.copy(), watch.history[-1][1])
        before, after, where = watch.locate(self._stable, known)
        self._stable = before
        near = before if abs(before.value) < abs(after.value) else after
        newton.set_pseudo_time(near.s)
        watch.find_mode(near.x)
        kind = "bifurcation" if self._along(near.x, start, target) <= ACROSS else "loss of stability"
        mode = watch.lowest.mode.copy()
        cause = cause_of(newton.assembly, near.x, mode)
        found, done = (target, trial), "the path goes on with unstable states"
        if self.policy == "stop":
            done = 'the path ends here, as statics.on_bifurcation = "stop" asks'
        elif self.policy == "follow":
            entered = min(target, max(where, s) + max(BEYOND * (where - start), 1e-6))
            found, done = self._branch(entered, before, after, mode, (target, trial))
        place = place_of(newton.assembly, mode)
        event = CriticalPoint(kind, where, (before.s, after.s), count, *place, done, cause.kind)
        newton.set_pseudo_time(near.s)
        self.on_event(event, near.x)
        if self.policy == "stop":
            self._ends = ended_at(event, cause)
            if before.s <= s:
                self.stop_if_asked()
            found = before.s, before.x.copy()
        newton.set_pseudo_time(found[0])
        after.x.destroy()
        if found[1] is not trial:
            trial.destroy()
        if watch.stable:
            self.remember(*found)
        return found

    def _branch(self, s: float, before: Known, after: Known, mode: NDArray, unstable):
        """The stable state beside the path at s, and what was done in words; the unstable one where there is none."""
        self.newton.factor_from_now_on(s, "the stable branch is looked for")
        x = before.x.copy()
        if after.s > before.s:
            part = (s - before.s) / (after.s - before.s)
            x.scale(1.0 - part)
            x.axpy(part, after.x)
        self.newton.assembly.set_driven(x, s)
        found = stable_neighbour(self.newton, self.watch, s, x, signed(self.newton.assembly, mode))
        if found is None:
            x.destroy()
            return unstable, "no stable state was found beside it: the path goes on with unstable ones"
        self._followed = True
        self.watch.negative = 0
        self.watch.history.append((s, found))
        return (s, x), f"the path takes the stable branch, entered at pseudo-time {s:.6g}"

    def _along(self, x: PETSc.Vec, s: float, target: float) -> float:
        """Size of the cosine between the mode and what drives the path on."""
        rhs, increment = self.newton.push(x, s, target)
        mode, push = self.watch.lowest.mode.ravel(), rhs.array_r
        sums = np.array([mode @ push, mode @ mode, push @ push])
        both, one, other = combined(self.newton.comm, sums)
        rhs.destroy()
        increment.destroy()
        return abs(both) / np.sqrt(one * other) if one * other > 0.0 else 0.0


def signed(assembly: Assembly, mode: NDArray) -> NDArray:
    """The mode (n, 3) with the sign that its place and direction say. Collective."""
    own = assembly.model.own_positions
    _, along = place_of(assembly, mode)
    moved = assembly.along_axes(mode)
    place = int(np.argmax(np.linalg.norm(moved[own], axis=1))) if len(own) else -1
    best = (0.0, 1.0)
    if place >= 0:
        v = moved[own[place]]
        best = (float(np.linalg.norm(v)), float(np.sign(v @ np.array(along)) or 1.0))
    return mode * max(assembly.comm.allgather(best), key=lambda item: item[0])[1]


def ended_at(event: CriticalPoint, cause: Cause) -> NoEquilibrium:
    """The end of a path that was to end at a critical point."""
    words = "; ".join(filter(None, (event.words(), cause.words())))
    return NoEquilibrium(words, {**cause.facts(), "kind": cause.kind})


def place_of(assembly: Assembly, mode: NDArray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Where a mode (n, 3) moves most, undeformed and in the file's coordinates, and the unit vector along which. Of places
    that differ by rounding, the first of the file. Collective.
    """
    model, comm, mode = assembly.model, assembly.comm, assembly.along_axes(mode)
    own = model.own_positions
    size = np.linalg.norm(mode[own], axis=1)
    largest = combined(comm, float(size.max(initial=0.0)), MPI.MAX)
    chosen = own[size >= 0.999 * largest] if largest else own[:0]
    rows = model.numbering.file_nodes[chosen]
    best: tuple[int, tuple[float, ...], tuple[float, ...]] = (np.iinfo(np.int64).max, (0.0,) * 3, (0.0,) * 3)
    if len(chosen):
        v = chosen[np.argmin(rows)]
        along = mode[v] / np.linalg.norm(mode[v])
        main = np.argmax(np.abs(along) > 0.999 * np.abs(along).max())
        along = np.where(np.abs(along) < 1e-9, 0.0, along * np.sign(along[main]))
        at = model.origin + model.reference[v]
        best = (int(rows.min()), tuple(map(float, at)), tuple(map(float, along)))
    return min(comm.allgather(best), key=lambda item: item[0])[1:]
