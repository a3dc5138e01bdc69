"""Studies as they run: every run once, failures as rows, references, what is reused and what is done again."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from tiny_studies import CASE, STUDY, InProcess, lasting, table, write

from ancf_petsc.cli import main
from ancf_petsc.errors import CaseError
from ancf_petsc.studies import runner
from ancf_petsc.studies.quantity import Tables, value_of
from ancf_petsc.studies.record import held, record_file
from ancf_petsc.studies.spec import QuantitySpec
from ancf_petsc.studies.study import Options, run_study


@pytest.fixture(autouse=True)
def _in_process(monkeypatch):
    monkeypatch.setattr(runner, "Process", InProcess)
    monkeypatch.setattr(InProcess, "commands", [])


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The study of six runs, done one at a time."""
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "Process", InProcess)
        return run_study(write(folder), folder / "out", Options(jobs=1))


def test_one_tidy_row_a_run(finished):
    rows = table(finished.folder)
    keys = ["mesh.element", "mesh.divisions", "status", "outcome", "reason"]
    asked = [f"{name}{end}" for name in ("force", "energy") for end in ("", "_error", "_uncertainty")]
    sizes = ["elements", "dof", "h", "ranks", "steps", "newton", "linear", "solve_seconds", "total_seconds"]
    assert list(rows[0]) == [*keys, *asked, *sizes, "seconds_alone", "memory_peak_bytes", "run"]
    assert [row["mesh.divisions"] for row in rows] == 2 * ["[2, 1, 1]", "[4, 1, 1]", "[8, 1, 1]"]
    assert {row["status"] for row in rows} == {"done"}
    for row in rows:
        folder = finished.folder / row["run"]
        summary = json.loads((folder / "summary.json").read_text())
        curve = np.genfromtxt(folder / "curve.csv", delimiter=",", names=True)
        assert float(row["force"]) == curve["force"][1]  # half the stroke, the first of two steps
        assert float(row["energy"]) == curve["strain_energy"][-1]
        assert int(row["dof"]) == summary["dof"]
        assert float(row["h"]) == pytest.approx((0.01 / summary["elements"]) ** (1 / 3))
        assert float(row["total_seconds"]) == summary["seconds"]["total"]
        assert int(row["memory_peak_bytes"]) == sum(summary["memory_peak_bytes"])


def test_errors_are_against_the_references(finished):
    facts = json.loads((finished.folder / "study.json").read_text())
    rows, finest = table(finished.folder), facts["quantities"]["energy"]["reference"]
    assert finest["kind"] == "finest"
    assert finest["value"] == float(rows[5]["energy"])
    for row in rows:
        assert float(row["energy_error"]) == pytest.approx(abs(float(row["energy"]) / finest["value"] - 1))
    assert facts["quantities"]["force"]["unit"] == "N"
    assert facts["axes"][1] == {"key": "mesh.divisions", "values": [[2, 1, 1], [4, 1, 1], [8, 1, 1]]}
    lines = [order for order in facts["orders"] if order["quantity"] == "force"]
    assert [line["line"] for line in lines] == [{"mesh.element": "3413"}, {"mesh.element": "3-10-1-3"}]
    limit = facts["quantities"]["force"]["reference"]
    asymptotic = [line for line in lines if line["verdict"] == "asymptotic"]
    assert (limit["value"] is not None) == bool(asymptotic)
    if asymptotic:
        best = min(asymptotic, key=lambda line: line["uncertainty"] * abs(line["limit"]))
        assert limit["value"] == best["limit"]


def test_what_is_done_is_not_done_again(finished, tmp_path):
    copy = tmp_path / "out"
    shutil.copytree(finished.folder, copy)
    (copy / "study.csv").unlink()
    file = write(tmp_path)
    run_study(file, copy)
    assert InProcess.commands == []
    assert table(copy) == table(finished.folder)
    file.write_text(STUDY.replace("[2, 1, 1], ", "[2, 1, 1], [3, 1, 1], "))
    run_study(file, copy)
    assert len(InProcess.commands) == 2
    assert len(table(copy)) == 8


def test_interrupted_killed_and_broken_runs_are_done_again(finished, tmp_path):
    copy = tmp_path / "out"
    shutil.copytree(finished.folder, copy)
    names = [row["run"].removeprefix("runs/") for row in table(copy)]
    summary = copy / "runs" / names[0] / "summary.json"
    said = json.loads(summary.read_text())
    summary.write_text(json.dumps(said | {"status": "interrupted"}))
    (copy / "runs" / names[1] / "summary.json").unlink()  # as a killed run leaves its folder
    record = record_file(copy / "runs", names[1])
    record.write_text(record.read_text()[:40])  # cut short
    record = record_file(copy / "runs", names[2])
    record.write_text(json.dumps(json.loads(record.read_text()) | {"code": -9}))
    shutil.rmtree(copy / "runs" / names[3])
    run_study(write(tmp_path), copy, Options(jobs=1))
    assert len(InProcess.commands) == 4
    assert lasting(copy) == lasting(finished.folder)


@pytest.mark.parametrize(
    ("status", "kind", "code", "outcome"),
    [
        ("done", "reached", 0, "reached"),
        ("done", "reached", None, "reached"),  # its study was killed meanwhile
        ("stopped", "surface_fold", 3, "surface_fold"),
        ("stopped", "surface_fold", None, "surface_fold"),
        ("stopped", "environment", None, None),
        ("interrupted", "interrupted", 130, None),
        (None, None, None, None),
        (None, None, 2, "wrong_input"),
        (None, None, 4, "crashed"),
        (None, None, -9, "crashed"),
    ],
)
def test_how_runs_ended(status, kind, code, outcome, tmp_path):
    from ancf_petsc.studies.ending import read_end

    if status:
        end = {"kind": kind, "message": "why"}
        said = {"status": status, "hash": "abc", "end": end, "versions": {"ancf_petsc": "1"}}
        (tmp_path / "summary.json").write_text(json.dumps(said))
    found = read_end(tmp_path, "abc", "1", {"code": code, "reason": "because"})
    assert (found and found.outcome) == outcome
    if found is not None:
        assert found.final == (outcome != "crashed")
        assert (found.status == "done") == (outcome == "reached")
    other = read_end(tmp_path, "another case", "1", {})
    assert other is None


def test_shares_of_a_study_make_the_whole_table(finished, tmp_path):
    file = write(tmp_path)
    run_study(file, tmp_path / "out", Options(jobs=1, only=(1, 2)))
    rows = table(tmp_path / "out")
    assert len(InProcess.commands) == 3
    assert len(rows) == 6
    assert [row["status"] for row in rows].count("skipped") == 3
    run_study(file, tmp_path / "out", Options(jobs=1, only=(2, 2)))
    assert len(InProcess.commands) == 6
    assert lasting(tmp_path / "out") == lasting(finished.folder)


def test_failures_are_rows_with_their_reason(tmp_path):
    """svk pressed beyond its limit, a mesh without the element's cells, and a run that reaches its end."""
    case = CASE.replace("z = -0.05", "x = -0.01").replace('"end.z"', '"end.x"').replace("3413", "3-10-1-3")
    study = """
title = "Pressed"
case = "case.toml"
[[rows]]
"constraint.end.move.x" = -0.01
[[rows]]
"constraint.end.move.x" = -0.9
"statics.smallest_step" = 0.05
[[rows]]
"mesh.element" = "3813"
[quantity]
force = { column = "force", at = "end" }
reached = { column = "stroke", at = "end" }
shortest = { summary = "end.smallest_stretch" }
[reference]
force = "finest"
"""
    outcome = run_study(write(tmp_path, study, case), tmp_path / "out", Options(jobs=1))
    done, failed, wrong = table(outcome.folder)
    assert (done["status"], done["outcome"], done["reason"]) == ("done", "reached", "")
    assert failed["status"] == "failed"
    assert failed["outcome"] not in ("", "crashed", "reached", "wrong_input")
    assert failed["reason"]
    assert -0.9 < float(failed["reached"]) < 0.0
    assert failed["force_error"] == ""  # it has no end to compare
    assert 0 < float(failed["shortest"]) < 1
    assert (wrong["status"], wrong["outcome"]) == ("skipped", "wrong_input")
    assert "hexahedr" in wrong["reason"]
    commands = len(InProcess.commands)
    run_study(tmp_path / "study.toml", outcome.folder)
    assert len(InProcess.commands) == commands  # no equilibrium further on is an answer


def test_references_by_number_file_and_a_further_run(finished, tmp_path):
    text = STUDY.replace('"mesh.divisions" = [[2, 1, 1], [4, 1, 1], [8, 1, 1]]\n', "")
    text = text.replace('force = "richardson"', 'force = "known.csv"').replace(
        'energy = "finest"', 'energy = { "mesh.element" = "3-10-1-3", "mesh.divisions" = [8, 1, 1] }'
    )
    (tmp_path / "known.csv").write_text("stroke,force\n0,0\n-0.025,-2.0\n-0.05,-4.0\n")
    outcome = run_study(write(tmp_path, text), tmp_path / "out", Options(jobs=1))
    rows = table(outcome.folder)
    assert len(rows) == 2  # the further run is no row
    assert len(InProcess.commands) == 3
    whole = {(row["mesh.element"], row["mesh.divisions"]): row for row in table(finished.folder)}
    known = float(whole["3-10-1-3", "[8, 1, 1]"]["energy"])
    for row in rows:
        assert float(row["force_error"]) == pytest.approx(abs(float(row["force"]) / -2.0 - 1))
        assert float(row["energy_error"]) == pytest.approx(abs(float(row["energy"]) / known - 1))
    (tmp_path / "known.csv").write_text("stroke,force\n0,0\n-0.02,-2.0\n")
    with pytest.raises(CaseError, match="reference.force.*no output at stroke 0.025"):
        run_study(tmp_path / "study.toml", tmp_path / "out")


@pytest.mark.parametrize(("text", "reduce"), [("nan", "max"), ("inf", "mean")])
def test_a_number_that_is_not_finite_is_none(text, reduce, tmp_path):
    """It would end Richardson's fit, or be the limit of everything."""
    (tmp_path / "known.csv").write_text(f"stroke,force\n0,0\n0.1,{text}\n")
    for asked in (QuantitySpec(column="force", at="end"), QuantitySpec(column="force", reduce=reduce)):
        with pytest.raises(CaseError, match="known.csv: not a finite number"):
            value_of(asked, Tables(tmp_path / "known.csv"))


def test_series_against_a_reference(tmp_path):
    text = """
title = "Steps"
case = "case.toml"
[vary]
"statics.steps" = [2, 4]
[quantity]
path = { column = "force", reduce = "rms", against = "reference" }
peak = { column = "force", reduce = "max", against = "reference" }
[reference]
path = { "mesh.element" = "3-10-1-3", "statics.steps" = 4 }
peak = { "mesh.element" = "3-10-1-3", "statics.steps" = 4 }
"""
    outcome = run_study(write(tmp_path, text), tmp_path / "out", Options(jobs=1))
    by_name = {row.run.name: row for row in outcome.rows}
    other = next(row for row in by_name.values() if not row.run.in_table).tables.columns["force"]
    for row in outcome.rows[:2]:
        force = row.tables.columns["force"]
        known = other[:: 4 // (len(force) - 1)]
        weights = np.full(len(force), 1.0)
        weights[[0, -1]] = 0.5  # trapezoidal rule over equal steps
        rms = np.sqrt((weights * (force - known) ** 2).sum() / (weights * known**2).sum())
        assert row.found["path"] == pytest.approx(rms, rel=1e-12)
        assert row.found["peak"] == pytest.approx(abs(force - known).max() / abs(known).max(), rel=1e-12)
    cells = table(outcome.folder)[0]
    assert cells["path_error"] == cells["path"]


def test_a_run_that_another_study_holds_is_left_to_it(tmp_path, monkeypatch):
    """It is looked at again until it is done; here the other one gives it up."""
    monkeypatch.setattr(runner, "LOOK_AGAIN", 0.01)
    file = write(tmp_path, STUDY.replace('"3413", "3-10-1-3"', '"3413"'))
    looks = []
    outcome = run_study(file, tmp_path / "first", Options(jobs=1))
    name = outcome.rows[0].run.name
    InProcess.commands.clear()
    lock = record_file(tmp_path / "out" / "runs", name)
    lock.parent.mkdir(parents=True)
    holding = held(lock)
    holding.__enter__()

    def look(now):
        looks.append(now)
        if now.done == 2 and len(looks) > 4:
            holding.__exit__(None, None, None)

    run_study(file, tmp_path / "out", Options(jobs=1), look)
    assert len(InProcess.commands) == 3
    assert InProcess.commands[-1][-2].endswith(name)  # the one held came last
    assert looks[-1].done == 3


def test_timing_repeats_alone_what_ran_beside_others(finished, tmp_path):
    copy = tmp_path / "out"
    shutil.copytree(finished.folder, copy)
    for record in (copy / "runs").glob("*.json"):
        record.write_text(json.dumps(json.loads(record.read_text()) | {"alone": False}))
    run_study(write(tmp_path), copy)
    assert {row["seconds_alone"] for row in table(copy)} == {"false"}
    run_study(tmp_path / "study.toml", copy, Options(timing=True))
    assert len(InProcess.commands) == 6
    assert lasting(copy) == lasting(finished.folder)
    old, new = table(finished.folder), table(copy)
    assert [row["total_seconds"] for row in new] != [row["total_seconds"] for row in old]
    assert not list((copy / "runs").glob("*.timing"))


def test_what_the_command_line_says(finished, tmp_path, capsys):
    shutil.copytree(finished.folder, tmp_path / "out")
    assert main(["study", str(write(tmp_path)), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "energy: reference" in said
    assert "the finest run: mesh.element = '3-10-1-3', mesh.divisions = [8, 1, 1]" in said
    assert "study.csv" in said


def test_a_folder_of_a_run_is_refused(finished, tmp_path, capsys):
    run = finished.rows[0].folder
    assert main(["study", str(write(tmp_path)), "--out", str(run)]) == 2
    assert "--out: a run is in this folder" in capsys.readouterr().err


def test_from_python_it_returns_the_table_and_draws(finished, tmp_path):
    import ancf_petsc as ancf

    shutil.copytree(finished.folder, tmp_path / "out")
    outcome = ancf.study(write(tmp_path), tmp_path / "out")
    assert outcome.table["mesh.element"] == 3 * ["3413"] + 3 * ["3-10-1-3"]
    assert all(force < 0 for force in outcome.table["force"])
    assert len(list((tmp_path / "out" / "charts").glob("*.png"))) >= 1
