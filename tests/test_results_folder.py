"""A run's folder: who may write into it, what a new run takes away, the summary."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import signal
import socket
import subprocess
import sys
from contextlib import nullcontext

import numpy as np
import pytest
from mpi4py import MPI

from ancf_petsc.errors import CaseError
from ancf_petsc.results.folder import RUN_FILES, check_folder, claim_folder, run_in, write_summary
from ancf_petsc.results.mark import MARK, SPARE_BYTES, read_mark
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


def test_a_run_gives_way_to_one_of_the_same_hash_only(tmp_path):
    """Also one that was cut short and has no summary: the results have the hash of case and mesh."""
    ResultStore(tmp_path, MPI.COMM_SELF, "Block", "SI", facts={"hash": "abc"})
    check_folder(tmp_path, "Block", "abc")
    check_folder(tmp_path, "Renamed in the case", "abc")
    for other in ("abd", ""):
        with pytest.raises(CaseError, match="with other values or another mesh.*--out DIR.*--force"):
            check_folder(tmp_path, "Block", other)
        check_folder(tmp_path, "Block", other, force=True)
        with pytest.raises(CaseError, match="with other values"):
            claim_folder(tmp_path, "Block", other)  # what ended there since the check
    assert read_mark(tmp_path) is None


def test_a_run_that_recorded_no_case_needs_force(tmp_path):
    write_summary(tmp_path, **SUMMARY)
    with pytest.raises(CaseError, match="did not record its case"):
        check_folder(tmp_path, "Block", "abc")


def test_the_summary_says_what_the_run_was_where_the_results_are_broken(tmp_path):
    write_summary(tmp_path, **SUMMARY, hash="abc")
    (tmp_path / "results.h5").write_bytes(b"cut short")
    assert run_in(tmp_path) == ("Block", "abc")
    (tmp_path / "summary.json").write_text("{")
    assert run_in(tmp_path) is None
    (tmp_path / MARK).write_text('{"title": "Block", "hash": "abc"}')  # killed before its first output
    assert run_in(tmp_path) == ("Block", "abc")


def test_a_new_run_takes_away_the_files_of_the_earlier_one_only(tmp_path):
    for name in (*RUN_FILES, "notes.txt", "case.toml", "force_stroke.png"):
        (tmp_path / name).write_text("old")
    claim_folder(tmp_path, force=True).release()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml", "force_stroke.png", "notes.txt"]
    mark = claim_folder(tmp_path / "new" / "folder", "Block", "abc")
    assert read_mark(tmp_path / "new" / "folder")["hash"] == "abc"
    mark.release()
    assert list((tmp_path / "new" / "folder").iterdir()) == []


def test_a_live_run_keeps_others_out_of_its_folder(tmp_path):
    """Before a run begins and when it takes the folder; force changes nothing. Afterwards it is free again."""
    mark = claim_folder(tmp_path, "Block", "abc")
    for attempt in (check_folder, claim_folder):
        for force in (False, True):
            with pytest.raises(CaseError, match=rf"another run is writing.*process {os.getpid()} on"):
                attempt(tmp_path, "Block", "abc", force=force)
    mark.release()
    claim_folder(tmp_path, "Block", "abc").release()


def test_the_mark_of_a_killed_run_does_not_stop_the_next(tmp_path):
    """The system drops the lock with the process; the mark that stays says what the run was."""
    code = "import sys, os, signal; from ancf_petsc.results.folder import claim_folder\n"
    code += "claim_folder(sys.argv[1], 'Block', 'abc'); os.kill(os.getpid(), signal.SIGKILL)"
    done = subprocess.run([sys.executable, "-c", code, tmp_path], timeout=60)
    assert done.returncode == -signal.SIGKILL
    assert read_mark(tmp_path)["hash"] == "abc"
    check_folder(tmp_path, "Block", "abc")
    claim_folder(tmp_path, "Block", "abc").release()
    assert not (tmp_path / MARK).exists()


@pytest.mark.parametrize(
    ("mark", "alive", "forced"),
    [
        ({"host": socket.gethostname(), "pid": os.getpid()}, True, True),
        ({"host": socket.gethostname(), "pid": os.getpid(), "start": "another process had the number"}, False, False),
        ({"host": socket.gethostname(), "pid": 2**22 + 1}, False, False),
        ({"host": "another", "pid": 1}, True, False),
        ({}, False, False),
    ],
)  # fmt: skip
def test_without_locks_host_and_process_decide(mark, alive, forced, tmp_path, monkeypatch):
    """A file system without locks, as some over the network are: only force passes the mark of another host."""

    def no_locks(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    (tmp_path / MARK).write_text(json.dumps({**mark, "title": "Block", "hash": "abc"}))
    for force, refuses in ((False, alive), (True, forced)):
        with pytest.raises(CaseError, match="another run") if refuses else nullcontext():
            check_folder(tmp_path, "Block", "abc", force=force)
    if not alive:
        claim_folder(tmp_path, "Block", "abc").release()


def test_the_mark_keeps_space_for_the_summary(tmp_path):
    mark = claim_folder(tmp_path, "Block", "abc")
    before = (tmp_path / MARK).stat().st_size
    mark.make_room()
    assert before - (tmp_path / MARK).stat().st_size == SPARE_BYTES
    assert read_mark(tmp_path)["title"] == "Block"
    mark.release()


def test_the_summary_is_json_that_any_reader_takes(tmp_path):
    write_summary(tmp_path, **SUMMARY, note="assumed")
    read = json.loads((tmp_path / "summary.json").read_text(), parse_constant=pytest.fail)
    assert read == {**SUMMARY, "final": {"force": -0.1, "energy": None}, "note": "assumed"}
    assert os.listdir(tmp_path) == ["summary.json"]


def test_an_unknown_status_is_refused(tmp_path):
    with pytest.raises(ValueError, match="'fine' is none of"):
        write_summary(tmp_path, **{**SUMMARY, "status": "fine"})
