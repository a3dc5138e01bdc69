"""The ladders of docs/elements.md: meshes of one body, limits of known sequences, a page that says what was measured."""

import json
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest

PROJECT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(PROJECT / "scripts"))

import ladder_page  # noqa: E402
from ladder_meshes import AROUND, SECTION, Lengths, block  # noqa: E402


def volume(path):
    mesh = meshio.read(path)
    x = mesh.points[mesh.cells_dict["tetra"]]
    return np.linalg.det(x[:, 1:] - x[:, :1]).sum() / 6


def test_finer_blocks_are_the_same_polyhedron(tmp_path):
    coarse = Lengths(0.03, 0.02, 0.02, 1.0)
    found = [volume(block(tmp_path / "block.vtu", lengths)) for lengths in (coarse, coarse.finer(0.7))]
    # The section's integral of r dr dz, turned in straight strides: 2 sin(half a stride) cos(half) for each.
    r, z = np.array([*SECTION, SECTION[0]]).T
    moment = abs(np.sum((r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) * np.diff(z))) / 6
    exact = moment * AROUND * np.sin(np.pi / 2 / AROUND)
    assert found == pytest.approx([exact, exact], rel=1e-12)  # rounding of some thousand volumes


def test_a_power_of_the_size_is_extrapolated_exactly():
    rows = [{"size": h, "answer": 3.0 - 2.0 * h**1.7} for h in (0.5, 0.1, 0.05, 1 / 30)]
    # Powers are tried in steps of 1e-3.
    assert ladder_page.extrapolated(rows, "answer") == pytest.approx((3.0, 1.7), abs=1e-3)


@pytest.mark.parametrize("problem", ladder_page.PICTURES)
def test_the_page_says_what_was_measured(problem):
    report = json.loads((PROJECT / f"docs/benchmarks/element_ladder_{problem}.json").read_text())
    page = (PROJECT / "docs/elements.md").read_text()
    for line in ladder_page.lines_of(problem, report):
        assert line in page
    assert (PROJECT / "docs/pictures" / ladder_page.PICTURES[problem]).is_file()


def test_every_curved_element_goes_to_the_limit_of_the_beam():
    """All but 3413, which locks; 1e-3 because orders drift at the clamp's singular edges."""
    report = json.loads((PROJECT / "docs/benchmarks/element_ladder_cantilever.json").read_text())
    for (code, ladder), rows in ladder_page.ladders(report).items():
        if ladder == "uniform" and code != ladder_page.NOT_CONVERGING:
            for what, limit in report["limits"].items():
                assert ladder_page.extrapolated(rows, what)[0] == pytest.approx(limit, rel=1e-3), (code, what)
