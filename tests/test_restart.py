"""Runs that go on from a checkpoint do what the uninterrupted run does, to the last bit on one rank."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from motion_cases import pendulum
from restart_cases import differences, followed, largest_difference, snapshots, with_checkpoints
from statics_cases import bar, block

from ancf_petsc import CaseError, EnvironmentProblem, Interrupted, case_of_run, open_results, run
from ancf_petsc.analysis.checkpoint import Checkpoints
from ancf_petsc.analysis.static_run import StaticRun
from ancf_petsc.cli import main
from ancf_petsc.results.checkpoint_file import NAMES
from ancf_petsc.results.folder import check_folder
from ancf_petsc.results.mark import Mark

PVC = "pvc_block_234.msh"
DRIVEN = [
    {"group": "hinge", "fix": ["x", "y"], "move": {"z": 0.02}, "ramp": [[0, 0], [0.3, 1], [0.6, 0.5], [1, 1]]}
]


def straight(data, **changes):
    """The same with the top moved in proportion to the pseudo-time, or at once."""
    data["constraint"][-1].update({"ramp": "linear", **changes})
    return data


def moved(integrator, every, petsc=None, constraint=None, **how):
    tables = {"constraint": constraint} if constraint else {}
    data = pendulum({"integrator": integrator, "outputs": 4, **how}, **tables)
    return ({**data, "petsc": petsc} if petsc else data), every


CASES = {
    "iterative": (block(PVC, 0.02, steps=6), "2 steps"),
    "factored": (bar("bar_2x2x10.msh", gravity=True), "1 step"),
    "multigrid": ({**block(PVC, 0.02, steps=4), "petsc": {"ksp_type": "cg", "pc_type": "gamg"}}, "2 steps"),
    "arc length": (straight(block(PVC, 0.02, steps=4, control="arc_length")), "3 steps"),
    "loaded from the start": (straight(block(PVC, 0.02, steps=2), ramp="constant"), "4 steps"),
    "a path that ends": (block(PVC, 0.055, steps=8), "3 steps"),
    "alpha, compiled": moved("generalized_alpha", "13 steps", duration=0.4, step=0.01, damping=0.5),
    "alpha": moved("generalized_alpha", "13 steps", None, DRIVEN, duration=0.4, step=0.01, damping=0.5),
    "energy-momentum": moved("energy_momentum", "13 steps", None, DRIVEN, duration=0.4, step=0.01),
    "central, compiled": moved("central_difference", "100 steps", duration=0.05, step=1e-4),
    "central": moved("central_difference", "37 steps", None, DRIVEN, duration=0.05, step=5e-4),
    "adaptive, compiled": moved("runge_kutta_5dp", "5 steps", duration=0.02, tolerance=1e-6),
    "adaptive": moved("runge_kutta_5dp", "5 steps", {"ts_max_reject": 99}, duration=0.02, tolerance=1e-6),
    "dormand-prince": moved("runge_kutta_5dp", "33 steps", None, DRIVEN, duration=0.02, step=2e-4),
    "runge-kutta 4": moved("runge_kutta_4", "33 steps", duration=0.02, step=2e-4),
    "rosenbrock": moved("rosenbrock", "11 steps", duration=0.2, tolerance=1e-5),
    "bdf, adaptive": moved("bdf", "11 steps", duration=0.2, tolerance=1e-4),
    "bdf": moved("bdf", "7 steps", None, DRIVEN, duration=0.4, step=0.01),
    "theta": moved("theta", "13 steps", None, DRIVEN, duration=0.4, step=0.01, damping=0.3),
}


@pytest.mark.parametrize("name", CASES)
def test_a_run_that_goes_on_is_the_uninterrupted_one(name, tmp_path):
    """From a checkpoint at the beginning, one in the middle and the last."""
    case = with_checkpoints(*CASES[name])
    with snapshots(tmp_path) as kept:
        end = followed(case, tmp_path / "whole")
    assert len(kept) >= 2
    for folder in {kept[0], kept[len(kept) // 2], kept[-1]}:
        assert followed(case, folder, restart=True) == end
        assert differences(tmp_path / "whole", folder) == [], folder.name


def test_checkpoints_change_nothing(tmp_path):
    """Neither the numbers, nor what makes two runs the same."""
    data = block(PVC, 0.02, steps=4)
    run(with_checkpoints(data, "off"), tmp_path / "off")
    run(with_checkpoints(data, "1 step"), tmp_path / "every")
    assert differences(tmp_path / "off", tmp_path / "every") == []
    hashes = {json.loads((tmp_path / name / "summary.json").read_text())["hash"] for name in ("off", "every")}
    assert len(hashes) == 1
    assert not any((tmp_path / "off" / name).exists() for name in NAMES)
    assert all((tmp_path / "every" / name).exists() for name in NAMES)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A folder with the whole run of a static case and its snapshots, and the case."""
    folder = tmp_path_factory.mktemp("kept")
    case = with_checkpoints(block(PVC, 0.02, steps=6), "2 steps")
    with snapshots(folder) as found:
        run(case, folder / "whole")
    return folder, case, found


@pytest.fixture
def stopped(kept, tmp_path):
    """A run that was killed after its second checkpoint, in a folder of the test."""
    shutil.copytree(kept[2][1], tmp_path / "run")
    return tmp_path / "run"


def test_a_finished_run_says_so_and_nothing_is_touched(kept, caplog):
    whole = kept[0] / "whole"
    before = {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in whole.iterdir()}
    caplog.set_level("INFO", "ancf")
    run(kept[1], whole, restart=True)
    assert "is done; nothing is left to do" in caplog.text
    assert before == {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in whole.iterdir()}


def test_without_folder_or_checkpoint_it_starts_from_the_beginning_and_says_so(kept, tmp_path, caplog):
    caplog.set_level("INFO", "ancf")
    run(kept[1], tmp_path / "new", restart=True)
    assert "there is no such folder: the run starts from the beginning" in caplog.text
    assert differences(kept[0] / "whole", tmp_path / "new") == []
    for name in (*NAMES, "summary.json"):
        (tmp_path / "new" / name).unlink()
    run(kept[1], tmp_path / "new", restart=True)
    assert "there is no checkpoint: the run starts from the beginning" in caplog.text


def test_the_newest_checkpoint_damaged_the_one_before_is_taken(kept, stopped, caplog):
    newest = max((stopped / name for name in NAMES), key=lambda path: path.stat().st_mtime_ns)
    os.truncate(newest, newest.stat().st_size // 2)
    (stopped / "checkpoint_xyz.part").write_bytes(b"half")
    run(kept[1], stopped, restart=True)
    assert "damaged (cut short" in caplog.text or "digest does not fit" in caplog.text
    assert differences(kept[0] / "whole", stopped) == []
    assert not (stopped / "checkpoint_xyz.part").exists()


def test_a_lost_rename_leaves_the_checkpoint_before(kept, stopped):
    newest = max((stopped / name for name in NAMES), key=lambda path: path.stat().st_mtime_ns)
    newest.rename(stopped / "checkpoint_abc.part")
    run(kept[1], stopped, restart=True)
    assert differences(kept[0] / "whole", stopped) == []


def test_both_damaged_is_an_error_that_says_so(kept, stopped):
    for name in NAMES:
        data = bytearray((stopped / name).read_bytes())
        data[len(data) // 2] ^= 1
        (stopped / name).write_bytes(data)
    with pytest.raises(EnvironmentProblem) as told:
        run(kept[1], stopped, restart=True)
    assert "no checkpoint can be gone on from" in str(told.value)
    assert all(f"{name}: its digest does not fit" in str(told.value) for name in NAMES)
    assert "run without --restart" in str(told.value)


def test_what_was_written_after_the_checkpoint_is_cut_off(kept, stopped):
    """Rows, half a row, half a step, HDF5's tables half changed."""
    with (stopped / "curve.csv").open("a") as file:
        file.write((kept[0] / "whole" / "curve.csv").read_text().splitlines()[-1] + "\n0.77,1.")
    (stopped / "results.xdmf").write_text("<Xdmf>")
    data = bytearray((kept[0] / "whole" / "results.h5").read_bytes())
    data[: 8 * 64] = b"\xff" * 8 * 64
    (stopped / "results.h5").write_bytes(data)
    run(kept[1], stopped, restart=True)
    assert differences(kept[0] / "whole", stopped) == []


def test_lost_fields_lead_to_an_earlier_checkpoint_or_to_an_error(kept, stopped):
    steps = {name: json_of(stopped / name)["about"]["files"]["size"] for name in NAMES}
    os.truncate(stopped / "results.h5", max(steps.values()) - 1)
    shutil.copytree(stopped, stopped.parent / "less")
    run(kept[1], stopped, restart=True)
    assert differences(kept[0] / "whole", stopped) == []
    os.truncate(stopped.parent / "less" / "results.h5", min(steps.values()) - 1)
    with pytest.raises(EnvironmentProblem, match=r"results\.h5 had \d+ bytes, now \d+"):
        run(kept[1], stopped.parent / "less", restart=True)


def json_of(path):
    """The text of a checkpoint."""
    data = path.read_bytes()
    length = int.from_bytes(data[16:24], "little")
    return json.loads(data[24 : 24 + length])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"material.young": 7e6}, "material.young: the case is not the one of the checkpoint: found"),
        ({"constraint.top.move": {"z": -0.021}}, "constraint.top.move.z: the case is not the one"),
        (
            {"statics.steps": 12},
            "statics.steps: the case is not the one of the checkpoint: found 12, expected 6",
        ),
        ({"material.young": 7e6, "statics.steps": 12}, "changed too: statics.steps; give case, --set"),
    ],
)
def test_another_case_is_refused_with_what_changed(change, words, kept, stopped):
    with pytest.raises(CaseError) as told:
        run(kept[1].with_changes(change), stopped, restart=True)
    assert words in str(told.value)


def test_another_mesh_is_refused(kept, stopped, project, tmp_path):
    mesh = tmp_path / "block.msh"
    mesh.write_text((project / "meshes" / PVC).read_text() + "\n")
    with pytest.raises(CaseError, match="the mesh is not the one of the checkpoint"):
        run(kept[1].with_changes({"mesh.file": str(mesh)}), stopped, restart=True)


def test_another_case_without_a_checkpoint_is_refused_with_what_changed(kept, stopped):
    for name in NAMES:
        (stopped / name).unlink()
    with pytest.raises(CaseError, match=r"material\.young: the case is not the one of the run here"):
        run(kept[1].with_changes({"material.young": 7e6}), stopped, restart=True)


def test_extended_by_outputs_and_another_solver(kept, stopped):
    """More outputs from the checkpoint on, by a factorisation: the same end."""
    other = kept[1].with_changes(
        {"statics.steps": 12, "petsc": {"ksp_type": "preonly", "pc_type": "cholesky"}}
    )
    found = run(other, stopped, restart=True, extend=True)
    whole = open_results(kept[0] / "whole")
    assert len(found.curve["force"]) > len(whole.curve["force"])
    assert found.curve["force"][-1] == pytest.approx(whole.curve["force"][-1], rel=1e-8)
    with pytest.raises(CaseError, match=r"material\.young"):
        run(other.with_changes({"material.young": 7e6}), stopped, restart=True, extend=True)


def test_a_motion_is_extended(tmp_path):
    """Twice as long is what a run of that duration does, where no ramp goes over the duration."""
    how = {"integrator": "central_difference", "step": 1e-4}
    short = with_checkpoints(pendulum({"duration": 0.01, "outputs": 2, **how}), "30 steps")
    long = with_checkpoints(pendulum({"duration": 0.02, "outputs": 4, **how}), "30 steps")
    run(short, tmp_path / "run")
    with pytest.raises(CaseError, match=r"dynamics\.duration.*--extend for a longer duration"):
        run(long, tmp_path / "run", restart=True)
    run(long, tmp_path / "run", restart=True, extend=True)
    run(long, tmp_path / "whole")
    assert differences(tmp_path / "whole", tmp_path / "run") == []
    with pytest.raises(CaseError, match=r"beyond that already.*found 0\.01, expected at least 0\.02"):
        run(short, tmp_path / "run", restart=True, extend=True)


def test_a_ramp_over_the_duration_is_not_stretched(tmp_path):
    how = {"integrator": "central_difference", "step": 5e-4, "outputs": 2}
    short = with_checkpoints(pendulum({"duration": 0.01, **how}, constraint=DRIVEN), "5 steps")
    run(short, tmp_path / "run")
    long = short.with_changes({"dynamics.duration": 0.02, "dynamics.outputs": 4})
    with pytest.raises(CaseError, match=r"constraint\.hinge\.ramp: ramps go over the duration"):
        run(long, tmp_path / "run", restart=True, extend=True)
    same = [[s / 2, factor] for s, factor in DRIVEN[0]["ramp"]]
    run(long.with_changes({"constraint.hinge.ramp": same}), tmp_path / "run", restart=True, extend=True)
    assert open_results(tmp_path / "run").times[-1] == 0.02


def test_a_checkpoint_of_another_version_is_refused(kept, stopped, monkeypatch):
    monkeypatch.setattr("ancf_petsc.analysis.provenance.versions", lambda: {"ancf_petsc": "99.0"})
    with pytest.raises(
        EnvironmentProblem, match=r"written by ancf_petsc .*, this is 99\.0: go on with that version"
    ):
        run(kept[1], stopped, restart=True)


def test_a_folder_that_cannot_be_written_any_more_is_an_environment_problem():
    """/proc takes no files, not even root's."""
    with pytest.raises(EnvironmentProblem, match="cannot be written") as told:
        check_folder(Path("/proc"), "Block", kept=True)
    assert told.value.exit_code == 4


def test_a_live_run_is_left_alone(kept, stopped):
    mark = Mark(stopped)
    mark.take({"title": "Block", "hash": ""})
    try:
        with pytest.raises(CaseError, match="another run is writing into this folder"):
            run(kept[1], stopped, restart=True)
    finally:
        mark.release()


@pytest.mark.parametrize("number", [signal.SIGUSR1, signal.SIGTERM])
def test_a_signal_saves_within_a_step(number, kept, tmp_path, monkeypatch):
    """No checkpoint would have been due; the row that the interruption leaves is gone after the restart."""
    case = kept[1].with_changes({"output.checkpoint": "1 h"})
    taken = StaticRun._on_step

    def step(self, what, x):
        taken(self, what, x)
        if self.totals["steps"] == 3:
            os.kill(os.getpid(), number)

    monkeypatch.setattr(StaticRun, "_on_step", step)
    with pytest.raises(Interrupted):
        run(case, tmp_path / "run")
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["status"] == "interrupted"
    monkeypatch.undo()
    run(case, tmp_path / "run", restart=True)
    assert differences(kept[0] / "whole", tmp_path / "run") == []
    said = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert [each["steps"] for each in said["restarts"]] == [3]
    assert said["status"] == "done"
    assert said["iterations"] == json.loads((kept[0] / "whole" / "summary.json").read_text())["iterations"]


def test_time_brings_checkpoints(kept, tmp_path, monkeypatch):
    """A clock that gains 20 s at every look: a minute is three looks."""
    now = iter(range(0, 10**6, 20))
    monkeypatch.setattr("ancf_petsc.analysis.checkpoint.time.monotonic", lambda: float(next(now)))
    with snapshots(tmp_path) as found:
        run(kept[1].with_changes({"output.checkpoint": "1 min"}), tmp_path / "run")
    assert len(found) >= 1


def test_a_disk_without_space_ends_the_run_with_the_last_checkpoint_good(kept, tmp_path, monkeypatch):
    original = Checkpoints.save

    def save(self, what):
        if self.history.number == 1:
            monkeypatch.setattr("ancf_petsc.results.checkpoint_file._set_aside", full)
        original(self, what)

    def full(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(Checkpoints, "save", save)
    with pytest.raises(
        EnvironmentProblem, match=r"checkpoint_[ab]\.bin: cannot be written: no space is left"
    ) as told:
        run(kept[1], tmp_path / "run")
    assert told.value.exit_code == 4
    assert list((tmp_path / "run").glob("*.part")) == []
    monkeypatch.undo()
    run(kept[1], tmp_path / "run", restart=True)
    assert differences(kept[0] / "whole", tmp_path / "run") == []


def test_the_command_line_goes_on_from_a_case_or_a_folder(kept, stopped, tmp_path, capsys, monkeypatch):
    """The folder of a run that was killed has no summary; its results may be broken: the checkpoint knows the case."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(stopped, tmp_path / "second")
    (tmp_path / "case.toml").write_text(kept[1].text)
    assert main(["run", "case.toml", "--restart", "--out", "run", "--quiet"]) == 0
    (tmp_path / "second" / "results.h5").write_bytes(
        b"x" * 999 + (tmp_path / "second" / "results.h5").read_bytes()[999:]
    )
    assert case_of_run(tmp_path / "second").spec == kept[1].spec
    assert main(["run", "second", "--restart"]) == 0
    assert "goes on from checkpoint 2, at pseudo-time 0.5\n" in capsys.readouterr().out
    for name in ("run", "second"):
        assert differences(kept[0] / "whole", tmp_path / name) == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--extend"], "--extend without --restart"),
        (["--restart", "--again"], "--restart with --again"),
        (["--restart", "--force"], "--restart with --force"),
    ],
)
def test_options_that_contradict_each_other(words, message, capsys):
    assert main(["run", "somewhere", *words]) == 2
    assert message in capsys.readouterr().err


def test_on_other_ranks_to_rounding(kept, ancf, tmp_path):
    """A run begun on one rank goes on on two, and on three from there."""
    (tmp_path / "case.toml").write_text(kept[1].text)
    for ranks, start in ((2, 0), (3, 1)):
        shutil.copytree(kept[2][start], tmp_path / str(ranks))
        ancf("run", "case.toml", "--restart", "--out", str(ranks), "--quiet", ranks=ranks)
        assert largest_difference(kept[0] / "whole", tmp_path / str(ranks)) < 1e-9


def test_a_batch_job_is_requeued_after_an_interruption(project, tmp_path):
    """With an srun that ends like an interrupted run: requeued, checked only the first time, in one folder for all parts."""
    for name, body in (("srun", 'case "$*" in *" run "*) exit 130;; esac'), ("scontrol", ":")):
        (tmp_path / name).write_text(f'#!/bin/sh\necho "{name} $*" >> "$SAID"\n{body}\n')
        (tmp_path / name).chmod(0o755)
    said = tmp_path / "said"
    fixed = {"PATH": f"{tmp_path}:{os.environ['PATH']}", "SAID": str(said), "SLURM_JOB_ID": "7"}
    words = [
        "bash",
        str(project / "scripts" / "cluster.slurm"),
        "cases/pvc_block",
        "--set",
        "a=1",
        "--",
        "-ksp_view",
    ]
    for count in ("0", "1"):
        environment = os.environ | fixed | {"SLURM_RESTART_COUNT": count}
        assert subprocess.run(words, cwd=tmp_path, env=environment, check=False).returncode == 130
    run_line = "run cases/pvc_block --out results/7 --restart --set a=1 -- -ksp_view"
    lines = said.read_text().splitlines()
    assert [line.endswith(run_line) for line in lines] == [False, True, False, True, False]
    assert lines[0].endswith("check cases/pvc_block")
    assert lines[2] == lines[4] == "scontrol requeue 7"


def test_on_two_ranks_to_the_last_bit_and_a_full_disk(mpirun, project, tmp_path):
    """Conjugate gradients with their kept preconditioner, explicit steps with Chebyshev's iteration; a disk that runs full while
    the root writes the second checkpoint is said on both ranks, and the first one is good.
    """
    said = mpirun(2, ["-m", "mpi4py", project / "tests" / "restart_on_ranks.py", tmp_path]).stdout
    found = json.loads(said.partition("FOUND")[2])
    assert found["statics"] == found["central"] == []
    assert found["full"] == [4, 4]
    assert found["after"] == []
