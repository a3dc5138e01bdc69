"""What the system refuses a run: space, rights, a file that others hold or take away. One line, exit code 4, and
what was written stays readable.
"""

from __future__ import annotations

import errno
import json
import logging
import os
import re
import resource
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pytest
import results_writer as run
from mpi4py import MPI

from ancf_petsc import case_of_run, load_case, log, open_results
from ancf_petsc.analysis.run import run_case
from ancf_petsc.cli import main
from ancf_petsc.errors import CaseError, EnvironmentProblem, cannot_write, writing
from ancf_petsc.results import space
from ancf_petsc.results.mark import MARK
from ancf_petsc.results.store import ResultStore
from ancf_petsc.results.tables import CsvTable, read_table


@contextmanager
def largest_file(size):
    """A limit on files stands for a disk of that size: it needs no rights."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def store(tmp_path):
    """A store with a mesh of one brick."""
    points, cells = run.mesh()
    made = ResultStore(tmp_path, MPI.COMM_SELF, "t", "SI")
    made.write_mesh(points, "tetra", cells, np.arange(8), np.arange(6))
    yield made
    made.close()


def fill(store, rows=3000):
    """Steps until the disk is full: how many are whole, and what was said."""
    points, _ = run.mesh()
    for step in range(50):
        try:
            store.write_step(float(step), {"displacement": points + step}, {"a": np.zeros((6, rows))})
        except EnvironmentProblem as error:
            return step, str(error)
    return 50, ""


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, r"no space is left on the disk \([\d.e+]+ MB free\); make room"),
        (errno.EDQUOT, "the disk quota is used up"),
        (errno.EFBIG, "would exceed the allowed size; raise ulimit -f"),
        (errno.EACCES, "no permission to write"),
        (errno.EROFS, "the file system is read-only"),
        (errno.ENOENT, "it has vanished"),
        (errno.EAGAIN, "another program has it open and locked; close it there"),
        (errno.EIO, "the device reports an error"),
        (errno.ENOTEMPTY, "Directory not empty"),
    ],
)
def test_messages_say_what_happened(number, words, tmp_path):
    """Also where HDF5 has the number in its text only."""
    hdf5 = OSError(
        f"Can't write data (file write failed: errno = {number}, error message = '...', buf = 0x1)"
    )
    for error in (OSError(number, os.strerror(number)), *([hdf5] if number != errno.ENOTEMPTY else [])):
        problem = cannot_write(error, tmp_path / "results.h5")
        assert isinstance(problem, EnvironmentProblem)
        assert problem.exit_code == 4
        assert str(problem).startswith(f"{tmp_path}/results.h5: cannot be written: ")
        assert re.search(words, str(problem)), str(problem)


def test_a_folder_that_has_gone_is_named(tmp_path):
    missing = FileNotFoundError(errno.ENOENT, "No such file")
    assert f"the folder {tmp_path}/gone has vanished" in str(
        cannot_write(missing, tmp_path / "gone" / "x.csv")
    )


@pytest.mark.parametrize("noticed", ["beforehand", "while HDF5 writes"])
def test_a_full_disk_leaves_whole_steps(noticed, store, tmp_path, monkeypatch):
    """HDF5 1.10 crashes at the end of the process if what it could not write is still in its hands."""
    if noticed != "beforehand":
        monkeypatch.setattr(space.DiskSpace, "reserve", lambda self, size: None)
    with largest_file(500_000):
        whole, said = fill(store)
    assert 1 <= whole < 50
    assert "exceed the allowed size" in said
    assert h5py.h5f.get_obj_count(h5py.h5f.OBJ_ALL, h5py.h5f.OBJ_FILE) == 0
    results = open_results(tmp_path)
    for step in range(whole):
        np.testing.assert_array_equal(results.field("displacement", step), run.mesh()[0] + step)
    if noticed == "beforehand":
        assert list(results.times) == list(range(whole))


def test_space_that_is_not_needed_is_given_back(store, tmp_path):
    """Set aside with a margin: the file afterwards is as long as what is in it."""
    store.write_step(0.0, {"displacement": run.mesh()[0]}, {})
    store.close()
    assert (tmp_path / "results.h5").stat().st_size < 30_000


FULL = """
import resource, sys
from pathlib import Path
from mpi4py import MPI
import numpy as np
from ancf_petsc.errors import EnvironmentProblem
from ancf_petsc.results import space
from ancf_petsc.results.store import ResultStore
folder, reserve, way = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
if reserve == "not":
    space.DiskSpace.reserve = lambda self, size: None
comm = MPI.COMM_WORLD
own = np.full((1000, 3), float(comm.rank))
resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, resource.RLIM_INFINITY))
store = ResultStore(folder, comm, "t", "SI", parallel=None if way == "parallel" else False)
cells = np.arange(4)[None] if comm.rank == 0 else np.empty((0, 4), int)
store.write_mesh(own, "tetra", cells, np.arange(1000), np.arange(len(cells)))
try:
    for step in range(50):
        store.write_step(float(step), {"displacement": own}, {})
except EnvironmentProblem as error:
    (folder / f"said_{comm.rank}").write_text(f"{step} {error}")
"""


@pytest.mark.parametrize(("ranks", "reserve", "way"), [(2, "not", "parallel"), (3, "not", "gathered")])
def test_all_ranks_say_the_same_and_end(ranks, reserve, way, mpirun, tmp_path):
    """Neither a hang nor a crash at the end, where HDF5 closes what is open."""
    mpirun(ranks, ["-c", FULL, tmp_path, reserve, way], timeout=240)
    said = {(tmp_path / f"said_{rank}").read_text() for rank in range(ranks)}
    assert len(said) == 1
    step, _, words = said.pop().partition(" ")
    assert "cannot be written" in words
    results = open_results(tmp_path)
    assert len(results.times) >= int(step) > 0
    expected = np.repeat(np.arange(ranks), 1000)
    for whole in range(int(step)):
        np.testing.assert_array_equal(results.field("displacement", whole)[:, 0], expected)


def hold(path, mode):
    """Another program that has the file open until its standard input ends."""
    code = f"import h5py, sys; f = h5py.File({str(path)!r}, {mode!r}); print('held', flush=True); sys.stdin.read()"
    other = subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    return other, other.stdout.readline().strip()


def test_a_program_that_opened_it_for_writing_stops_the_run_unharmed(tmp_path, monkeypatch):
    """On closing, such a program writes what it knew of the file, and what was added since is lost."""
    monkeypatch.setattr(space, "WAIT", 0.2)
    monkeypatch.setattr(
        space.DiskSpace, "_lock", lambda self, number: None
    )  # it came before the first output
    store = ResultStore(tmp_path, MPI.COMM_SELF, "t", "SI")
    points, cells = run.mesh()
    store.write_mesh(points, "tetra", cells, np.arange(8), np.arange(6))
    store.write_step(0.0, {"displacement": points}, {})
    other, said = hold(tmp_path / "results.h5", "r+")
    assert said == "held"
    monkeypatch.undo()
    monkeypatch.setattr(space, "WAIT", 0.2)
    with pytest.raises(EnvironmentProblem, match="another program has it open and locked; close it there"):
        store.write_step(1.0, {"displacement": points}, {})
    other.communicate("")
    assert open_results(tmp_path).times.tolist() == [0.0]
    store.close()


@pytest.mark.parametrize("forced", ["", "TRUE"])
def test_while_a_run_goes_on_others_may_read_and_not_write(forced, store, tmp_path, monkeypatch):
    """Also where the environment makes HDF5 lock every file."""
    if forced:
        monkeypatch.setenv("HDF5_USE_FILE_LOCKING", forced)
    points, _ = run.mesh()
    store.write_step(0.0, {"displacement": points}, {})
    writer, said = hold(tmp_path / "results.h5", "r+")
    assert (said, "unable to lock file" in writer.communicate("")[1]) == ("", True)
    reader, said = hold(tmp_path / "results.h5", "r")
    assert said == "held"
    store.write_step(1.0, {"displacement": points}, {})
    assert open_results(tmp_path).times.tolist() == [0.0, 1.0]
    reader.communicate("")


def test_results_replaced_by_another_program_are_not_written_to(store, tmp_path):
    (tmp_path / "new.h5").write_bytes(b"of another run")
    os.replace(tmp_path / "new.h5", tmp_path / "results.h5")
    with pytest.raises(EnvironmentProblem, match="it was replaced or removed"):
        store.write_step(0.0, {"displacement": run.mesh()[0]}, {})
    assert (tmp_path / "results.h5").read_bytes() == b"of another run"


def test_a_table_keeps_whole_lines(tmp_path):
    """A disk that runs full takes half a line without a word."""
    with CsvTable(tmp_path / "curve.csv", ["time", "force"]) as table:
        table.append([0.0, 1.0])
        with largest_file(30):
            pytest.raises(OSError, table.append, [0.123456789, 0.123456789])
        table.append([1.0, 2.0])
    assert read_table(tmp_path / "curve.csv")["time"].tolist() == [0.0, 1.0]


def test_a_device_without_space_is_an_environment_problem():
    with (
        pytest.raises(EnvironmentProblem, match="/dev/full: cannot be written: no space"),
        writing("/dev/full"),
    ):
        CsvTable(Path("/dev/full"), ["time"])


def test_a_log_without_space_loses_lines_and_says_so_once(capsys):
    log.configure()
    try:
        log.attach_file(Path("/dev/full"))
        for _ in range(3):
            logging.getLogger("ancf").info("a line")
    finally:
        log.close()
        logging.getLogger("ancf").propagate = True
    said = capsys.readouterr()
    assert said.out.count("a line") == 3
    assert said.out.count("warning: /dev/full: cannot be written: no space") == 1
    assert said.err == ""


# --- whole runs


def block(project, **changes):
    return load_case(project / "cases/pvc_block").with_changes({"statics.steps": 4, **changes})


def test_a_run_on_a_full_disk_says_so_in_one_line(project, tmp_path, capsys):
    """Exit code 4; whole steps, one row for each, the reason in the summary, and the folder is free again."""
    out = tmp_path / "run"
    with largest_file(450_000):
        code = main(["run", str(project / "cases/pvc_block"), "--out", str(out), "--set", "statics.steps=4"])
    log.close()
    said = capsys.readouterr().err
    assert (code, said.count("\n")) == (4, 1)
    assert said.startswith(
        f"error: {out}/results.h5: cannot be written: the file would exceed the allowed size"
    )
    results = open_results(out)
    assert 0 < len(results.times) < 5
    assert results.curve["pseudo_time"].tolist() == results.times.tolist()
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["status"], summary["final"]["pseudo_time"]) == ("stopped", results.times[-1])
    assert "exceed the allowed size" in summary["reason"]
    assert not (out / MARK).exists()


def test_a_full_disk_ends_all_ranks(mpirun, project, tmp_path):
    # MPI before the limit: some keep the memory that ranks share in files, larger than that.
    code = "from mpi4py import MPI\nimport resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (450_000, -1))\n"
    code += "from ancf_petsc.cli import main; sys.exit(main(sys.argv[1:]))"
    words = ["run", project / "cases/pvc_block", "--out", tmp_path / "run", "--set", "statics.steps=4"]
    done = mpirun(3, ["-c", code, *words, "--quiet"], code=4, timeout=300)
    assert done.stderr.count("error: ") == 1
    assert "Traceback" not in done.stderr
    assert len(open_results(tmp_path / "run").times) > 0


def test_a_folder_that_vanishes_ends_the_run(project, tmp_path):
    """Nothing brings it back; the error is that of the outputs, not of the summary that has no place."""

    def remove(done):
        shutil.rmtree(tmp_path / "run", ignore_errors=True)

    with pytest.raises(EnvironmentProblem, match=f"the folder {tmp_path}/run has vanished; do not remove"):
        run_case(block(project), tmp_path / "run", watch=remove)
    assert not (tmp_path / "run").exists()


def test_a_summary_without_space_is_an_error_of_its_own(project, tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("ancf_petsc.analysis.ending.write_summary", full)
    with pytest.raises(EnvironmentProblem, match=r"summary\.json: cannot be written: no space is left"):
        run_case(block(project), tmp_path / "run")
    assert len(open_results(tmp_path / "run").times) == 5


def test_two_runs_at_once_do_not_share_a_folder(project, tmp_path):
    """The second is refused while the first goes on, and the first is not disturbed."""
    refusals = []

    def try_another(done):
        if not refusals:
            with pytest.raises(CaseError, match="another run is writing into this folder") as refused:
                run_case(block(project), tmp_path / "run", force=True)
            refusals.append(refused.value.exit_code)

    run_case(block(project), tmp_path / "run", watch=try_another)
    assert refusals == [2]
    assert len(open_results(tmp_path / "run").times) == 5


def test_a_finished_run_is_replaced_by_the_same_case_only(project, tmp_path, caplog):
    run_case(block(project), tmp_path)
    with caplog.at_level(logging.INFO, "ancf"):
        run_case(block(project), tmp_path)
    assert f"{tmp_path}: the earlier run of this case is replaced" in caplog.messages
    before = (tmp_path / "results.h5").read_bytes()
    with pytest.raises(
        CaseError, match="with other values or another mesh.*--out DIR, or overwrite by --force"
    ):
        run_case(block(project, **{"material.young": 1e6}), tmp_path)
    assert (tmp_path / "results.h5").read_bytes() == before
    run_case(block(project, **{"material.young": 1e6}), tmp_path, force=True)


def test_a_run_says_what_it_computed_and_is_repeated_by_that(project, tmp_path, capsys):
    """Case file with --set and PETSc options, mesh with hash, date, host, versions: three times the same."""
    shutil.copytree(project / "cases/pvc_block", tmp_path / "block")
    mesh = tmp_path / "block.msh"
    shutil.copy(project / "meshes/pvc_block_234.msh", mesh)
    out = tmp_path / "a run"
    changes = ["--set", "mesh.file=../block.msh", "statics.steps=3", "material.law=neo_hooke"]
    words = ["run", str(tmp_path / "block"), "--out", str(out), *changes, "--", "-ksp_rtol", "1e-7"]
    assert main(words) == 0
    assert f"ancf view '{out}' shows" in capsys.readouterr().out
    first = json.loads((out / "summary.json").read_text())
    facts = open_results(out).facts
    said = (out / "log.txt").read_text()
    log.close()
    text = first["case"]["text"]
    for part in ('law = "neo_hooke"', "steps = 3", 'ksp_rtol = "1e-7"'):
        assert part in text
    assert facts["case"] == text
    assert all(f"    {line}".rstrip() in said for line in text.splitlines())
    for name in ("hash", "date", "host", "command"):
        assert first[name] == facts[name]
        assert first[name] in said
    assert first["mesh"] == {"file": str(mesh), "sha256": facts["mesh_sha256"]}
    assert facts["mesh_sha256"] in said
    assert json.loads(facts["versions"]) == first["versions"]
    (tmp_path / "block" / "case.toml").unlink()  # the run knows it all
    assert main(["run", str(out), "--again", "--out", str(tmp_path / "b"), "--quiet"]) == 0
    assert main(["run", str(out), "--again", "--quiet"]) == 0
    assert (tmp_path / "b" / "curve.csv").read_bytes() == (out / "curve.csv").read_bytes()
    assert json.loads((out / "summary.json").read_text())["case"] == first["case"]
    (out / "summary.json").unlink()  # as in a run that was killed
    assert case_of_run(out).text == text
    mesh.write_bytes(mesh.read_bytes() + b"\n")
    assert main(["run", str(out), "--again"]) == 2
    assert "block.msh: --again: the mesh is not the one of this run any more" in capsys.readouterr().err
    mesh.unlink()
    assert main(["run", str(out), "--again"]) == 2
    assert "the mesh of this run is gone" in capsys.readouterr().err
    log.close()


@pytest.mark.parametrize(
    ("folder", "message"),
    [("none", "no results here"), ("old", "this run did not record its case")],
)  # fmt: skip
def test_what_cannot_be_repeated_is_an_error(folder, message, tmp_path, capsys):
    run.write(tmp_path / "old", MPI.COMM_SELF)
    assert main(["run", str(tmp_path / folder), "--again"]) == 2
    assert message in capsys.readouterr().err
    log.close()


def test_a_run_folder_given_as_a_case_gets_a_hint(tmp_path, capsys):
    folder = tmp_path / "my run"
    run.write(folder, MPI.COMM_SELF)
    assert main(["run", str(folder)]) == 2
    assert f"ancf run '{folder}' --again repeats it" in capsys.readouterr().err


def test_facts_too_long_for_an_attribute_are_kept(tmp_path):
    """HDF5 keeps attributes within 64 KiB; a case with a long table of a ramp is longer."""
    text = "a" * 200_000
    ResultStore(tmp_path, MPI.COMM_SELF, "t" * 70_000, "SI", facts={"case": text}).write_mesh(
        *run.mesh()[:1], "tetra", run.mesh()[1], np.arange(8), np.arange(6)
    )
    results = open_results(tmp_path)
    assert results.facts["case"] == text
    assert results.title == "t" * 70_000


@pytest.mark.parametrize(
    ("words", "left"),
    [
        (["plot", "RUN", "--out", "OUT/p"], {"p"}),
        (["view", "RUN", "--screenshot", "OUT/a.png"], set()),
        (["mesh", "cube", "--divisions", "4", "4", "4", "--out", "OUT/old.msh"], set()),
        (["new", "OUT/mine"], set()),
        (["modes", "CASE", "--count", "2", "--out", "OUT/m"], {"m"}),
    ],
)
def test_every_verb_that_writes_says_what_the_disk_said(words, left, project, tmp_path, capsys):
    """Exit code 4, one line, no half file; a mesh of the same name from before stays."""
    run.write(tmp_path / "run", MPI.COMM_SELF)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "old.msh").write_text("a mesh")
    names = {
        "RUN": str(tmp_path / "run"),
        "CASE": str(project / "cases/bar_tension"),
        "OUT": str(tmp_path / "out"),
    }
    for name, path in names.items():
        words = [word.replace(name, path) for word in words]
    with largest_file(3000):
        code = main(words)
    log.close()
    said = capsys.readouterr().err
    assert (code, said.count("\n")) == (4, 1), said
    assert "cannot be written" in said
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"old.msh", *left}
    assert (tmp_path / "out" / "old.msh").read_text() == "a mesh"


@pytest.mark.parametrize(
    ("words", "key"),
    [
        (["plot", "RUN", "--out", "/proc/nothing"], "--out"),
        (["view", "RUN", "--screenshot", "/proc/a.png"], "--screenshot"),
        (["view", "RUN", "--movie", "/proc/a.gif"], "--movie"),
        (["mesh", "cube", "--divisions", "1", "1", "1", "--out", "/proc/a.msh"], "--out"),
    ],
)
def test_a_place_where_nothing_can_be_written_is_wrong_input(words, key, tmp_path, capsys):
    run.write(tmp_path / "run", MPI.COMM_SELF)
    assert main([str(tmp_path / "run") if word == "RUN" else word for word in words]) == 2
    said = capsys.readouterr().err
    assert key in said
    assert "cannot be written" in said
    assert said.count("\n") == 1


def test_what_no_part_of_the_program_foresaw_is_still_one_line(monkeypatch, capsys):
    from ancf_petsc import cli

    def broken(_):
        raise OSError(errno.EIO, "Input/output error", "/mnt/x")

    monkeypatch.setattr(cli, "_command", broken)
    assert main(["run"]) == 4
    assert capsys.readouterr().err == "error: the system refuses: [Errno 5] Input/output error: '/mnt/x'\n"
