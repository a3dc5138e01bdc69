"""A run's folder: who may write into it, what a new run takes away, the summary."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest
from mpi4py import MPI

from ancf_petsc.errors import CaseError
from ancf_petsc.results.folder import RUN_FILES, check_folder, claim_folder, run_title, write_summary
from ancf_petsc.results.store import ResultStore

SUMMARY = {
    "title": "Block",
    "status": "done",
    "seconds": {"import": 0.1, "read": 0.1, "setup": 0.1, "solve": 0.1, "output": 0.1, "total": 0.5},
    "memory_peak_bytes": [1, 2],
    "nodes": np.int64(234),
    "elements": 816,
    "dof": 702,
    "ranks": 2,
    "iterations": {"newton": 3, "linear": 3},
    "final": {"force": np.float64(-0.1), "energy": np.nan},
    "versions": {"petsc": "3.18.5"},
}


def snapshot(folder):
    """Name, content and time of change of all that is in a folder."""
    return {
        path: (path.stat().st_mtime_ns, path.read_bytes())
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def refused(path, title="Block"):
    """The message of a refusal, which is exit code 2 and touches nothing."""
    with pytest.raises(CaseError) as told:
        check_folder(path, title)
    assert told.value.exit_code == 2
    return str(told.value)


def test_new_and_empty_folders_may_be_used_and_are_left_as_they_are(tmp_path):
    check_folder(tmp_path, "Block")
    check_folder(tmp_path / "a" / "b", "Block")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    assert "file: --out: is a file" in refused(tmp_path / "file")
    assert f"cannot be made: {tmp_path / 'file'} is a file" in refused(tmp_path / "file" / "below")


def test_a_folder_that_cannot_be_written_is_told_to_root_too():
    assert "cannot be written" in refused("/proc/run")
    assert "cannot be written" in refused("/proc")


def test_files_of_others_are_protected(tmp_path):
    (tmp_path / "thesis.tex").write_text("all my work")
    before = snapshot(tmp_path)
    message = refused(tmp_path)
    assert "not empty: found 'files that do not belong to a run'" in message
    assert "--force" in message
    check_folder(tmp_path, "Block", force=True)
    assert snapshot(tmp_path) == before


def test_a_run_gives_way_to_one_of_the_same_title_only(tmp_path):
    ResultStore(tmp_path, MPI.COMM_SELF, "Block", "SI")
    check_folder(tmp_path, "Block")
    message = refused(tmp_path, "Pendulum")
    assert "found \"a run of 'Block'\", expected an empty folder, or a run of 'Pendulum'" in message


def test_the_summary_tells_the_title_where_the_results_are_broken(tmp_path):
    write_summary(tmp_path, **SUMMARY)
    (tmp_path / "results.h5").write_bytes(b"cut short")
    assert run_title(tmp_path) == "Block"
    (tmp_path / "summary.json").write_text("{")
    assert run_title(tmp_path) is None


def test_a_new_run_takes_away_the_files_of_the_earlier_one_only(tmp_path):
    for name in (*RUN_FILES, "notes.txt", "case.toml", "force_stroke.png"):
        (tmp_path / name).write_text("old")
    claim_folder(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml", "force_stroke.png", "notes.txt"]
    claim_folder(tmp_path / "new" / "folder")
    assert (tmp_path / "new" / "folder").is_dir()


def test_the_summary_is_json_that_any_reader_takes(tmp_path):
    write_summary(tmp_path, **SUMMARY, note="assumed")
    read = json.loads((tmp_path / "summary.json").read_text(), parse_constant=pytest.fail)
    assert read == {**SUMMARY, "final": {"force": -0.1, "energy": None}, "note": "assumed"}
    assert os.listdir(tmp_path) == ["summary.json"]


def test_an_unknown_status_is_refused(tmp_path):
    with pytest.raises(ValueError, match="'fine' is none of"):
        write_summary(tmp_path, **{**SUMMARY, "status": "fine"})
