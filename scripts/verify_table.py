"""The table of checks that `scripts/verify` runs: one small function a check, which yields rows."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]


@dataclass(frozen=True)
class Row:
    """What the program computes beside what is known.

    found, reference: numbers in `unit`; no reference where the number found is itself an error or a measure. error: what is
    held against bound, from `relative` or `absolute`. bound: the largest error there may be, None where there is no claim.
    """

    what: str
    found: float
    reference: float | None
    error: float
    bound: float | None
    unit: str = ""
    note: str = ""

    @property
    def holds(self) -> bool:
        """False also where the error is no number."""
        return self.bound is None or self.error <= self.bound


def relative(what: str, found: float, reference: float, bound: float, unit: str = "", note: str = "") -> Row:
    """A number against another, its error in parts of that."""
    found, reference = float(found), float(reference)
    return Row(what, found, reference, abs(found / reference - 1.0), bound, unit, note)


def absolute(what: str, found: float, reference: float, bound: float, unit: str = "", note: str = "") -> Row:
    """A number against another, its error in their unit."""
    found, reference = float(found), float(reference)
    return Row(what, found, reference, abs(found - reference), bound, unit, note)


def measure(what: str, found: float, bound: float | None, unit: str = "", note: str = "") -> Row:
    """A distance or a drift, which is itself an error."""
    return Row(what, float(found), None, abs(float(found)), bound, unit, note)


Maker = Callable[[Path], Iterator[Row]]


@dataclass(frozen=True)
class Check:
    """name: for --only. section: heading of the page. source: where the reference comes from, in words."""

    name: str
    section: str
    source: str
    rows: Maker


CHECKS: list[Check] = []


def check(section: str, source: str) -> Callable[[Maker], Maker]:
    """Enter a function of a folder for its files, which yields rows, into the table under its own name."""

    def enter(rows: Maker) -> Maker:
        CHECKS.append(Check(rows.__name__, section, source, rows))
        return rows

    return enter
