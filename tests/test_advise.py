"""Advice: what is asked, what is tried, what is fitted, what is chosen."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from tiny_studies import CASE, InProcess, write

import ancf_petsc as ancf
from ancf_petsc.advise import advise as whole
from ancf_petsc.advise.choose import BestGuess, allowed, best_guess, ranked
from ancf_petsc.advise.lab import Lab
from ancf_petsc.advise.line import Discretisation
from ancf_petsc.advise.meshes import MeshFamily, elements_for, families
from ancf_petsc.advise.question import read_quantity, read_target
from ancf_petsc.advise.scene import working_case
from ancf_petsc.advise.search import begin, search
from ancf_petsc.advise.steps import fewest_steps
from ancf_petsc.cli import main
from ancf_petsc.errors import CaseError
from ancf_petsc.studies import runner
from ancf_petsc.studies.facts import Facts
from ancf_petsc.studies.spec import OutputAt


@pytest.fixture(autouse=True)
def _in_process(monkeypatch):
    monkeypatch.setattr(runner, "Process", InProcess)
    monkeypatch.setattr(InProcess, "commands", [])


@pytest.mark.parametrize(
    ("text", "column", "at", "reduce"),
    [
        ("force@stroke=0.010", "force", OutputAt("stroke", 0.01), None),
        ("tip.z@time=0.5", "tip.z", OutputAt("time", 0.5), None),
        ("end.uz", "end.uz", OutputAt("end"), None),
        ("end.uz@end", "end.uz", OutputAt("end"), None),
        ("strain_energy@max", "strain_energy", None, "max"),
    ],
)
def test_quantities(text, column, at, reduce):
    asked = read_quantity(text)
    assert (asked.column, asked.at, asked.reduce) == (column, at, reduce)


@pytest.mark.parametrize(
    "text", ["force@strike=0.01", "force@stroke", "@end", "force@", "force@stroke=nan", "f@maximum"]
)
def test_wrong_quantities(text):
    with pytest.raises(CaseError, match="--quantity: found"):
        read_quantity(text)


def test_targets():
    assert read_target("1%") == read_target("0.01") == read_target(" 1 % ") == 0.01
    for text in ("0", "100%", "-1%", "one", "1%%", "", "1e"):
        with pytest.raises(CaseError, match="--within: found"):
            read_target(text)


def test_the_path_ends_where_the_quantity_is_taken(tmp_path):
    """A quarter of the stroke of a cosine ramp, and a load's ramp up to the same pseudo-time, give the state of the whole path."""
    ramped = CASE.replace("move = { z = -0.05 }", 'move = { z = -0.05 }\nramp = "cosine"').replace(
        "steps = 2", "strokes = [0.0125]"
    )
    ramped += '[[load]]\ntype = "force"\ngroup = "end"\ntotal = [5.0, 0.0, 0.0]\n'
    case = ancf.load_case(write(tmp_path, case=ramped).with_name("case.toml"))
    base, asked, free = working_case(case, read_quantity("force@stroke=0.0125"), tmp_path / "out")
    assert free
    assert asked.at == OutputAt("end")
    assert base.spec.constraint[1].ramp == ((0.0, 0.0), (1.0, pytest.approx(0.25)))
    assert base.spec.load[0].ramp == (
        (0.0, 0.0),
        (1.0, pytest.approx(1 / 3)),
    )  # (1 - cos(pi/3)) / 2 is a quarter
    known, found = ancf.run(case, tmp_path / "a"), ancf.run(base, tmp_path / "b")
    assert found.curve["stroke"][-1] == pytest.approx(-0.0125, rel=1e-12)
    assert found.curve["force"][-1] == pytest.approx(known.curve["force"][1], rel=1e-8)


def test_the_path_ends_at_the_stroke_of_the_sign_asked_for(tmp_path):
    """Pressed first, then pulled: a stroke of either sign has its own state, and a path that is only pressed has no other."""
    table = "ramp = [[0.0, 0.0], [0.5, 1.0], [1.0, -1.0]]"
    both = CASE.replace("move = { z = -0.05 }", f"move = {{ z = -0.05 }}\n{table}")
    case = ancf.load_case(write(tmp_path, case=both).with_name("case.toml"))
    for text, factor in (("-0.05", 1.0), ("0.05", -1.0), ("0.025", -0.5), ("-0.025", 0.5)):
        base, _, _ = working_case(case, read_quantity(f"force@stroke={text}"), tmp_path / f"out{text}")
        assert base.spec.constraint[1].ramp[1] == (1.0, pytest.approx(factor))


def test_what_a_case_has_not_is_refused(tmp_path):
    case = ancf.load_case(write(tmp_path).with_name("case.toml"))
    for text, said in [
        ("forse@end", "no such column"),
        ("force@stroke=0.06", "no output there"),
        ("force@time=1", "no output"),
    ]:
        with pytest.raises(CaseError, match=said):
            working_case(case, read_quantity(text), tmp_path / "out")


def test_meshes_of_the_programs_bodies_are_recognised(project):
    case = ancf.load_case(project / "cases/pvc_block")
    known, body = families(case)
    assert body == "pvc_block"
    assert [family.name for family in known] == ["uniform", "graded", "bricks"]
    first, second = known[1].mesh(0.0), known[1].mesh(1.0)
    assert first == {"mesh.file": "", "mesh.body": "pvc_block", "mesh.size": 0.02, "mesh.rim": 0.008}
    assert second["mesh.size"] / first["mesh.size"] == pytest.approx(0.8)
    assert second["mesh.rim"] / first["mesh.rim"] == pytest.approx(0.64)
    assert set(elements_for(case, known[0])) == {"3413", "3-10-1-3", "3443", "3443+4"}
    assert set(elements_for(case, known[2])) == {"3813", "3843"}


def test_a_mesh_of_ones_own_is_refined(tmp_path, project):
    from ancf_petsc.mesh.generate import make_mesh

    make_mesh("cube", tmp_path / "block.msh", divisions=(1, 1, 2))
    text = (tmp_path / "block.msh").read_text().replace('"top"', '"lid"')
    (tmp_path / "block.msh").write_text(text)
    data = {
        "title": "Own", "mesh": {"file": "block.msh", "element": "3413", "refine": 1},
        "material": {"law": "svk", "young": 1.0, "poisson": 0.3},
        "constraint": [{"group": "bottom", "fix": ["x", "y", "z"]}, {"group": "lid", "move": {"z": -0.01}}],
        "statics": {"steps": 1},
    }  # fmt: skip
    (family,), body = families(ancf.case_from_dict(data, tmp_path))
    assert body == ""
    assert [family.mesh(level) for level in (-1, 0, 2, 8)] == [
        None,
        {"mesh.refine": 1},
        {"mesh.refine": 3},
        None,
    ]


# --- fits, on made trials


@dataclass
class MadeTrial:
    """Of a discretisation whose error and seconds are known powers."""

    value: float
    facts: Facts
    solution: float
    stretch: float | None = 0.99

    failure = ""
    row = run = None

    @property
    def seconds(self):
        return 1.0 + self.solution

    def __post_init__(self):
        self.row = self.run = self

    def stretch_at(self, asked):
        return self.stretch


FAMILY = MeshFamily("uniform", "tetra", {"mesh.body": "cube"}, "cube", fractions=True)


def made(code, *, error, order, rate, levels=(0, 1, 2), limit=-100.0, cells=1000, stretches=None):
    """error: at h = 1; rate: seconds of a solution by degree of freedom."""
    line = Discretisation(code, FAMILY)
    for k, level in enumerate(levels):
        h = 0.8**level
        dof = round(cells / h**3)
        trial = MadeTrial(limit * (1 + error * h**order), Facts(dof, dof, h, 2), rate * dof**1.2)
        line.trials[float(level)] = replace(trial, stretch=stretches[k] if stretches else 0.99)
    return line


class NoLab:
    asked = None


def test_error_and_cost_beyond_what_was_run():
    line = made("3443", error=0.1, order=2.0, rate=1e-4, cells=3000)
    assert line.error(1.0, -100.0) == pytest.approx(0.1 * 0.64)
    for level in (0.5, 3.0, 5.5):
        assert line.size_at(level) == pytest.approx(0.8**level)
        assert line.error(level, -100.0) == pytest.approx(0.1 * 0.64**level, rel=1e-6)
        assert line.dof_at(level) == pytest.approx(3000 / 0.512**level, rel=1e-3)
        assert line.seconds(level) == pytest.approx(1 + 1e-4 * (3000 / 0.512**level) ** 1.2, rel=1e-3)
    assert min(line.candidates()) == -1.0
    assert max(line.candidates()) == 8.0  # six beyond the third trial
    line.stopped = "surface_fold"
    assert max(line.candidates()) == 2.0


def test_sizes_that_give_one_mesh_or_a_coarser_one_are_no_levels():
    """A mesh generator makes one mesh of several sizes of edges on coarse bodies, and at times a coarser one of a smaller size."""
    line = made("3443", error=0.1, order=2.0, rate=1e-4, levels=(0, 1, 2, 3), cells=3000)
    whole = {level: line.error(level, -100.0) for level in (2.5, 5.0)}
    line.trials[2.25], line.trials[1.5] = line.trials[2.0], line.trials[0.0]
    assert line.rungs == [0.0, 1.0, 2.0, 3.0]
    for level, error in whole.items():
        assert line.error(level, -100.0) == pytest.approx(error, rel=1e-9)
    line.trials = {0.0: line.trials[0.0], 1.0: line.trials[0.0]}
    assert line.error(2.0, -100.0) == np.inf
    assert np.isfinite(line.dof_at(2.0) + line.seconds(2.0))
    assert line.limit(NoLab()).limit is None


def test_the_cheapest_that_is_good_enough():
    slow = made("3843", error=0.02, order=4.0, rate=1e-3)
    fast = made("3413", error=0.30, order=2.0, rate=1e-5)
    guess = best_guess([slow, fast], NoLab())
    assert guess.claimed
    assert guess.value == pytest.approx(-100.0, rel=1e-4)
    for target in (0.2, 0.05, 0.02):
        first, second = ranked([slow, fast], guess, target)
        costs = {
            line.code: min(
                line.seconds(k) for k in line.candidates() if line.error(k, -100.0) <= 0.9 * target
            )
            for line in (slow, fast)
        }
        assert first.line.code == min(costs, key=costs.get)
        assert first.seconds <= second.seconds
        assert first.error <= allowed(guess, target)
        assert first.seconds <= 1.5 * min(costs.values())


def test_a_limit_that_is_not_claimed_is_still_looked_towards():
    line = made("3443", error=0.1, order=1.0, rate=1e-4, stretches=(0.75, 0.7, 0.6))
    guess = best_guess([line], NoLab())
    assert not guess.claimed
    assert "fold" in guess.words
    assert guess.value == pytest.approx(-100.0, rel=1e-6)
    assert guess.uncertainty == pytest.approx(0.064, rel=1e-6)
    assert allowed(guess, 0.01) == pytest.approx(0.007)


def test_two_levels_are_no_limit():
    guess = best_guess([made("3443", error=0.1, order=1.0, rate=1e-4, levels=(0, 1))], NoLab())
    assert not guess.claimed
    assert guess.value == pytest.approx(-108.0)


def test_allowed_errors():
    assert allowed(BestGuess(1.0, 0.001, True, ""), 0.01) == pytest.approx(0.0095)
    assert allowed(BestGuess(1.0, 0.004, True, ""), 0.01) == pytest.approx(0.007)


# --- the search, on laws of error and cost


class PowerLab:
    """Makes trials by the laws of `LawLine`, and counts what they would take."""

    asked = None

    def __init__(self, budget=1e6):
        self.budget, self.spent = budget, 0.0

    @property
    def left(self):
        return self.budget - self.spent

    def plan(self, changes):
        return MadeTrial(0.0, Facts(1, changes["dof"], 1.0, 2), 0.0)


class LawLine(Discretisation):
    """An element with error (1 at h = 1) and seconds by powers; h = 0.8**level."""

    def law(self, error, order, rate, dof):
        self.laws = error, order, rate, dof
        return self

    def changes(self, level):
        return {"dof": round(self.laws[3] / 0.512**level)}

    def make(self, lab, level):
        error, order, rate, _ = self.laws
        h, dof = 0.8**level, self.changes(level)["dof"]
        trial = MadeTrial(-100.0 * (1 + error * h**order), Facts(dof, dof, h, 3), rate * dof**1.3)
        self.trials[level] = trial
        lab.spent += trial.seconds
        return trial


@pytest.mark.parametrize("target", [0.05, 0.01, 0.001])
@pytest.mark.parametrize("orders", [(2, 4, 3), (1.2, 1.4, 1.3), (2, 2, 2)])
def test_the_search_finds_the_cheapest(target, orders):
    laws = [(0.4, orders[0], 3e-6, 300), (0.05, orders[1], 1e-5, 1500), (-0.12, orders[2], 2e-5, 900)]
    lines = [LawLine(str(k), FAMILY).law(*law) for k, law in enumerate(laws)]
    lab = PowerLab()
    begin(lines, lab)
    found = search(lines, lab, target)
    assert found.complete
    best = found.choices[0]
    assert best.measured
    true = abs(best.line.trials[best.level].value / -100.0 - 1)
    assert true <= target
    costs = [
        1 + rate * (dof / 0.512**level) ** 1.3
        for error, order, rate, dof in laws
        for level in np.arange(-1, 40, 0.25)
        if abs(error) * 0.8 ** (order * level) <= target
    ]
    assert best.seconds <= 1.5 * min(costs)


def test_a_search_without_budget_says_that_it_is_not_complete():
    lines = [LawLine("3413", FAMILY).law(0.4, 1.0, 1e-3, 3000)]
    lab = PowerLab(budget=500.0)
    begin(lines, lab)
    found = search(lines, lab, 1e-4)
    assert not found.complete
    assert lab.spent < 1000


# --- with runs


def bricks_only(monkeypatch, codes=("3813", "3843")):
    original = whole.families

    def chosen(case):
        known, body = original(case)
        return [family for family in known if family.name == "bricks"], body

    monkeypatch.setattr(whole, "families", chosen)
    monkeypatch.setattr(whole, "elements_for", lambda case, family: codes)


BRICKS = CASE.replace('element = "3413"', 'element = "3843"\nhexahedra = true')


def test_fewest_steps(tmp_path):
    case = ancf.load_case(write(tmp_path, case=BRICKS).with_name("case.toml"))
    base, asked, _ = working_case(case, read_quantity("force@end"), tmp_path / "out")
    lab = Lab(base, asked, tmp_path / "out", 60.0)
    family = families(base)[0][-1]
    count = fewest_steps(Discretisation("3843", family), 0.0, lab)
    iterations = {trial.changes["statics.steps"]: trial.iterations for trial in lab.trials.values()}
    assert iterations[count] == min(iterations.values())
    assert set(iterations) <= {1, 2, 4, 8}


def test_advice_on_a_short_cantilever(tmp_path, monkeypatch, capsys):
    bricks_only(monkeypatch)
    file = write(tmp_path, case=BRICKS).with_name("case.toml")
    words = [
        "advise",
        str(file),
        "--quantity",
        "force@stroke=0.025",
        "--within",
        "5%",
        "--budget",
        "60",
        "--run",
    ]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    advice = json.loads((tmp_path / "out" / "advice.json").read_text())
    assert "runs to begin with" in said.splitlines()[0]
    assert f"take {advice['best']['words']}" in said
    assert "run: error" in said
    fine = {"mesh.element": "3843", "mesh.divisions": [40, 2, 2], "statics.steps": 1}
    true = ancf.run(ancf.load_case(tmp_path / "out" / "case.toml").with_changes(fine), tmp_path / "fine")
    assert abs(advice["achieved"]["value"] / true.curve["force"][-1] - 1) < 0.05
    assert advice["achieved"]["error"] == pytest.approx(advice["best"]["error"], abs=0.03)
    before = len(InProcess.commands)
    assert main([*words, "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert len(InProcess.commands) == before  # nothing is done twice
    assert "force@stroke=0.025" in capsys.readouterr().out


def test_failures_are_named_where_nothing_reaches(tmp_path, monkeypatch, capsys):
    """svk pressed flat: no element comes to the end."""
    bricks_only(monkeypatch, ("3813",))
    pressed = (
        BRICKS.replace("z = -0.05", "x = -0.9")
        .replace('"end.z"', '"end.x"')
        .replace("steps = 2", "steps = 2\nsmallest_step = 0.1")
    )
    file = write(tmp_path, case=pressed).with_name("case.toml")
    code = main(
        [
            "advise",
            str(file),
            "--quantity",
            "force@stroke=0.9",
            "--within",
            "5%",
            "--out",
            str(tmp_path / "out"),
        ]
    )
    said = capsys.readouterr().out
    assert code == 3
    assert "nothing can be advised: too few runs came to the end to estimate what errors are against" in said
    assert "3813, bricks ends early: " in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--quantity", "forse", "--within", "1%"], "error: --quantity: no such column: found 'forse'"),
        (
            ["--quantity", "force@stroke=0.06", "--within", "1%"],
            "the path ends at a stroke of 0.05: ask for one up to there",
        ),
        (["--quantity", "force", "--within", "1"], "--within: found '1'"),
        (["--quantity", "force@stroke=x", "--within", "1%"], "--quantity: found 'force@stroke=x'"),
        (["--quantity", "force", "--within", "1%", "--budget", "0"], "--budget: found 0"),
        (["--quantity", "force"], "--within"),
    ],
)
def test_wrong_words(words, said, tmp_path, capsys):
    file = write(tmp_path).with_name("case.toml")
    assert main(["advise", str(file), *words, "--out", str(tmp_path / "out")]) == 2
    found = capsys.readouterr().err
    assert said in found
    assert found.count("\n") == 1


def test_motion(tmp_path, monkeypatch):
    """Integrators are compared on one mesh, meshes with the cheapest of them."""
    from ancf_petsc.advise import motion

    bricks_only(monkeypatch, ("3843",))
    monkeypatch.setattr(motion, "LEAST", 0)
    monkeypatch.setattr(motion, "TRIED", ("generalized_alpha",))
    swinging = BRICKS.replace(
        "[statics]\nsteps = 2", "[dynamics]\nduration = 0.1\nstep = 0.01\noutputs = 5"
    ).replace("move = { z = -0.05 }", 'fix = ["y"]')
    swinging += '[[load]]\ntype = "gravity"\nacceleration = [0.0, 0.0, -9.81]\n'
    case = ancf.load_case(write(tmp_path, case=swinging).with_name("case.toml"))
    advice = whole.advise(case, "tip.uz@time=0.1", "5%", tmp_path / "out", 1e4)
    assert advice.best is not None
    assert advice.best.changes["dynamics.integrator"] == "generalized_alpha"
    assert advice.best.error == pytest.approx(advice.best.parts["mesh"] + advice.best.parts["time"])
    assert any("energy drifts" in note for note in advice.notes)
    fine = {
        "mesh.divisions": [16, 2, 2],
        "mesh.element": "3843",
        "dynamics.integrator": "generalized_alpha",
        "dynamics.step": 0.001,
    }
    true = ancf.run(ancf.load_case(tmp_path / "out" / "case.toml").with_changes(fine), tmp_path / "fine")
    chosen = ancf.load_case(tmp_path / "out" / "case.toml").with_changes(
        {k: None if v == "" else v for k, v in advice.best.changes.items()}
    )
    found = ancf.run(chosen, tmp_path / "chosen")
    assert found.probes["tip.uz"][-1] == pytest.approx(true.probes["tip.uz"][-1], rel=0.05)
    assert np.isfinite(found.curve["energy_drift"]).all()


def test_the_scripts_problems_are_cases(project):
    """scripts/verify_advise names cases, meshes and keys that exist."""
    from importlib.machinery import SourceFileLoader
    from importlib.util import module_from_spec, spec_from_loader

    loader = SourceFileLoader("verify_advise", str(project / "scripts" / "verify_advise"))
    module = sys.modules["verify_advise"] = module_from_spec(spec_from_loader("verify_advise", loader))
    loader.exec_module(module)
    for problem in module.PROBLEMS.values():
        case = ancf.load_case(project / "cases" / problem.case)
        for changes in (problem.changes, problem.finer):
            case = case.with_changes(
                {path: None if value == "" else value for path, value in changes.items()}
            )
        read_quantity(problem.quantity)
        assert case.spec.mesh.body
    assert Path(project / "scripts" / "verify_advise").stat().st_mode & 0o100
