"""Every number of the expected.toml of the cases in motion."""

from __future__ import annotations

import tomllib

import pytest
from motion_cases import CASES, run_of

from ancf_petsc.results.tables import read_table

FOLDERS = ("bar_tension", "pendulum", "ellipsograph", "tumbling_block", "stiff_pendulum")


def expectations():
    for folder in FOLDERS:
        for row in tomllib.loads((CASES / folder / "expected.toml").read_text())["value"]:
            yield pytest.param(folder, row, id=f"{folder}/{row['case']} {row['column']} {row['row']}")


@pytest.mark.parametrize(("folder", "row"), list(expectations()))
def test_a_case_gives_what_it_should(folder, row):
    run, _ = run_of(f"{folder}/{row['case']}")
    found = read_table(run / row["table"])[row["column"]][row["row"]]
    tolerance = {"rel": row["relative"], "abs": 0.0} if "relative" in row else {"abs": row["absolute"]}
    assert found == pytest.approx(row["value"], **tolerance), row["reason"]
    assert len(row["reason"]) > 20


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_readme_says_it_in_three_lines(folder):
    title, empty, *lines = (CASES / folder / "README.md").read_text().splitlines()
    assert title.startswith("# ")
    assert empty == ""
    assert len(lines) == 3
