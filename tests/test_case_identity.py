"""The hash of a case and its mesh: what changes it and what does not."""

from __future__ import annotations

import hashlib
import shutil

import pytest

from ancf_petsc.analysis.identity import files_of, identity, mesh_hash
from ancf_petsc.errors import MeshError
from ancf_petsc.input.load import load_case

TEXT = """
title = "Bar"
[mesh]
file = "bar.msh"
element = "3413"
[material]
law = "neo_hooke"
young = 5e6
poisson = 0.4
[[constraint]]
group = "bottom"
fix = ["x", "y", "z"]
[[constraint]]
group = "top"
move = { z = -0.025, x = 0.0 }
[statics]
steps = 10
[petsc]
ksp_rtol = 1e-8
"""
SAME = {
    "as it is": TEXT,
    "keys in another order": TEXT.replace("young = 5e6\npoisson = 0.4\n", "poisson = 0.4\nyoung = 5e6\n"),
    "tables in another order": TEXT.replace("[statics]\nsteps = 10\n", "")
    .replace("[mesh]", "[statics]\nsteps = 10\n[mesh]"),
    "numbers spelt otherwise": TEXT.replace("5e6", "5_000_000").replace("-0.025", "-2.5e-2").replace("x = 0.0", "x = -0"),
    "a default written out": TEXT + "[output]\nsymmetry = 1\n[section]\n",
    "a remark": "# by hand\n" + TEXT,
    "an array of one table": TEXT.replace("[material]", "[[material]]"),
    "options that only report": TEXT + 'log_view = true\ninfo = ":mat"\n',
}  # fmt: skip
OTHER = {
    "a value": TEXT.replace("poisson = 0.4", "poisson = 0.41"),
    "the last digit": TEXT.replace("5e6", "5000000.000000001"),
    "a word": TEXT.replace("neo_hooke", "svk"),
    "a title": TEXT.replace("Bar", "bar"),
    "a default changed": TEXT + "[output]\nsymmetry = 2\n",
    "an option": TEXT.replace("1e-8", "1e-9"),
    "one component less": TEXT.replace('["x", "y", "z"]', '["x", "y"]'),
}


@pytest.fixture
def hash_of(tmp_path):
    """hash_of(text, mesh): of a case with this text beside a mesh of these bytes."""

    def made(text=TEXT, mesh=b"nodes"):
        (tmp_path / "case.toml").write_text(text)
        (tmp_path / "bar.msh").write_bytes(mesh)
        return identity(load_case(tmp_path)).hash

    return made


@pytest.mark.parametrize("what", SAME)
def test_spelling_does_not_change_it(what, hash_of):
    assert hash_of(SAME[what]) == hash_of()


@pytest.mark.parametrize("what", OTHER)
def test_values_change_it(what, hash_of):
    assert hash_of(OTHER[what]) != hash_of()


def test_a_byte_of_the_mesh_changes_it_and_where_it_lies_does_not(hash_of, tmp_path):
    before = hash_of()
    assert hash_of(mesh=b"Nodes") != before
    assert hash_of() == before
    shutil.copytree(tmp_path, tmp_path / "moved" / "far")
    assert identity(load_case(tmp_path / "moved" / "far")).hash == before
    (tmp_path / "bar.msh").rename(tmp_path / "renamed.msh")
    assert identity(load_case(tmp_path, ["mesh.file=renamed.msh"])).hash == before


def test_changes_of_the_command_line_count_as_those_of_the_file(hash_of, tmp_path):
    expected = hash_of(OTHER["a word"].replace("1e-8", "1e-9"))
    hash_of()
    changed = load_case(tmp_path, ["material.law=svk"], ["-ksp_rtol", "1.0E-9", "-malloc_debug"])
    assert identity(changed).hash == expected
    assert identity(load_case(tmp_path).with_changes({"statics.steps": 10})).hash == hash_of()


def test_a_version_of_the_program_is_named_on_request(hash_of, tmp_path):
    hash_of()
    one = identity(load_case(tmp_path))
    assert one.of_program("1.0") != one.of_program("1.1")
    assert one.of_program("1.0") == identity(load_case(tmp_path)).of_program("1.0")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("whole.inp", "*NODE\n*Include, input=part.txt\n"),
        ("whole.bdf", "BEGIN BULK\nINCLUDE 'part.txt'\n"),
        ("whole.xdmf", '<DataItem Format="HDF">part.txt:/data0</DataItem>'),
    ],
)
def test_included_files_count(name, text, tmp_path):
    (tmp_path / name).write_text(text)
    (tmp_path / "part.txt").write_text("1, 0, 0, 0")
    assert [file.name for file in files_of(tmp_path / name)] == [name, "part.txt"]
    before = mesh_hash(tmp_path / name)
    (tmp_path / "part.txt").write_text("1, 0, 0, 1")
    assert mesh_hash(tmp_path / name) != before


def test_of_one_file_it_is_what_sha256sum_prints(tmp_path):
    (tmp_path / "bar.msh").write_bytes(b"nodes" * 1_000_000)  # more than is read at once
    assert mesh_hash(tmp_path / "bar.msh") == hashlib.sha256(b"nodes" * 1_000_000).hexdigest()


def test_a_mesh_that_is_not_there_is_an_error(tmp_path):
    with pytest.raises(MeshError, match=r"none\.msh: cannot be read: No such file"):
        mesh_hash(tmp_path / "none.msh")


def test_a_program_of_other_source_is_another_program(tmp_path, monkeypatch):
    """Between two releases the version stays and numbers may change."""
    from ancf_petsc.analysis import identity as module

    for name, text in {"solve/newton.py": "a = 1\n", "cli/run.py": "b = 1\n"}.items():
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(module, "PACKAGE", tmp_path)

    def digest():
        module.source_digest.cache_clear()
        return module.source_digest()

    first = digest()
    (tmp_path / "cli/run.py").write_text("b = 2\n")
    assert digest() == first
    (tmp_path / "solve/newton.py").write_text("a = 2\n")
    assert digest() != first
    monkeypatch.undo()
    module.source_digest.cache_clear()
