"""Every shipped case gives the numbers of its expected.toml, which says why they are right.

An entry of [[expect]] names the case file, changes (`set`), a table (curve or probes), a column, the row
(the last, or the one where another column has a value), the value and a tolerance, absolute or relative.
"""

from __future__ import annotations

import tomllib
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from ancf_petsc import load_case, run

CASES = Path(__file__).resolve().parent.parent / "cases"


def runs() -> list[tuple[str, str, tuple[str, ...], list[dict]]]:
    """Expectations by run: folder, case file, changes."""
    found = []
    for file in sorted(CASES.glob("*/expected.toml")):
        entries = tomllib.loads(file.read_text())["expect"]
        key = lambda entry: (entry.get("case", "case.toml"), tuple(entry.get("set", ())))  # noqa: E731
        for (case, changes), group in groupby(sorted(entries, key=key), key):
            found.append((file.parent.name, case, changes, list(group)))
    return found


@pytest.mark.parametrize(("folder", "case", "changes", "entries"), runs(), ids=lambda value: str(value)[:60])
def test_case_gives_its_expected_numbers(folder, case, changes, entries, tmp_path):
    result = run(load_case(CASES / folder / case, changes), tmp_path / "run")
    for entry in entries:
        table = getattr(result, entry.get("table", "curve"))
        row = -1
        if "where" in entry:
            ((name, value),) = entry["where"].items()
            row = int(np.argmin(np.abs(table[name] - value)))
            assert table[name][row] == pytest.approx(value, rel=1e-9, abs=1e-12)
        tolerance = {"rel": entry.get("relative", 0.0), "abs": entry.get("absolute", 0.0)}
        assert table[entry["column"]][row] == pytest.approx(entry["value"], **tolerance), entry


def test_every_case_says_what_it_is_and_what_to_expect():
    for folder in (path.parent for path in CASES.glob("*/case.toml")):
        assert (folder / "README.md").exists(), folder
        assert (folder / "expected.toml").exists(), folder
