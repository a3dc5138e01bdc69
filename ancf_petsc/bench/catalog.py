"""The benchmarks there are, and choosing among them."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from ancf_petsc.bench.row import Row
from ancf_petsc.bench.sweeps import SWEEPS
from ancf_petsc.bench.table import TABLE
from ancf_petsc.errors import CaseError, did_you_mean

ROWS = {row.name: row for row in [*TABLE, *SWEEPS]}


def choose(names: Sequence[str], *, quick: bool) -> list[Row]:
    """The rows with these names, beginnings (accuracy, scaling/messages) or patterns; else the table's.

    Derived rows bring what they are derived from. Raises CaseError for a name that fits none.
    """
    chosen = [row for row in TABLE if row.small or not quick] if not names else []
    for name in names:
        found = [
            row for row in ROWS.values() if row.name.startswith(f"{name}/") or fnmatchcase(row.name, name)
        ]
        if not found:
            cure = did_you_mean(name, list(ROWS)) or "ancf bench --list"
            raise CaseError("no such benchmark", key="NAME", got=name, cure=cure)
        chosen += [row for row in found if row.small or not quick]
    needed = [ROWS[name] for row in chosen for name in (row.of, row.gain) if name]
    wanted = {row.name for row in [*needed, *chosen]}
    return [row for row in ROWS.values() if row.name in wanted]
