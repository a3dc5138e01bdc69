"""Ladders within a study: runs that differ in one key that refines, and the orders they show."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ancf_petsc.studies.richardson import Ladder, LadderLimit, extrapolate
from ancf_petsc.studies.rows import RunRow
from ancf_petsc.studies.spec import QuantitySpec

MESHES = ("mesh.size", "mesh.refine", "mesh.divisions", "mesh.rim", "mesh.file")
"""Keys that make meshes finer: the size of a level is that of its elements."""
STEP = "dynamics.step"
NUMBERS = (STEP, "dynamics.tolerance", "statics.tolerance")
COUNTS = ("statics.steps",)
LADDERS = (*MESHES, *NUMBERS, *COUNTS)
MESH = "mesh"
"""All keys of the mesh together, where none of them alone makes levels."""


@dataclass(frozen=True)
class LadderLine:
    """A ladder of one quantity. key: what its levels differ in. values: of the other keys that runs differ in.

    rows: finished ones, coarse to fine. sizes: of the levels.
    """

    quantity: str
    key: str
    values: dict[str, Any]
    rows: list[RunRow]
    sizes: list[float]
    result: LadderLimit


def ladder_keys(keys: Sequence[str], rows: Sequence[RunRow]) -> list[str]:
    """The keys of a study that make ladders, the most telling first; MESH where mesh keys do so together only."""
    differing = [
        key for key in LADDERS if key in keys and len({_text(row.run.values[key]) for row in rows}) > 1
    ]
    meshes = [key for key in differing if key in MESHES]
    if len(meshes) > 1 and max(_longest(key, keys, rows) for key in meshes) < 3:
        return [MESH, *(key for key in differing if key not in MESHES)]
    return differing


def lines_of(
    quantity: str, asked: QuantitySpec, key: str, keys: Sequence[str], rows: Sequence[RunRow]
) -> list[LadderLine]:
    """The ladders along a key, one for each combination of the others."""
    together = [name for name in keys if name in MESHES] if key == MESH else [key]
    others = [name for name in keys if name not in together and _differs(name, rows)]
    groups: dict[str, list[RunRow]] = {}
    for row in rows:
        groups.setdefault(_text([row.run.values[name] for name in others]), []).append(row)
    return [_line(quantity, asked, key, others, group) for group in groups.values()]


def size_of(row: RunRow, key: str) -> float:
    """The size of a level: of elements, of a step, of a tolerance. 0 where there is none."""
    if key in (*MESHES, MESH):
        return row.run.facts.h if row.run.facts else 0.0
    value = row.run.values.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
        return 0.0
    return 1.0 / value if key in COUNTS else float(value)


def _line(quantity: str, asked: QuantitySpec, key: str, others: list[str], group: list[RunRow]) -> LadderLine:
    ordered = sorted(group, key=lambda row: -size_of(row, key))
    values = {name: ordered[0].run.values[name] for name in others}
    good = [
        row for row in ordered if quantity in row.found and row.counts_for(asked) and size_of(row, key) > 0
    ]
    sizes = [size_of(row, key) for row in good]
    finest = min(sizes, default=0.0)
    lost = [row for row in ordered if row.status == "failed" and 0 < size_of(row, key) < finest]
    if lost:
        words = f"finer levels end before it ({lost[0].outcome}): there is no limit to be seen"
        return LadderLine(quantity, key, values, good, sizes, LadderLimit("not asymptotic", words))
    result = _extrapolated(quantity, asked, key, good, sizes)
    return LadderLine(quantity, key, values, good, sizes, result)


def _extrapolated(
    quantity: str, asked: QuantitySpec, key: str, rows: list[RunRow], sizes: list[float]
) -> LadderLimit:
    values = [row.found[quantity] for row in rows]
    formal = stretches = None
    exact = _method_order(rows) if key == STEP else None
    if key in (*MESHES, MESH):
        orders = {row.run.facts.order for row in rows if row.run.facts}
        formal = 2.0 * max(orders) if orders else None
        if len(rows) >= 3:
            seen = [row.stretch_at(asked) for row in rows]
            stretches = None if None in seen else [stretch for stretch in seen if stretch is not None]
    return extrapolate(Ladder(sizes, values, formal, stretches, exact=exact))


def _method_order(rows: Sequence[RunRow]) -> int | None:
    """The order of the integrator that all rows have."""
    orders = {row.run.case.spec.dynamics.method_order for row in rows if row.run.case.spec.dynamics}
    return orders.pop() if len(orders) == 1 else None


def _longest(key: str, keys: Sequence[str], rows: Sequence[RunRow]) -> int:
    """Levels of the longest ladder along a key."""
    groups: dict[str, set[str]] = {}
    for row in rows:
        others = _text([row.run.values[name] for name in keys if name != key])
        groups.setdefault(others, set()).add(_text(row.run.values[key]))
    return max((len(levels) for levels in groups.values()), default=0)


def _differs(key: str, rows: Sequence[RunRow]) -> bool:
    return len({_text(row.run.values[key]) for row in rows}) > 1


def _text(value: Any) -> str:
    return json.dumps(value, default=str)
