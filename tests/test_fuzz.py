"""The fuzzer sees what it is there for, makes the same inputs again, and finds nothing in a small campaign."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys

import numpy as np
import pytest


@pytest.fixture(scope="module")
def fuzzing(project):
    """A function from the name of a module of scripts/fuzzing to the module."""
    sys.path.insert(0, str(project / "scripts"))
    yield lambda name: importlib.import_module(f"fuzzing.{name}")
    sys.path.remove(str(project / "scripts"))


@pytest.fixture(scope="module")
def seeds(fuzzing, tmp_path_factory):
    """One text mesh: what the tests below need of all seeds."""
    from tiny_meshes import TWO

    folder = tmp_path_factory.mktemp("seeds")
    (folder / "msh").mkdir()
    (folder / "msh" / "hand.msh").write_text(TWO)
    return [fuzzing("seeds").Seed("msh_text", folder / "msh", "hand.msh", "3413")]


@pytest.fixture
def room(fuzzing, seeds, tmp_path, monkeypatch):
    for name in ("HOME", "TMPDIR"):  # the room sets them
        monkeypatch.setenv(name, os.environ.get(name, "/tmp"))  # noqa: S108
    monkeypatch.setenv("ANCF_CACHE_DIR", str(tmp_path / "cache"))
    made = fuzzing("inputs").Room(tmp_path / "room", seeds)
    made.clean()
    return made


def made_input(fuzzing, room, number):
    room.clean()
    attempt = fuzzing("inputs").Attempt(room, "msh_text", 3, number)
    attempt.make()
    files = sorted(path for path in room.box.iterdir() if path.is_file() and os.access(path, os.R_OK))
    return attempt, {path.name: path.read_bytes() for path in files}


def test_an_input_is_made_again_by_its_number(fuzzing, room):
    first, seen = zip(*(made_input(fuzzing, room, number) for number in range(12)), strict=True)
    again = [made_input(fuzzing, room, number)[1] for number in range(12)]
    assert list(seen) == again
    assert not first[0].damages  # number 0 is the seed itself
    assert len({str(files) for files in seen}) > 6


def test_cases_are_made_again_by_their_piece(fuzzing):
    cases = fuzzing("cases")
    one, same, other = (cases.piece_of_cases(number) for number in (5, 5, 6))
    assert list(map(repr, one)) == list(map(repr, same)) != list(map(repr, other))
    assert len(one) == cases.PIECE


WRONG = {
    "traceback": (lambda room: 1 / 0, "ZeroDivisionError"),
    "exit code": (lambda room: 4, "exit code 4"),
    "no line": (lambda room: 2, "not one line of error"),
    "writes elsewhere": (lambda room: (room.box.parent / "x").write_text("x") and 0, "writes"),
    "removes": (lambda room: (room.folder / "outer" / "secret.txt").unlink(), "os.remove"),
    "reads what was planted": (
        lambda room: bool((room.folder / "outer/secret.txt").read_text()) - 1,
        "reads",
    ),
    "a program": (lambda room: subprocess.run(["true"], check=True).returncode, "starts true"),
    "memory": (lambda room: int(np.ones(150_000_000).sum() < 0), "GiB of memory|MemoryError"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_must_not_be_is_a_finding(what, fuzzing, room, monkeypatch):
    act, words = WRONG[what]
    attempt, _ = made_input(fuzzing, room, 0)
    monkeypatch.setattr("ancf_petsc.cli.main", lambda argv: act(room))
    answer = fuzzing("worker").run(attempt, fuzzing("watch").Watch())
    assert fuzzing("tally").outcome(answer) == "finding"
    assert any(word in " ".join(answer["wrong"]) for word in words.split("|"))


def test_other_numbers_than_the_second_reader_s_are_a_finding(fuzzing, room, monkeypatch):
    from ancf_petsc.mesh import read

    attempt, _ = made_input(fuzzing, room, 0)
    monkeypatch.setattr("ancf_petsc.cli.main", lambda argv: 0)
    watch = fuzzing("watch").Watch()
    assert fuzzing("worker").run(attempt, watch)["second"] == "same"
    ordinary = read.read_ordinary

    def shifted(path):
        raw = ordinary(path)
        raw.points[0, 0] += 0.01
        return raw

    monkeypatch.setattr(read, "read_ordinary", shifted)
    answer = fuzzing("worker").run(attempt, watch)
    assert answer["second"] == "different"
    assert fuzzing("tally").outcome(answer) == "finding"


def test_a_small_campaign_finds_nothing(project, tmp_path, environment):
    """Some of every kind, in processes as `scripts/fuzz` has them."""
    command = [sys.executable, project / "scripts" / "fuzz", "--quick", "--jobs", "2"]
    done = subprocess.run(
        command, env=environment | {"TMPDIR": str(tmp_path)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout
    assert " 0 findings" in done.stdout
    assert "accepted" in done.stdout
    assert not any(tmp_path.glob("ancf-fuzz-*"))


def test_the_campaign_that_is_kept_has_no_finding(project):
    table = json.loads((project / "docs" / "verification" / "fuzz.json").read_text())
    assert table["inputs"] >= 12_000
    assert table["findings"] == 0
    for kind, row in table["kinds"].items():
        assert row.get("accepted", 0) + row.get("refused", 0) + row.get("ended early", 0) == row["inputs"], (
            kind
        )
        assert row["longest_seconds"] <= 10.0
        assert row["most_memory_bytes"] <= 2**30
    meshes = {kind: row for kind, row in table["kinds"].items() if kind not in ("case", "results", "other")}
    assert len(meshes) >= 5
    assert all(
        row["second"].get("same", 0) > 0 and "different" not in row["second"] for row in meshes.values()
    )
