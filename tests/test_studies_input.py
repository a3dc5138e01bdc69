"""Study files are checked like cases: one line with file and key, exit code 2, nothing started."""

from __future__ import annotations

import pytest
from tiny_studies import CASE, STUDY, write

from ancf_petsc.cli import main
from ancf_petsc.input.load import load_case
from ancf_petsc.studies.columns import columns_of, nearest

MOTION = CASE.replace("[statics]\nsteps = 2", "[dynamics]\nduration = 0.1\nstep = 0.05\noutputs = 2").replace(
    "move = { z = -0.05 }", 'fix = ["y"]'
)
BAD = {
    "misspelt table": ('[vary]', '[varry]', "varry: unknown key; did you mean 'vary'?"),
    "misspelt varied key": ('"mesh.divisions"', '"mesh.division"', "mesh.division: unknown key; did you mean 'div"),
    "misspelt varied table": ('"mesh.divisions"', '"mush.divisions"', "mush: unknown key; did you mean 'mesh'?"),
    "value of another type": ("[8, 1, 1]", '"many"', "mesh.divisions: found 'many'"),
    "value the case refuses": ("[8, 1, 1]", "[0, 1, 1]", "mesh.divisions: found [0, 1, 1]"),
    "no list": ('["3413", "3-10-1-3"]', '"3413"', "vary.\"mesh.element\": found '3413', expected a list of values"),
    "empty list": ('["3413", "3-10-1-3"]', "[]", "expected a list of values"),
    "element of no catalogue": ('"3-10-1-3"', '"3-11-1-3"', "mesh.element"),
    "no case": ('"case.toml"', '"cases.toml"', "case: there is no such file"),
    "no such column": ('column = "force"', 'column = "forse"', "quantity.force.column: no such column"),
    "probe not there": ('column = "force"', 'column = "tap.z"', "did you mean 'tip.z'"),
    "between outputs": ("0.025", "0.026", "statics] strokes = [0.026]"),
    "time of statics": ("stroke = 0.025", "time = 0.5", "quantity.force.at: no output there"),
    "neither at nor reduce": (', at = "end"', "", "quantity.energy: found"),
    "both at and reduce": ('at = "end"', 'at = "end", reduce = "max"', "exactly one of at and reduce"),
    "unknown reduction": ('at = "end"', 'reduce = "maximum"', "did you mean 'max'?"),
    "unknown place": ("stroke = 0.025", "strike = 0.025", "did you mean 'stroke'"),
    "reserved name": ("energy = {", "steps = {", "study.csv has a column of this name"),
    "reference of nothing": ('energy = "finest"', 'energie = "finest"', "did you mean 'energy'"),
    "misspelt reference": ('"richardson"', '"richardon"', "did you mean 'richardson'?"),
    "ladder along no key": ('"richardson"', '{ richardson = "mesh.size" }', "a key that runs differ in"),
    "reference file not there": ('"richardson"', '"force.csv"', "reference.force: there is no such file"),
    "against a number": (
        'at = "end" }\n[reference]\nforce = "richardson"\nenergy = "finest"',
        'reduce = "rms", against = "reference" }\n[reference]\nenergy = 1.0',
        "something with a series to compare with",
    ),
    "drift against": (
        'at = "end" }', 'reduce = "drift", against = "reference" }', "one of max, mean, rms with against"),
    "wrong chart": ('[reference]', '[[chart]]\nkind = "map"\nx = "mesh.size"\ny = "mesh.element"\n[reference]', "chart"),
    "timeout": ('title', 'timeout = -1.0\ntitle', "timeout: found -1.0"),
    "format": ('title', 'format = 2\ntitle', "format: found 2"),
    "no valid TOML": ('[vary]', '[vary', "not valid TOML"),
    "NUL": ('"Elements"', '"Elem\\u0000ents"', "a NUL character"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_one_line_and_nothing_started(what, tmp_path, capsys):
    old, new, words = BAD[what]
    assert old in STUDY
    file = write(tmp_path, STUDY.replace(old, new, 1))
    code = main(["study", str(file), "--out", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert code == 2
    assert said.count("\n") == 1
    assert words in said
    assert "study.toml" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--only", "3/2"], "--only: found '3/2', expected K/M"),
        (["--only", "half"], "--only: found 'half'"),
        (["--jobs", "0"], "--jobs: found 0"),
        (["--ranks", "-1"], "--ranks: found -1"),
        (["--out", "study.toml"], "--out: is a file"),
    ],
)
def test_arguments(words, said, tmp_path, capsys, monkeypatch):
    file = write(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert main(["study", str(file), *words]) == 2
    assert said in capsys.readouterr().err


def test_a_case_is_no_study_and_nothing_is_none(tmp_path, capsys):
    write(tmp_path)
    assert main(["study", str(tmp_path / "case.toml")]) == 2
    assert "this is a case, not a study" in capsys.readouterr().err
    assert main(["study", str(tmp_path / "none.toml")]) == 2
    assert "there is no such file" in capsys.readouterr().err


def test_a_study_without_keys_has_no_runs(tmp_path, capsys):
    text = STUDY.replace('"mesh.element" = ["3413", "3-10-1-3"]\n', "")
    text = text.replace('"mesh.divisions" = [[2, 1, 1], [4, 1, 1], [8, 1, 1]]\n', "")
    assert main(["study", str(write(tmp_path, text))]) == 2
    assert "vary: missing: expected [vary] or [[rows]]" in capsys.readouterr().err


def test_outputs_of_a_motion(tmp_path, capsys):
    text = STUDY.replace('[vary]\n"mesh.element"', '[vary]\n"dynamics.step" = [0.05]\n"mesh.element"')
    text = text.replace('column = "force", at = { stroke = 0.025 }', 'column = "tip.z", at = { time = 0.03 }')
    assert main(["study", str(write(tmp_path, text, MOTION))]) == 2
    said = capsys.readouterr().err
    assert "its outputs have time 0.05, 0.1" in said
    assert "dynamics.outputs" in said


def test_list_shows_the_runs_cheapest_first_and_starts_none(tmp_path, capsys):
    file = write(tmp_path)
    assert main(["study", str(file), "--out", str(tmp_path / "out"), "--list"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if "not_run" in line]
    dof = [int(line.split("not_run")[0].split()[-1]) for line in lines]
    assert len(dof) == 6
    assert dof == sorted(dof)
    assert not (tmp_path / "out").exists()


def test_rows_beside_the_product_and_each_run_once(tmp_path):
    from ancf_petsc.studies.read import load_study
    from ancf_petsc.studies.runs import runs_of

    rows = """
[[rows]]
"mesh.element" = "3413"
"mesh.divisions" = [2, 1, 1]
[[rows]]
mesh.element = "3443"
mesh.divisions = [2, 1, 1]
"constraint.end.move" = { z = -0.05, y = 0.0 }
[[rows]]
"mesh.element" = "3443"
"statics.steps" = ""
"statics.times" = [0.25, 0.5, 1.0]
"""
    study = load_study(write(tmp_path, STUDY + rows))
    runs = runs_of(study, tmp_path)
    assert len(runs) == 6 + 2  # the first row is one of the product
    steps = [run.case.spec.statics.steps for run in runs if run.values["statics.times"]]
    assert steps == [None]  # the empty text took the key away
    assert {run.values["mesh.element"] for run in runs} == {"3413", "3-10-1-3", "3443"}


def test_keys_for_all_runs(tmp_path):
    """They come before what a run changes itself, and are no columns."""
    from ancf_petsc.studies.read import load_study
    from ancf_petsc.studies.runs import runs_of
    from ancf_petsc.studies.table import StudyOutcome

    common = '[set]\n"statics.steps" = ""\nstatics.times = [0.5, 1.0]\n"mesh.element" = "3443"\n[vary]'
    text = STUDY.replace("[vary]", common)
    text = text.replace('"mesh.element" = ["3413", "3-10-1-3"]\n', "") + '[[rows]]\n"mesh.element" = "3413"\n'
    study = load_study(write(tmp_path, text))
    runs = runs_of(study, tmp_path)
    assert {run.case.spec.statics.times for run in runs} == {(0.5, 1.0)}
    assert sorted(run.values["mesh.element"] for run in runs) == ["3413", *3 * ["3443"]]
    assert StudyOutcome(study, runs, tmp_path).columns[:3] == ["mesh.divisions", "mesh.element", "status"]


def test_a_wrong_key_for_all_runs(tmp_path, capsys):
    file = write(tmp_path, STUDY.replace("[vary]", '[set]\n"material.yung" = 1.0\n[vary]'))
    assert main(["study", str(file), "--out", str(tmp_path / "out")]) == 2
    assert "material.yung: unknown key; did you mean 'young'" in capsys.readouterr().err


def test_combinations_that_no_mesh_fits_are_rows_not_ends(tmp_path):
    from ancf_petsc.errors import CaseError
    from ancf_petsc.studies.read import load_study
    from ancf_petsc.studies.runs import runs_of

    bricks = STUDY.replace('["3413", "3-10-1-3"]', '["3413", "3813"]')
    runs = runs_of(load_study(write(tmp_path, bricks)), tmp_path)
    assert sum(run.facts is None for run in runs) == 3
    assert all("hexahedr" in run.problem for run in runs if run.facts is None)
    with pytest.raises(CaseError, match="hexahedr"):
        runs_of(
            load_study(write(tmp_path / "b", STUDY.replace('["3413", "3-10-1-3"]', '["3813"]'))), tmp_path
        )


@pytest.mark.parametrize(
    ("points", "wanted", "index"),
    [
        ((0.005, 0.01, -0.01), -0.01, 2),
        ((-0.01, 0.01), 0.01, 1),
        ((-0.005, -0.01), 0.01, 1),
        ((0.005, 0.01, 0.005), 0.005, 0),
        ((0.005, 0.01), 0.02, None),
        ((), 0.02, None),
    ],
)
def test_an_output_of_the_sign_asked_for_comes_before_one_of_the_other(points, wanted, index):
    assert nearest(points, wanted) == index


def test_columns_of_a_path_that_motion_carries_on(tmp_path):
    """Beyond its limits a path has the energy that was lost and the jumps."""
    write(tmp_path)
    spec = load_case(tmp_path / "case.toml").with_changes({"statics.after_limit": "dynamics"}).spec
    assert {"dissipated_energy", "jumps"} <= set(columns_of(spec))
    assert "jumps" not in columns_of(load_case(tmp_path / "case.toml").spec)
