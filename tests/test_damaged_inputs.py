"""What the fuzzer found, as small files made by hand: each gets one line of error, at once and without memory."""

from __future__ import annotations

import json
import os
import shutil

import h5py
import numpy as np
import pytest
from decks import abaqus, bar
from mpi4py import MPI
from results_writer import write
from tiny_meshes import TWO

from ancf_petsc.cli import main
from ancf_petsc.errors import CaseError, MeshError, did_you_mean
from ancf_petsc.jit import _is_own
from ancf_petsc.mesh.made import Request, made_mesh
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.mesh.text import DeckFiles
from ancf_petsc.results.reader import open_results
from ancf_petsc.results.tables import read_table

BAR = abaqus(bar())
BULK = """GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,0.,1.,0.
GRID,4,,0.,0.,1.
CTETRA,1,7,1,2,3,4
"""
CHAIN = "".join(f"CORD2R,{k},{k + 1},0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n" for k in range(10, 2010))
CHAIN_END = "CORD2R,2010,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRID,9,10,0.,0.,0.\n"
NESTED = "".join(f"*NSET, NSET=n{k}\nn{k + 1}\n" for k in range(900)) + "*NSET, NSET=n900\n7\n"
DIGITS = "1" * 5000

NAMED = TWO.replace('2 8 "nothing"', f'2 {DIGITS} "nothing"').replace("$Nodes", "$Other\n$EndOther\n$Nodes")

DECKS = {
    "bar.inp": {
        "sets in sets without end": (BAR + NESTED, "the last of 100 that are members of each other"),
        "a member beyond all numbers": (f"{BAR}*NSET, NSET=q\n7, top, {10**30}\n", "a member of a node set"),
        "a range beyond all numbers": (f"{BAR}*NSET, NSET=q, GENERATE\n1, {10**30}\n", "GENERATE: found"),
        "a node beyond all numbers": (f"{BAR}*NGEN\n7, {10**30}, 1\n", "a data line: found"),
        "a step beyond all numbers": (
            f"{BAR}*NCOPY, OLD SET=top, CHANGE NUMBER={10**30}, SHIFT\n0,0,1\n0,0,0,0,0,1,0\n",
            "CHANGENUMBER=: found",
        ),
        "more elements than fit": (f"{BAR}*ELGEN\n11, 1000000, 1, 1, 9\n", "at most 4000000 in a deck"),
        "a file's name without end": (f"*INCLUDE, INPUT={'a' * 5000}\n{BAR}", "there is no such file"),
        "a word without end": (BAR + "*NSET, NSET=q\ntop" + "(" * 50_000, r"\.\.\. \(50005 letters\)"),
    },
    "bar.bdf": {
        "systems in systems without end": (f"{BULK}{CHAIN}{CHAIN_END}", "the last of 100"),
        "two signs": (BULK.replace("GRID,4", "GRID,--4"), "field 2 is not a whole number: found '--4'"),
        "all numbers there are": (f"{BULK}SET1,5,1,THRU,99999999\n", "at most 10000000 numbers in a card"),
        "a file's name without end": (f"INCLUDE '{'a' * 5000}'\n{BULK}", "there is no such file"),
    },
    "two.msh": {
        "a tag beyond all numbers": (TWO.replace("4 2 1 1 10", f"4 2 1 {DIGITS} 10"), "Gmsh|number"),
        "half a node": (TWO.replace("10 0 0 0", "10.5 0 0 0"), "Gmsh|node"),
        "a name beyond all numbers": (NAMED, "two.msh"),
    },
}  # fmt: skip


@pytest.mark.parametrize(("name", "what"), [(name, what) for name, found in DECKS.items() for what in found])
def test_decks(tmp_path, name, what):
    text, message = DECKS[name][what]
    (tmp_path / name).write_text(text)
    try:
        mesh = read_mesh(tmp_path / name, ("tetra",))
    except MeshError as error:
        import re

        said = str(error)
        assert re.search(message, said)
        assert len(said.splitlines()) == 1
        assert len(said) < 4000 + len(str(tmp_path))
    else:
        assert what == "a name beyond all numbers"  # names no group: its number is that of none
        assert len(mesh.cells) == 3 - 1


def test_files_that_include_each_other_over_and_over(tmp_path):
    """Each of six names the next ten times: a million files."""
    for k in range(6):
        (tmp_path / f"wide{k}.inp").write_text(f"*INCLUDE, INPUT=wide{k + 1}.inp\n" * 10)
    (tmp_path / "wide6.inp").write_text("** nothing\n")
    with pytest.raises(MeshError, match="the deck includes 10001 files, 7 different ones"):
        read_mesh(tmp_path / "wide0.inp", ("tetra",))


def test_bytes_that_are_included_over_and_over(tmp_path, monkeypatch):
    monkeypatch.setattr("ancf_petsc.mesh.text.SPARE", 100)
    (tmp_path / "a").write_bytes(bytes(50))
    files = DeckFiles()
    for _ in range(6):
        files.read(tmp_path / "a")
    with pytest.raises(MeshError, match="the deck includes 7 files, 1 different ones"):
        files.read(tmp_path / "a")


def test_messages_repeat_no_more_than_can_be_read():
    error = CaseError("x" * 10**5, key="k" * 10**5, got="y" * 10**5, expected="z" * 10**5, cure="c" * 10**5)
    assert len(str(error)) < 6000
    assert "found 'yyy" in str(error)
    assert len(did_you_mean("q", [f"name{k}" for k in range(10**4)])) < 800
    deep: list = []
    for _ in range(10**5):
        deep = [deep]
    assert "RecursionError" in str(CaseError("deep", got=deep)) or "recursion" in str(
        CaseError("deep", got=deep)
    )
    assert "found int (" in str(CaseError("long", got=10**5000))


# --- a run's folder that somebody else has written


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run") / "run"
    write(folder, MPI.COMM_SELF)
    return folder


def changed(path, name, data):
    with h5py.File(path / "results.h5", "r+") as file:
        del file[name]
        if data is not None:
            file[name] = data


FIELD = "steps/000000/displacement"
FILES = {
    "points of text": ("mesh/points", "text", lambda run: run.points),
    "flat points": ("mesh/points", np.zeros(24), lambda run: run.points),
    "cells of points that are not there": ("mesh/cells", np.full((6, 4), 99), lambda run: run.cells),
    "negative cells": ("mesh/cells", np.full((6, 4), -1), lambda run: run.cells),
    "cells with five nodes": ("mesh/cells", np.zeros((6, 5), int), lambda run: run.cells),
    "no cells": ("mesh/cells", None, lambda run: run.cells),
    "a group of points that are not there": ("mesh/groups/base", np.array([3, 8]), lambda run: run.groups),
    "a field of other rows": (FIELD, np.zeros((3, 3)), lambda run: run.field("displacement", 0)),
    "a field elsewhere": (FIELD, h5py.ExternalLink("other.h5", "/x"), lambda run: run.field("displacement", 0)),
    "no steps": ("steps", None, lambda run: run.times),
    "steps that are numbers": ("steps", np.arange(3), lambda run: run.times),
}  # fmt: skip


@pytest.mark.parametrize("what", FILES)
def test_results_of_others(tmp_path, run_folder, what):
    name, data, use = FILES[what]
    path = tmp_path / "run"
    shutil.copytree(run_folder, path)
    with h5py.File(path / "results.h5") as file:
        first = sorted(file["steps"])[0]
    changed(path, name.replace("000000", first), data)
    with pytest.raises(CaseError, match=r"results\.h5: cannot be read: ") as error:
        use(open_results(path))
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("text", ["[]", "[" * 10**5, "{\xff", "3", ""])
def test_a_summary_that_is_none(tmp_path, run_folder, text):
    path = tmp_path / "run"
    shutil.copytree(run_folder, path)
    (path / "summary.json").write_bytes(text.encode("latin-1"))
    if text == "[]":
        assert open_results(path).summary == {}
    else:
        with pytest.raises(CaseError, match=r"summary\.json: cannot be read"):
            _ = open_results(path).summary


def test_tables_that_are_none(tmp_path):
    (tmp_path / "latin.csv").write_bytes(b"time,\xe9\n0,1\n")
    with pytest.raises(CaseError, match="not a table: byte 5 is not UTF-8"):
        read_table(tmp_path / "latin.csv")
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(CaseError, match="not an ordinary file"):
        read_table(tmp_path / "pipe.csv")


def test_a_run_whose_record_is_not_whole_is_not_repeated(tmp_path, run_folder, capsys):
    path = tmp_path / "run"
    shutil.copytree(run_folder, path)
    (path / "summary.json").write_text(json.dumps({"case": {"text": "x"}, "mesh": {}}))
    assert main(["run", str(path), "--again"]) == 2
    assert "this run did not record its case" in capsys.readouterr().err


# --- names of temporary files


def test_a_mesh_is_made_under_a_name_nobody_can_foresee(tmp_path, monkeypatch):
    monkeypatch.setenv("ANCF_CACHE_DIR", str(tmp_path))
    seen = []
    monkeypatch.setattr(
        "ancf_petsc.mesh.made.make_mesh",
        lambda body, path, **asked: (seen.append(path), path.write_text("x")),
    )
    first = made_mesh(Request("cube"))
    first.unlink()
    assert made_mesh(Request("cube")) == first
    assert seen[0] != seen[1]
    assert {path.parent.parent for path in seen} == {first.parent}
    assert [path.name for path in first.parent.iterdir()] == [first.name]


def test_machine_code_is_not_taken_from_a_folder_of_others(tmp_path):
    """numba unpickles what it finds there."""
    assert _is_own(tmp_path / "new")
    (tmp_path / "new").chmod(0o777)
    assert not _is_own(tmp_path / "new")
    (tmp_path / "mine").mkdir(mode=0o700)
    (tmp_path / "link").symlink_to(tmp_path / "mine")
    assert not _is_own(tmp_path / "link")
    (tmp_path / "file").write_text("")
    assert not _is_own(tmp_path / "file")
