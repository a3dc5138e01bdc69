"""After kills at random moments, and after power cuts, a run goes on and leaves what the uninterrupted one leaves."""

from __future__ import annotations

import random
import shutil
import time
from runpy import run_path

import numpy as np
import pytest
from killed_runs import cut_power, has_checkpoint, killed_alone, killed_on_ranks
from motion_cases import pendulum
from restart_cases import differences, largest_difference, with_checkpoints
from statics_cases import block

from ancf_petsc import open_results, run

STATIC = with_checkpoints(
    {
        **block("pvc_block_234.msh", 0.02, steps=10),
        "probe": [{"name": "top", "group": "top"}],
    },
    "1 step",
)
MOTION = with_checkpoints(
    pendulum({"duration": 0.2, "outputs": 20, "step": 2e-3, "integrator": "energy_momentum"}), "7 steps"
)


@pytest.mark.parametrize(("case", "seed"), [(STATIC, 1), (MOTION, 2)], ids=["statics", "motion"])
def test_a_run_killed_at_random_moments_loses_nothing(case, seed, tmp_path):
    """Five kills each, every other one with a power cut, in a process that is a copy of this one."""
    run(case, tmp_path / "whole")
    dice, kills = random.Random(seed), 0
    begun = time.monotonic()
    killed_alone(case, tmp_path / "timed", 60.0)
    lasts = time.monotonic() - begun
    while kills < 5:
        if not killed_alone(case, tmp_path / "run", dice.uniform(0.2, 0.7) * lasts):
            if kills:
                break
            shutil.rmtree(tmp_path / "run")  # on a machine that was busier before it was over too soon
            lasts /= 2
            continue
        kills += 1
        if kills % 2 == 0:
            cut_power(tmp_path / "run", dice)
    run(case, tmp_path / "run", restart=True)
    assert kills >= 1
    assert differences(tmp_path / "whole", tmp_path / "run") == []
    assert (np.diff(open_results(tmp_path / "run").times) > 0.0).all()


def test_ranks_that_are_killed_lose_nothing(environment, tmp_path):
    """One of two, or both, at a random moment: the same to rounding."""
    run(STATIC, tmp_path / "whole")
    (tmp_path / "case.toml").write_text(STATIC.text)
    dice = random.Random(3)
    killed = killed_on_ranks(tmp_path / "case.toml", tmp_path / "run", 2, 1.0, dice, environment)
    assert not killed or has_checkpoint(tmp_path / "run") or (tmp_path / "run").exists()
    run(STATIC, tmp_path / "run", restart=True)
    assert largest_difference(tmp_path / "whole", tmp_path / "run") < 1e-9
    for name in ("curve", "probes"):
        one, other = (getattr(open_results(tmp_path / folder), name) for folder in ("whole", "run"))
        assert {key: len(column) for key, column in one.items()} == {k: len(c) for k, c in other.items()}


@pytest.mark.parametrize(
    ("where", "ranks", "rank"),
    [
        ("reading", 2, 1),
        ("set-up", 3, 2),
        ("kernel", 2, 1),
        ("solver", 3, 1),
        ("output", 2, 1),
        ("an error of the program", 2, 1),
    ],
)
def test_a_rank_that_fails_ends_all_with_its_message(where, ranks, rank, mpirun, project, tmp_path):
    """Within five seconds of the failure, and never with success."""
    (tmp_path / "case.toml").write_text(STATIC.text)
    program = project / "tests" / "one_rank_fails.py"
    done = mpirun(ranks, [program, where, str(rank), "case.toml", "run"], code=None)
    ended = time.time()
    failed = float((tmp_path / "run.failed").read_text())
    assert done.returncode != 0
    words = "of one rank alone" if "program" in where else f"no {where}"
    assert words in done.stderr
    assert f"rank {rank}" in done.stderr
    assert ended - failed < 5.0


def test_memory_and_handles_do_not_grow(project):
    """A small version of scripts/soak_leaks: a leak of one vector of this body a step would be 0.7 MB, of a file a run 9."""
    soak = run_path(str(project / "scripts" / "soak_leaks"))
    motion = soak["motion"]("generalized_alpha")
    found = [soak["many_steps"]("motion", motion, 400), soak["many_runs"](12)]
    assert all(row["handles_growth"] <= 0 for row in found), found
    assert found[0]["memory_growth_mb"] < 0.7, found
    assert found[1]["memory_growth_mb"] < 6.0, found
