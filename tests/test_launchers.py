"""The fixtures that start programs do what other tests trust them with."""

from __future__ import annotations

import os
import re

import pytest

from ancf_petsc.launcher import OF_A_LAUNCHER, quick_if_alone


def test_ranks_see_each_other(mpirun):
    code = "from mpi4py import MPI; print(f'rank {MPI.COMM_WORLD.rank} of {MPI.COMM_WORLD.size}')"
    printed = re.findall(r"rank \d of \d", mpirun(3, ["-c", code]).stdout)  # mpiexec may mix up ends of lines
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


def test_mpi_of_a_process_alone_looks_for_no_others(monkeypatch):
    """What the user has set stays, and nothing is left for processes started later."""
    for name in [
        name for name in os.environ if name.startswith((*OF_A_LAUNCHER, "OMPI_MCA_pml", "OMPI_MCA_btl"))
    ]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("OMPI_MCA_btl", "self,tcp")
    before = dict(os.environ)
    with quick_if_alone():
        inside = dict(os.environ)
    assert dict(os.environ) == before
    assert (inside["OMPI_MCA_pml"], inside["OMPI_MCA_btl"]) == ("ob1", "self,tcp")


def test_mpi_of_ranks_is_left_as_it_is(monkeypatch):
    monkeypatch.setenv("OMPI_COMM_WORLD_RANK", "0")
    before = dict(os.environ)
    with quick_if_alone():
        assert dict(os.environ) == before
