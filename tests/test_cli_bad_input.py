"""Wrong input, as a user meets it: one line, exit code 2, no traceback, earlier results untouched."""

from __future__ import annotations

import numpy as np
import pytest

from ancf_petsc.cli import main

BAD = {
    "missing case file": (["nothing"], [], "no such file"),
    "unknown key": ([], ["material.yung=1"], "did you mean 'young'"),
    "wrong type": ([], ['material.young="soft"'], "material.young"),
    "Poisson 0.5": ([], ["material.poisson=0.5"], "found 0.5"),
    "Poisson -1": ([], ["material.poisson=-1"], "found -1"),
    "Poisson nan": ([], ["material.poisson=nan"], "found nan"),
    "negative Young": ([], ["material.young=-1.0"], "material.young"),
    "zero Young": ([], ["material.young=0.0"], "material.young"),
    "gravity without density": (
        [],
        ['load=[{type="gravity",acceleration=[0.0,0.0,-9.81]}]'],
        "material.density",
    ),
    "group not in the mesh": ([], ["constraint.top.group=topp"], "bottom, top, symmetry_x"),
    "empty group": ([], ["groups.far={box=[[9,9,9],[10,10,10]]}", "constraint.top.group=far"], "groups.far"),
    "name in file and case": ([], ['groups.top={plane="z",at="max"}'], "groups.top"),
    "missing mesh": ([], ["mesh.file=missing.msh"], "there is no such file"),
    "unknown element": ([], ["mesh.element=3414"], "mesh.element"),
    "nothing holds the body": ([], ["constraint=[]"], "translation along x; translation along y"),
    "free to turn": (
        [],
        ['constraint=[{group="bottom",fix=["z"]},{group="symmetry_x",fix=["x"]}]'],
        "translation along y",
    ),
    "contradiction": ([], ['constraint.symmetry_x.fix=["z"]'], "contradict each other"),
    "statics and dynamics": ([], ["dynamics={duration=1.0,step=0.1}"], "[statics] and [dynamics]"),
    "stroke beyond the motion": ([], ["statics={strokes=[0.03]}"], "strokes"),
}


def run(case, out, *changes, capsys):
    """Exit code and what was said on stderr."""
    code = main(["run", str(case), "--out", str(out), "--set", "title=Another title", *changes])
    return code, capsys.readouterr().err


@pytest.mark.parametrize("what", BAD)
def test_one_line_and_nothing_touched(what, project, tmp_path, capsys):
    other, changes, words = BAD[what]
    out = tmp_path / "run"
    out.mkdir()
    (out / "summary.json").write_text('{"title": "Another title"}')
    code, said = run(other[0] if other else project / "cases/pvc_block", out, *changes, capsys=capsys)
    assert code == 2
    assert said.count("\n") == 1
    assert said.startswith("error: ")
    assert words in said
    assert [file.name for file in out.iterdir()] == ["summary.json"]
    assert (out / "summary.json").read_text() == '{"title": "Another title"}'


def test_neither_statics_nor_dynamics(project, tmp_path, capsys):
    text = (project / "cases/pvc_block/case.toml").read_text()
    file = tmp_path / "case.toml"
    file.write_text(text.replace("[statics]\nsteps = 25\n", ""))
    code, said = run(file, tmp_path / "run", capsys=capsys)
    assert code == 2
    assert "exactly one of [statics], [dynamics]" in said or "statics" in said


def test_broken_toml_names_the_line(tmp_path, capsys):
    file = tmp_path / "case.toml"
    file.write_text('title = "x"\n[mesh\n')
    code, said = run(file, tmp_path / "run", capsys=capsys)
    assert code == 2
    assert "line 2" in said


@pytest.mark.parametrize("out", ["file", "file/below", "/proc/nothing"])
def test_unwritable_output_folder(out, project, tmp_path, capsys):
    (tmp_path / "file").write_text("a file")
    code, said = run(project / "cases/pvc_block", tmp_path / out, capsys=capsys)
    assert code == 2
    assert "--out" in said


def test_folder_of_something_else_needs_force(project, tmp_path, capsys):
    (tmp_path / "diary.txt").write_text("dear diary")
    code, said = run(project / "cases/pvc_block", tmp_path, capsys=capsys)
    assert code == 2
    assert "--force" in said
    assert (tmp_path / "diary.txt").exists()


def write_mesh(path, points, cells):
    """A bare Gmsh 2.2 file of tetrahedra."""
    nodes = "\n".join(f"{i + 1} {x:.17g} {y:.17g} {z:.17g}" for i, (x, y, z) in enumerate(points))
    rows = "\n".join(f"{i + 1} 4 2 1 1 " + " ".join(str(n + 1) for n in cell) for i, cell in enumerate(cells))
    path.write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(points)}\n{nodes}\n$EndNodes\n"
        f"$Elements\n{len(cells)}\n{rows}\n$EndElements\n"
    )


CORNER = np.vstack((np.zeros(3), np.eye(3), np.ones(3)))
MESHES = {
    "inverted element": (CORNER, [[0, 1, 2, 3], [2, 1, 3, 4]], "element 2"),
    "flat element": (np.vstack((CORNER, [0.5, 0.5, 0.0])), [[0, 1, 2, 3], [0, 1, 2, 5]], "flat"),
    "duplicate nodes": (np.vstack((CORNER, CORNER[3])), [[0, 1, 2, 3], [1, 2, 5, 4]], "duplicates"),
}


@pytest.mark.parametrize("what", MESHES)
def test_bad_meshes_are_told(what, project, tmp_path, capsys):
    points, cells, words = MESHES[what]
    write_mesh(tmp_path / "bad.msh", points, cells)
    code, said = run(
        project / "cases/pvc_block", tmp_path / "run", f"mesh.file={tmp_path}/bad.msh", capsys=capsys
    )
    assert code == 2
    assert said.count("\n") == 1
    assert "bad.msh" in said
    assert words in said


@pytest.mark.parametrize(
    "change", ["material.poisson=0.5", "constraint.top.group=topp", "mesh.file=none.msh"]
)
def test_two_ranks_say_it_once_and_do_not_hang(change, ancf, project, tmp_path):
    done = ancf(
        "run",
        project / "cases/pvc_block",
        "--out",
        tmp_path / "run",
        "--set",
        change,
        ranks=2,
        timeout=60,
        code=2,
    )
    assert done.stderr.count("error: ") == 1
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["-ksp_type", "nonsense"], "found 'ksp_type = nonsense'"),
        (["-no_such_option", "1"], "no solver of this run uses it"),
    ],
)
def test_wrong_petsc_options_are_told(options, words, project, tmp_path, capsys):
    code = main(["run", str(project / "cases/pvc_block"), "--out", str(tmp_path / "run"), "--", *options])
    said = capsys.readouterr().err
    assert code == 2
    assert words in said
    assert not (tmp_path / "run").exists()


def test_options_without_a_value_are_taken(project, tmp_path, capfd):
    out = tmp_path / "run"
    words = ["run", str(project / "cases/pvc_block"), "--out", str(out), "--set", "statics.steps=1"]
    assert main([*words, "--", "-ksp_type", "cg", "-pc_type", "gamg", "-ksp_monitor"]) == 0
    assert "KSP Residual norm" in capfd.readouterr().out
