"""`ancf new`: a case that is complete, passes its own checks and solves."""

import re

import pytest

from ancf_petsc import cli
from ancf_petsc.cli.new import KINDS
from ancf_petsc.input import load_case
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.plan.case_mesh import mesh_file


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_the_case_is_complete_and_finds_its_groups(here, kind, capsys):
    assert cli.main(["new", "first", "--kind", kind]) == 0
    assert "ancf run first" in capsys.readouterr().out
    case = load_case("first")
    assert mesh_file(case).parent == here / "first"
    groups = read_mesh(mesh_file(case), ("tetra",)).groups
    entries = (*case.spec.constraint, *case.spec.load, *case.spec.probe)
    named = {entry.group for entry in entries if hasattr(entry, "group")}
    assert named <= set(groups)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_commented_out_is_valid_too(kind):
    """With the mark taken off every commented key, but for second choices of a key, the case is accepted."""
    cli.main(["new", "first", "--kind", kind])
    text = load_case("first").folder.joinpath("case.toml").read_text()
    lines = [re.sub(r"^# (?=\[|[a-z_]+ +=)", "", line) for line in text.splitlines()]
    lines = [line for line in lines if not line.startswith(('integrator = "generalized', "ksp_type"))]
    (load_case("first").folder / "all.toml").write_text("\n".join(lines))
    assert load_case("first/all.toml").spec.groups.keys() == {"end", "slab", "tips", "both"}


def test_the_bent_beam_rests_on_force_and_weight(here):
    """Equilibrium: the clamp carries 50 N and 0.01 m3 x 1000 kg/m3 x 9.81 m/s2 = 98.1 N."""
    from ancf_petsc.analysis.run import run_case

    cli.main(["new", "beam", "--kind", "bending"])
    folder = run_case(load_case("beam", ["statics.steps=2"]), here / "out")
    header, *_, last = (folder / "curve.csv").read_text().split()
    row = dict(zip(header.split(","), map(float, last.split(",")), strict=True))
    assert row["force"] == pytest.approx(148.1, rel=1e-9)  # the tolerance of the path is 1e-10


def test_nothing_is_overwritten(here, capsys):
    (here / "mine").mkdir()
    assert cli.main(["new", "mine"]) == 2
    assert "already there" in capsys.readouterr().err
    assert list((here / "mine").iterdir()) == []


def test_an_unknown_kind_leaves_nothing_behind(here, capsys):
    assert cli.main(["new", "first", "--kind", "dynamic"]) == 2
    assert "did you mean 'dynamics'" in capsys.readouterr().err
    assert list(here.iterdir()) == []
