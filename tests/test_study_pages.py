"""The pages of the shipped studies: they say what the kept tables hold, and every study file is sound."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import re
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(PROJECT / "scripts"))

import accuracy_page  # noqa: E402
import study_folders  # noqa: E402
from study_list import KEPT, PICTURES, STUDIES  # noqa: E402

from ancf_petsc.post.charts.draw import charts_wanted  # noqa: E402
from ancf_petsc.post.charts.study_table import read_study  # noqa: E402
from ancf_petsc.studies.read import load_study  # noqa: E402


@pytest.fixture(scope="module")
def script():
    loader = importlib.machinery.SourceFileLoader("study_pages", str(PROJECT / "scripts/study_pages"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("study_pages", loader))
    loader.exec_module(module)
    return module


def test_every_study_file_beside_a_case_is_listed_and_sound():
    files = {study.path for study in STUDIES}
    assert files == set(PROJECT.glob("cases/*/study_*.toml"))
    for file in files:
        assert load_study(file).spec.chart, file


def test_the_pages_say_what_the_kept_tables_hold(script):
    for name, blocks in script.PAGES.items():
        text = (PROJECT / "docs" / name).read_text()
        assert script.filled(text, blocks) == text, name


def test_every_picture_of_a_page_is_drawn_from_a_kept_table(script):
    for name in script.PAGES:
        shown = re.findall(r"pictures/studies/(\w+)/(\w+)\.png", (PROJECT / "docs" / name).read_text())
        assert shown
        for study, chart in shown:
            assert (PICTURES / study / f"{chart}.png").is_file(), (study, chart)
            assert chart in {wanted.file_name for wanted in charts_wanted(read_study(KEPT / study))}


def test_the_cheapest_run_within_an_error_is_named(tmp_path):
    study = read_study(study_folders.ladder(tmp_path / "ladder"))
    problem = accuracy_page.Problem("ladder", "force", ("mesh.element", "mesh.size", "mesh.rim"))
    assert accuracy_page.cheapest(study.rows, "force", 0.05).text("run") == "runs/3-10-1-3_0.016"
    assert accuracy_page.sentence(problem, study, 0.01) == (
        "- **1 %: 3443 with edges of 16 mm: 732 degrees of freedom, 0.086 s, error 0.16 % (known to 0.01 %).**"
    )
    assert accuracy_page.cheapest(study.rows, "force", 1e-6) is None
    assert accuracy_page.sentence(problem, study, 1e-6).startswith(
        "- **0.0001 %**: none of these; the nearest, 3443 with edges of 4 mm, is off by 0.0026 %"
    )


def test_runs_that_shared_the_machine_are_not_the_quickest(tmp_path):
    study = read_study(study_folders.ladder(tmp_path / "ladder"))
    rows = [row for row in study.rows if row.text("mesh.element") == "3413"]
    assert (
        accuracy_page.cheapest(rows, "force", 0.02).text("mesh.size") == "0.002"
    )  # that of 4 mm was not alone
    shared = [row for row in rows if not row.alone]
    assert accuracy_page.seconds(accuracy_page.cheapest(shared, "force", 0.02)) == accuracy_page.SHARED
