"""docs/verification.md is what docs/verification/*.json say; what is beyond its bound, or caught by no test, shows."""

from __future__ import annotations

import importlib
import json
import sys

import pytest


@pytest.fixture
def modules(project, monkeypatch):
    """verify_table and verify_page of scripts/."""
    monkeypatch.setattr(sys, "path", [str(project / "scripts"), *sys.path])
    return [importlib.import_module(name) for name in ("verify_table", "verify_page")]


def test_an_error_beyond_its_bound_does_not_hold_nor_one_that_is_no_number(modules):
    table, _ = modules
    assert table.relative("a", 1.01, 1.0, 0.02).holds
    assert not table.relative("a", 1.03, 1.0, 0.02).holds
    assert not table.absolute("a", float("nan"), 1.0, 0.02).holds
    assert table.measure("a", -3.0, None).holds
    assert not table.measure("a", -3.0, 2.0).holds


def test_the_page_marks_what_fails_and_what_survives(modules, monkeypatch, tmp_path):
    table, page = modules
    rows = [vars(row) | {"holds": row.holds} for row in (table.relative("x | y", 1.03, 1.0, 0.02, "N"),)]
    checks = {
        "version": "0",
        "versions": "numpy 0",
        "checks": [{"name": "a_b", "section": "S", "source": "s", "rows": rows}],
    }
    change = {"name": "wrong sign", "file": "a.py", "breaks": "all", "why": "a reason", "caught_by": ""}
    for name, data in (
        ("CHECKS", checks),
        ("MUTATIONS", [change, change | {"caught_by": "tests/test_a.py::test_b"}]),
    ):
        monkeypatch.setattr(page, name, tmp_path / f"{name}.json")
        (tmp_path / f"{name}.json").write_text(json.dumps(data))
    monkeypatch.setattr(page, "PAGE", tmp_path / "page.md")
    lines = page.write_page().read_text().splitlines()
    assert "| x \\| y | 1.03 N | 1 N | 0.03 | 0.02 | **beyond its bound**  |" in lines
    assert "0 of 1 numbers are within their bounds." in lines
    assert "| wrong sign | `a.py` | all | a reason |" in lines
    assert "| wrong sign | `a.py` | all | `test_a.py::test_b` |" in lines
    assert any("1 are caught (50 %)" in line for line in lines)


def test_the_page_in_docs_is_the_one_of_its_data(modules, project, monkeypatch, tmp_path):
    page = modules[1]
    monkeypatch.setattr(page, "PAGE", tmp_path / "page.md")
    again = page.write_page().read_text()
    assert again == (project / "docs" / "verification.md").read_text(), "run scripts/verify --page"
    data = json.loads((project / "docs" / "verification" / "checks.json").read_text())
    assert all(row["holds"] for check in data["checks"] for row in check["rows"])


def test_nine_of_ten_wrong_changes_are_caught_and_survivors_have_a_reason(project):
    rows = json.loads((project / "docs" / "verification" / "mutations.json").read_text())
    survivors = [row for row in rows if not row["caught_by"]]
    assert rows
    assert len(rows) >= 60
    assert len(survivors) <= 0.1 * len(rows)
    assert all(row["why"] for row in survivors)
