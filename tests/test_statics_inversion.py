"""No static solution has an inverted cell, even where forces balance there: St Venant-Kirchhoff's law does not see mirrors."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bodies import assembly_of
from inversion_on_ranks import pushed
from statics_cases import block

from ancf_petsc import case_from_dict, open_results, run
from ancf_petsc.errors import NoEquilibrium
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.solve.newton import Newton

SIDE = 0.1  # of the shipped cube
INVERTED = "a state with det F <= 0 or forces that are not finite was met"


@pytest.fixture(scope="module")
def cube(tmp_path_factory) -> Path:
    return make_mesh("cube", tmp_path_factory.mktemp("cube") / "cube.msh", divisions=(2, 2, 2))


def slab(mesh: Path, *, top_is_free: bool) -> dict:
    """A cube that can only be compressed along z, its top free or driven."""
    data = block(mesh.name, 2 * SIDE, steps=1, smallest_step=0.01)
    data["mesh"]["file"] = str(mesh)
    data["groups"] = {"body": {"box": [[-1, -1, -1], [1, 1, 1]]}}
    held = [{"group": "body", "fix": ["x", "y"]}, {"group": "bottom", "fix": ["z"]}]
    driven = [{"group": "top", "move": {"z": -2 * SIDE}, "ramp": "linear"}]
    data["constraint"] = held if top_is_free else held + driven
    return data


def solve_from(stretch: float, cube: Path, folder: Path, *, careful: bool = False):
    """Newton's method without loads from a stretch along z: the outcome, the state, smallest det F of every iterate."""
    assembly = assembly_of(slab(cube, top_is_free=True), folder)
    newton = Newton(assembly, 1e-9)
    x = assembly.reference_vector()
    x.array[2::3] *= stretch
    seen = []
    for snes in (newton._snes, newton._careful):
        snes.setMonitor(lambda snes, k, norm: seen.append(assembly.smallest_det(snes.getSolution())))
    outcome = newton.solve(0.0, x, careful=careful)
    return outcome, assembly.smallest_det(x), seen


@pytest.mark.parametrize("careful", [False, True])
@pytest.mark.parametrize("stretch", [-1.0, -0.9, 0.0])
def test_a_start_with_inverted_or_flat_cells_is_refused(stretch, careful, cube, tmp_path):
    """At stretches -1 and 0 forces vanish: St Venant-Kirchhoff's stress is proportional to s (s^2 - 1)."""
    outcome, _, _ = solve_from(stretch, cube, tmp_path, careful=careful)
    assert not outcome.converged
    assert outcome.reason == INVERTED


@pytest.mark.parametrize("careful", [False, True])
def test_a_full_step_of_newton_to_the_mirrored_body_is_not_taken(careful, cube, tmp_path):
    """From 0.5 Newton's step in s (s^2 - 1) leads to -1 exactly, where all forces vanish; a line search takes shorter ones."""
    outcome, _, seen = solve_from(0.5, cube, tmp_path, careful=careful)
    assert not outcome.converged
    if careful:
        assert len(seen) > 1
        assert min(seen) > 0.0
    else:
        assert outcome.reason == INVERTED


def test_newton_returns_to_the_body_from_less_compression(cube, tmp_path):
    """From 0.8, beyond the fold at 0.577, the undeformed body is found: what is refused is the inversion, not the start."""
    outcome, smallest, seen = solve_from(0.8, cube, tmp_path)
    assert outcome.converged
    assert smallest == pytest.approx(1.0, abs=1e-7)
    assert min(seen) > 0.0


def test_a_body_pressed_through_itself_ends_before_it_is_flat(cube, tmp_path):
    """The mirrored body at the end of the path has no stress at all: it is not reached."""
    case = case_from_dict(slab(cube, top_is_free=False), tmp_path)
    with pytest.raises(NoEquilibrium, match="det F <= 0"):
        run(case, tmp_path / "run")
    result = open_results(tmp_path / "run")
    assert 0.45 < result.times[-1] < 0.5
    assert result.summary["status"] == "stopped"
    for step in range(len(result.times)):
        det = result.field("det_F", step)
        np.testing.assert_allclose(det, 1.0 - 2.0 * result.times[step], rtol=1e-9)


def test_the_first_inverted_region_counts_where_the_last_is_whole(cube, tmp_path):
    """Two materials; in each half a node is pushed through its cells."""
    data = block(cube.name, 0.01, steps=1)
    data["mesh"]["file"] = str(cube)
    data["groups"] = {"upper": {"box": [[-1, -1, SIDE / 2 - 1e-9], [1, 1, 1]]}}
    data["material"] = [data["material"], data["material"] | {"group": "upper", "young": 1e7}]
    assembly = assembly_of(data, tmp_path)
    place = assembly.model.reference
    for low, high in ((0.0, 0.04), (0.06, 0.2)):
        x = assembly.reference_vector()
        values = x.array.reshape(-1, 3)
        chosen = np.flatnonzero((place[:, 2] >= low) & (place[:, 2] < high))[0]
        values[chosen] += 3.0 * (np.array([0.05, 0.05, 0.05]) - place[chosen])
        assert assembly.smallest_det(x) < 0.0
        force, smallest = assembly.mean_force(assembly.reference_vector(), x)
        assert smallest < 0.0


def test_one_inverted_cell_on_one_rank_is_refused_by_all(on_three_ranks, tmp_path):
    """A free node at an edge is pushed through its cells; on three ranks some ranks do not see them."""
    data = block(cube.name, 0.01, steps=1)
    data["mesh"]["file"] = str(make_mesh("cube", tmp_path / "tall.msh", divisions=(2, 2, 8)))
    (tmp_path / "case.json").write_text(json.dumps(data))
    program = Path(pushed.__code__.co_filename)
    said = on_three_ranks(program, tmp_path / "case.json")
    found = json.loads(said.stdout.partition("FOUND")[2])
    assert [rank["own"] > 0.0 for rank in found].count(True) >= 1
    assert all(rank["smallest"] < 0.0 for rank in found)
    assert all(rank["outcome"] == [False, INVERTED] for rank in found)
