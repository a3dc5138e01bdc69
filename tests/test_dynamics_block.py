"""Statics as the limit of slow damped motion, the way the paper computed its block."""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import PROJECT
from statics_cases import block

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.run import run_case
from ancf_petsc.results.tables import read_table


@pytest.fixture(scope="module")
def force(tmp_path_factory):
    """Curve of the force on the block pressed by 10 mm: by statics, or in motion over a duration (first
    period 3.8 ms).
    """

    def run(duration: float | None = None) -> np.ndarray:
        data = block("pvc_block_234.msh", 0.010, steps=10)
        if duration is not None:
            del data["statics"]
            data["material"]["density"] = 1350.0
            data["dynamics"] = {"duration": duration, "step": duration / 100, "outputs": 10, "damping": 500.0}
        folder = tmp_path_factory.mktemp("block") / "run"
        run_case(case_from_dict(data, PROJECT), folder)
        return read_table(folder / "curve.csv")["force"]

    return run


def test_the_difference_shrinks_with_the_loading_time(force):
    """It is the drag alpha M v, so it halves with every doubling: 1.3, 0.65, 0.32 % of the force."""
    still = force()
    differences = [
        np.abs(force(duration) - still).max() / np.abs(still).max() for duration in (0.05, 0.1, 0.2)
    ]
    assert differences[2] < 0.004
    for longer, shorter in zip(differences[1:], differences, strict=False):
        assert longer == pytest.approx(shorter / 2, rel=0.05)
