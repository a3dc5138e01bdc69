"""The fixtures that start programs do what other tests trust them with."""

from __future__ import annotations

import pytest


def test_ranks_see_each_other(mpirun):
    code = "from mpi4py import MPI; print(f'rank {MPI.COMM_WORLD.rank} of {MPI.COMM_WORLD.size}')"
    printed = mpirun(3, ["-c", code]).stdout.splitlines()
    assert sorted(printed) == ["rank 0 of 3", "rank 1 of 3", "rank 2 of 3"]


def test_a_failing_rank_fails_the_test_with_what_it_said(mpirun):
    with pytest.raises(pytest.fail.Exception, match=r"(?s)expected exit code 0.*the reason"):
        mpirun(2, ["-c", "import sys; sys.exit('the reason')"])


def test_an_expected_exit_code_is_no_failure(mpirun):
    assert mpirun(1, ["-c", "import sys; sys.exit(3)"], code=3).returncode == 3


def test_a_hanging_program_is_stopped(mpirun):
    with pytest.raises(pytest.fail.Exception, match="not done after 2 s"):
        mpirun(2, ["-c", "import time; time.sleep(60)"], timeout=2)


def test_mpi_runs_single_threaded_blas(environment):
    assert environment["OMP_NUM_THREADS"] == "1"
