"""Words of the verbs: measures by dimension, details on request, nothing of numpy's, hints for a shell."""

from __future__ import annotations

import logging
import shlex
import warnings

import numpy as np
import pytest
import results_writer as run
from mpi4py import MPI

from ancf_petsc import load_case, log
from ancf_petsc.analysis.run import run_case
from ancf_petsc.cli import console, main
from ancf_petsc.errors import CaseError
from ancf_petsc.input.loads import ForceSpec, GravitySpec
from ancf_petsc.results.folder import check_folder
from ancf_petsc.results.reader import open_results

SQUARE = """
title = "{kind}"
[mesh]
file = "body.msh"
element = "{element}"
[section]
{section}
[material]
law = "svk"
young = 1e6
poisson = 0.3
density = 1000.0
[[constraint]]
group = "held"
fix = ["x", "y", "z"]
[dynamics]
duration = 1.0
step = 0.1
"""


@pytest.fixture(autouse=True)
def _quiet_again():
    yield
    log.close()
    logging.getLogger("ancf").propagate = True


def mesh(folder, kind, rows, points):
    """A file of Gmsh 2.2 with one body and one held point."""
    nodes = "\n".join(f"{i + 1} {x} {y} {z}" for i, (x, y, z) in enumerate(points))
    cells = ["1 15 2 1 1 1", *(f"{k + 2} {kind} 2 2 2 {row}" for k, row in enumerate(rows))]
    dimension = {1: 1, 3: 2}[kind]
    (folder / "body.msh").write_text(
        f'$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n0 1 "held"\n{dimension} 2 "body"\n'
        f"$EndPhysicalNames\n$Nodes\n{len(points)}\n{nodes}\n$EndNodes\n"
        f"$Elements\n{len(cells)}\n" + "\n".join(cells) + "\n$EndElements\n"
    )


BODIES = {
    "beams": ("1222", "area = 1e-4\ninertia = 1e-9", 1, ["1 2", "2 3"], [(0, 0, 0), (1, 0, 0), (2, 0, 0)], "length", 2.0),
    "plane": ("2432", 'thickness = 0.1\nplane = "stress"', 3, ["1 2 3 4"],
              [(0, 0, 0), (3, 0, 0), (3, 2, 0), (0, 2, 0)], "area", 6.0),
}  # fmt: skip


@pytest.mark.parametrize("kind", BODIES)
def test_check_names_measures_by_dimension(kind, tmp_path, capsys, monkeypatch):
    element, section, gmsh_kind, rows, points, measure, size = BODIES[kind]
    mesh(tmp_path, gmsh_kind, rows, points)
    (tmp_path / "case.toml").write_text(SQUARE.format(kind=kind, element=element, section=section))
    console.console.cache_clear()
    assert main(["check", str(tmp_path)]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [measure, f"{size:g}"] in lines
    assert "volume" not in [word for line in lines for word in line]
    assert ("quality" in [line[0] for line in lines if line]) == (kind == "plane")
    (heading,) = [line for line in lines if line[:1] == ["group"]]
    assert (
        heading
        == {
            "beams": ["group", "nodes", "elements", "length"],
            "plane": ["group", "nodes", "lines", "elements", "length", "area"],
        }[kind]
    )
    (body,) = [line for line in lines if line[:1] == ["body"]]
    assert body == ["body", str(len(points)), str(len(rows)), f"{size:g}"]
    console.console.cache_clear()


def test_details_are_residuals_shares_and_seconds(project, tmp_path, capsys):
    words = ["run", str(project / "cases/pvc_block"), "--out", str(tmp_path), "--set", "statics.steps=1"]
    assert main([*words, "--verbose"]) == 0
    said = capsys.readouterr().out
    log.close()
    assert main(words) == 0
    less = capsys.readouterr().out
    (first, *_) = [line for line in said.splitlines() if "out of balance" in line]
    residuals = [float(word) for word in first.rpartition(":")[2].split()]
    assert residuals[-1] <= 1e-10 < residuals[0]
    for part in ("seconds: import", "sha256", 'law = "svk"', "hash"):
        assert part in said
        assert part not in less


def test_warnings_of_arithmetic_stay_off_the_terminal(monkeypatch, capsys):
    """What is not finite is an error of its own; numpy's lines say where in the source, on request."""
    from ancf_petsc import cli

    def overflow(_):
        np.array([1e300]) ** 2
        np.log(np.zeros(1))
        return 0

    monkeypatch.setattr(cli, "_command", overflow)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(["run"]) == 0
        monkeypatch.setenv("ANCF_TRACEBACK", "1")
        pytest.raises(RuntimeWarning, main, ["run"])


def test_speeds_beyond_what_squares_hold_are_an_error(project, tmp_path, capsys):
    changes = ["initial={velocity=[1e200,0,0]}", "dynamics.duration=0.01"]
    assert (
        main(["run", str(project / "cases/pendulum"), "--out", str(tmp_path), "--quiet", "--set", *changes])
        == 3
    )
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert said.count("\n") == 1


@pytest.mark.parametrize("words", [["run", "a\0b"], ["view", "x", "--screenshot", "a\0.png"], ["a\0"]])
def test_nul_characters_in_words_are_refused(words, capsys):
    assert main(words) == 2
    assert "a NUL character" in capsys.readouterr().err


def test_nul_characters_in_paths_of_scripts_are_refused(project):
    with pytest.raises(CaseError, match="NUL"):
        open_results("a\0b")
    with pytest.raises(CaseError, match="NUL"):
        run_case(load_case(project / "cases/pvc_block"), "a\0b")
    with pytest.raises(CaseError, match="NUL"):
        check_folder("a\0b", "Block")


@pytest.mark.parametrize("name", ["a b", "it's", "$HOME", "a;b", 'q"q', "(x)"])
def test_proposed_commands_are_quoted(name, tmp_path, capsys, monkeypatch):
    """What a message proposes can be pasted into a shell."""
    monkeypatch.chdir(tmp_path)
    quoted = shlex.quote(name)
    run.write(tmp_path / name, MPI.COMM_SELF)
    assert main(["run", name]) == 2
    assert f"ancf run {quoted} --again" in capsys.readouterr().err
    (tmp_path / name / "case.toml").write_text("")
    assert main([name]) == 2
    assert f"did you mean: ancf run {quoted}" in capsys.readouterr().err
    assert main(["new", f"{name} 2"]) == 0
    assert f"ancf run {shlex.quote(f'{name} 2')}" in capsys.readouterr().out


def test_loads_are_described_in_words():
    force = ForceSpec(type="force", group="head", total=(0.0, 0.5, -12.0))
    gravity = GravitySpec(type="gravity", acceleration=(0.0, 0.0, -9.81))
    assert [force.describe(), gravity.describe()] == ["on head: (0, 0.5, -12)", "(0, 0, -9.81)"]
