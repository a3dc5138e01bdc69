"""What was changed on the way: steps cut, other predictors, line searches and linear solvers, each with its reason."""

from __future__ import annotations

from typing import Any

MOST_ENTRIES = 1000
"""Entries that are kept; the rest is counted."""
CUTS = ("halved", "shortened", "rejected")
"""Actions that repeat a step with a shorter one."""


class StepControl:
    """A list of entries, oldest first. clock: "pseudo_time" or "time", where an entry's step begins. cuts: of CUTS."""

    def __init__(self, clock: str = "pseudo_time") -> None:
        self.clock = clock
        self.cuts = self.left_out = 0
        self.entries: list[dict[str, Any]] = []

    def note(self, action: str, reason: str, at: float, size: float | None = None, *, count: int = 1) -> None:
        """action: what was done: one of CUTS, "predictor", "line search", "factored", "dynamics". size: of the step tried
        next. count: how often.
        """
        self.cuts += count * (action in CUTS)
        if len(self.entries) >= MOST_ENTRIES:
            self.left_out += 1
            return
        entry: dict[str, Any] = {"action": action, self.clock: at, "reason": reason}
        if size is not None:
            entry["size"] = size
        if count > 1:
            entry["count"] = count
        self.entries.append(entry)

    def add(self, other: StepControl, where: str) -> None:
        """The entries of another one, their reasons preceded by where they belong."""
        for entry in other.entries:
            more = {"size": entry.get("size"), "count": entry.get("count", 1)}
            self.note(entry["action"], f"{where}{entry['reason']}", entry[other.clock], **more)
        self.left_out += other.left_out

    def state(self) -> dict[str, Any]:
        """What was noted so far."""
        return {"cuts": self.cuts, "left_out": self.left_out, "entries": self.entries}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state."""
        self.cuts, self.left_out = state["cuts"], state["left_out"]
        self.entries[:] = state["entries"]

    def facts(self) -> dict[str, Any]:
        """For the summary."""
        return {"cuts": self.cuts, "step_control": self.entries, "step_control_left_out": self.left_out}
