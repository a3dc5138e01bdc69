"""What a benchmark is, and the blocks that several of them press."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

CUBE_74K, CUBE_480K = "cube:0.0025", "cube:0.00135"
BLOCK_9K = {"name": "block", "mesh": "cube_m2", "stroke": 0.015, "steps": 10}
BLOCK_74K = {"name": "block", "mesh": CUBE_74K, "stroke": 0.010, "steps": 10}
BLOCK_480K = {"name": "block", "mesh": CUBE_480K, "stroke": 0.005, "steps": 10}
FORCE_9K = {"force": -2110.66766346, "elements": 9670}
FORCE_74K = {"force": -1544.8400796, "elements": 73606}
FORCE_480K = {"force": -847.8394655, "elements": 478059}
ALL, SOLUTION = ("read", "setup", "solve", "output"), ("solve",)


@dataclass(frozen=True)
class Row:
    """A benchmark.

    measure, task: which measurement of `measure`, and its arguments. unit: of a sample. target: the most that
    is wanted (the least where `more` is better). allowed: how far the answer may be from the known one.
    part: a value among the facts of another row, `of`; gain: how many times faster `of` is than `gain`.
    small: for --quick.
    """

    name: str
    about: str
    measure: str = ""
    task: dict[str, Any] = field(default_factory=dict)
    unit: str = "s"
    target: float | None = None
    allowed: float | None = None
    ranks: int = 1
    repetitions: int = 5
    more: bool = False
    small: bool = False
    of: str = ""
    part: str = ""
    gain: str = ""


def press(problem: dict[str, Any], known: dict[str, Any], parts: Sequence[str] = ALL) -> dict[str, Any]:
    """The task of a block's run, warmed up by one step of a small one."""
    return {"problem": problem, "known": known, "parts": parts, "warm_up": {**BLOCK_9K, "steps": 1}}
