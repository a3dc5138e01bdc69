"""Static paths brought to their end: halved steps, the last state, and what is said of why it ends."""

from __future__ import annotations

import json
import re
from pathlib import Path

import meshio
import numpy as np
import pytest
from bodies import assembly_of
from ends_on_ranks import placed
from statics_cases import block

from ancf_petsc import open_results
from ancf_petsc.cli import main
from ancf_petsc.errors import NoEquilibrium
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.solve.load_path import QUICK, LoadPath, Marks
from ancf_petsc.solve.newton import Newton, Outcome

SIDE, WIDTH = 0.1, 0.05  # of the shipped cube, a quarter of which is meshed
WEIGHT = 1e3  # acceleration of gravity: a quarter's weight is then 250 N, a seventh of the force


@pytest.fixture(scope="module")
def cube(tmp_path_factory) -> Path:
    """48 tetrahedra; their numbers in the file follow those of the triangles."""
    return make_mesh("cube", tmp_path_factory.mktemp("cube") / "cube.msh", divisions=(2, 2, 2))


def pressed(cube: Path, stretch: float, law: str = "svk", **statics) -> dict:
    """The cube between bonded plates, pressed to a mean stretch."""
    data = block(cube.name, (1.0 - stretch) * SIDE, **statics)
    data["mesh"]["file"] = str(cube)
    data["material"]["law"] = law
    data["constraint"][-1]["ramp"] = "linear"
    return data


# --- steps


class Choosy(Newton):
    """Newton's method that refuses steps longer than `longest`, and all that ends beyond `limit`."""

    longest, limit = 1.0, 2.0

    def __init__(self, assembly) -> None:
        super().__init__(assembly, 1e-9)
        self.at, self.refused = 0.0, []

    def solve(self, s, x, *, careful=False):
        if s - self.at > self.longest * (1 + 1e-9) or s > self.limit:
            self.refused.append(s - self.at)
            return Outcome(converged=False, reason="refused", newton=0, linear=0, residuals=())
        outcome = super().solve(s, x, careful=careful)
        assert outcome.converged
        self.at = max(s, self.at)
        return outcome


def follow(cube, folder, outputs, **limits):
    """The accepted steps, the path and how it ended."""
    newton = Choosy(assembly_of(pressed(cube, 0.95), folder))
    for name, value in limits.items():
        setattr(newton, name, value)
    steps, error = [], None
    path = LoadPath(newton, Marks.of(outputs, []), 1e-3, lambda step, x: steps.append(step))
    try:
        path.run()
    except NoEquilibrium as problem:
        error = problem
    return steps, path, error


def test_steps_that_fail_are_halved_until_they_converge(cube, tmp_path):
    """From 0.1 to 0.025, where steps are accepted, then twice as long and back; outputs and the end are hit exactly."""
    steps, path, error = follow(cube, tmp_path, [0.3, 0.7, 1.0], longest=0.04)
    assert error is None
    assert path.s == 1.0
    assert {0.3, 0.7, 1.0} <= {step.s for step in steps}
    sizes = np.array([step.size for step in steps])
    assert sizes.sum() == pytest.approx(1.0, rel=1e-12)
    assert sizes[0] == pytest.approx(0.025, rel=1e-12)
    assert sizes.max() <= 0.04 * (1 + 1e-9)
    assert sizes.min() > 0.04 / 4
    # What is refused is tried again from other predictions before it is halved.
    refused = np.round(path.newton.refused, 12)
    assert list(dict.fromkeys(refused))[:2] == [0.1, 0.05]
    assert refused.min() > 0.04
    np.testing.assert_allclose(np.diff([0.0] + [step.s for step in steps]), sizes, rtol=1e-12)


def test_quick_steps_are_followed_by_longer_ones(cube, tmp_path):
    """Twice as long as wished for before, in equal parts of the way to the end: 0.2 of 0.9 makes five, 0.4 of 0.72 two."""
    steps, _, _ = follow(cube, tmp_path, [1.0])
    assert max(step.newton for step in steps) <= QUICK
    assert [step.size for step in steps] == pytest.approx([0.1, 0.18, 0.36, 0.36], rel=1e-12)


def test_a_path_ends_at_the_last_state_that_converged(cube, tmp_path):
    """All steps beyond 0.4 fail: it ends within two smallest steps of there, in equilibrium, with that state kept."""
    steps, path, error = follow(cube, tmp_path, [1.0], limit=0.4)
    assert isinstance(error, NoEquilibrium)
    assert 0.4 - 2 * 1e-3 <= path.s <= 0.4
    assert path.s == steps[-1].s
    assert f"beyond pseudo-time {path.s:.6g}: steps of 0.001 still fail (refused)" in str(error)
    path.newton.set_pseudo_time(path.s)
    balance = path.newton.out_of_balance(path.x).ravel()
    driven = path.assembly.driven
    free = np.delete(balance, driven)
    assert np.abs(free).max() < 1e-8 * np.abs(balance[driven]).max()
    wanted = path.x.copy()
    path.assembly.set_driven(wanted, path.s)
    np.testing.assert_array_equal(path.x.array_r, wanted.array_r)


def test_halved_steps_lead_to_the_same_state(cube, tmp_path):
    """Positions to 1e-9 of the cube, Newton's tolerance."""
    (_, halved, _), (_, straight, _) = (
        follow(cube, tmp_path, [1.0], longest=longest) for longest in (0.04, 1.0)
    )
    assert len(halved.newton.refused) > 2
    assert not straight.newton.refused
    np.testing.assert_allclose(halved.x.array_r, straight.x.array_r, rtol=0, atol=1e-9 * SIDE)


# --- a run that ends


@pytest.fixture(scope="module")
def ended(cube, project, tmp_path_factory):
    """Exit code, standard error and folder of a run by the command line whose path ends."""
    folder = tmp_path_factory.mktemp("ended") / "run"
    changes = {
        "mesh.file": f'"{cube}"',
        "constraint.top.move": f"{{z = {-0.6 * SIDE}}}",
        "constraint.top.ramp": '"linear"',
        "statics.steps": "4",
        "material.density": "1000.0",
        "load": f'[{{type = "gravity", acceleration = [0.0, 0.0, {-WEIGHT}]}}]',
    }
    words = [f"{key}={value}" for key, value in changes.items()]
    arguments = ["run", str(project / "cases" / "pvc_block"), "--out", str(folder), "--set", *words]
    from contextlib import redirect_stderr
    from io import StringIO

    with redirect_stderr(StringIO()) as said:
        code = main([*arguments, "--quiet"])
    return code, said.getvalue(), folder


def test_a_path_that_ends_is_exit_code_3_in_one_line(ended):
    code, said, _ = ended
    assert code == 3
    assert said.count("\n") == 1
    assert re.match(r"error: no equilibrium beyond pseudo-time 0\.\d+: steps of 0.0001 still fail \(", said)


def test_all_up_to_the_end_is_saved(ended):
    """Outputs asked for, and the last state: in the tables, in the fields and in the summary, which says stopped."""
    _, said, folder = ended
    result = open_results(folder)
    curve, summary = result.curve, result.summary
    last = float(re.search(r"pseudo-time (0\.\d+)", said)[1])
    np.testing.assert_array_equal(curve["pseudo_time"][:-1], [0.0, 0.25, 0.5, 0.75])
    assert curve["pseudo_time"][-1] == pytest.approx(last, abs=1e-6)
    assert 0.75 < last < 1.0
    np.testing.assert_array_equal(result.times, curve["pseudo_time"])
    assert summary["status"] == "stopped"
    assert summary["final"] == {name: column[-1] for name, column in curve.items()}
    assert summary["iterations"]["newton"] == curve["newton_iterations"].sum()
    assert summary["steps"] == curve["steps"].sum() > 4
    assert "halved to" in (folder / "log.txt").read_text()


def test_the_last_state_is_an_equilibrium_without_inverted_cells(ended):
    result = open_results(ended[2])
    curve, last = result.curve, result.curve["pseudo_time"][-1]
    assert curve["stroke"][-1] == pytest.approx(-0.6 * SIDE * last, rel=1e-12)
    weight = 4 * 1000.0 * WEIGHT * WIDTH**2 * SIDE * last
    assert curve["top.rz"][-1] + curve["bottom.rz"][-1] == pytest.approx(weight, rel=1e-7)
    assert all(result.field("det_F", step).min() > 0.0 for step in range(len(result.times)))
    np.testing.assert_allclose(
        curve["min_det_F"], [result.field("det_F", k).min() for k in range(5)], rtol=1e-15
    )


# --- why it ends

IDENTITY = np.eye(3).tolist()
MILD = np.diag([1.02, 1.02, 0.85]).tolist()
STRONG = np.diag([1.1, 1.1, 0.45]).tolist()
STATES = {
    "mild": {"F": MILD, "waves": 0.0012},
    "strong": {"F": STRONG, "waves": 0.0012},
    "strong neo-Hooke": {"F": STRONG, "waves": 0.0012},
    "column": {"F": np.diag([1.1, 1.1, 0.6]).tolist(), "waves": 0.0},
    "two laws": {"F": STRONG, "waves": 0.0012},
    "all cells alike": {"F": MILD, "waves": 0.0},
}
MATERIAL = (
    "material_limit",
    'the path ends here whatever the step size, and sooner on finer meshes; law = "neo_hooke" goes on',
)
BUCKLES = (
    "lost_definiteness",
    'the body buckles or folds here: smaller loads, other supports, or statics.after_limit = "dynamics" goes past it',
)
TOO_LONG = (
    "step_too_long",
    "take a statics.smallest_step below 0.0001, more statics.steps or a smoother ramp",
)
ANSWERS = {
    "mild": TOO_LONG,
    "strong": MATERIAL,
    "strong neo-Hooke": TOO_LONG,
    "column": BUCKLES,
    "two laws": MATERIAL,
    "all cells alike": TOO_LONG,
}


@pytest.fixture(scope="module")
def ends(cube, on_three_ranks, tmp_path_factory):
    """What `ends_on_ranks` says of the states: on one rank, on each of two, on each of three; and the mesh of each."""
    folder = tmp_path_factory.mktemp("ends")
    column = make_mesh("cube", folder / "column.msh", divisions=(1, 1, 8))
    slender = meshio.read(column)
    slender.points[:, :2] *= 0.1
    slender.write(column, file_format="gmsh22", binary=False)
    cases = {name: pressed(cube, 0.9) for name in STATES}
    cases["column"] = pressed(column, 0.9, "neo_hooke")
    cases["column"]["constraint"] = [c for c in cases["column"]["constraint"] if "symmetry" not in c["group"]]
    cases["strong neo-Hooke"] = pressed(cube, 0.9, "neo_hooke")
    whole = cases["two laws"]["material"]
    cases["two laws"]["groups"] = {"upper": {"box": [[-1, -1, SIDE / 2 - 1e-9], [1, 1, 1]]}}
    cases["two laws"]["material"] = [whole | {"law": "neo_hooke"}, whole | {"group": "upper"}]
    given = {name: (cases[name], state) for name, state in STATES.items()}
    (folder / "cases.json").write_text(json.dumps(given))
    program = Path(__file__).with_name("ends_on_ranks.py")
    said = on_three_ranks(program, folder / "cases.json")
    meshes = dict.fromkeys(STATES, cube) | {"column": column}
    return json.loads(said.stdout.partition("FOUND")[2]), meshes


def cells_of(mesh: Path) -> tuple[np.ndarray, np.ndarray]:
    """Numbers in the file and corners (e, 4, 3) of the tetrahedra, read by hand: type 4 of Gmsh's format 2.2."""
    text = mesh.read_text()
    nodes = text.partition("$Nodes\n")[2].partition("$EndNodes")[0].splitlines()[1:]
    points = {int(line.split()[0]): [float(word) for word in line.split()[1:]] for line in nodes}
    rows = text.partition("$Elements\n")[2].partition("$EndElements")[0].splitlines()[1:]
    cells = [words for words in (list(map(int, line.split())) for line in rows) if words[1] == 4]
    return np.array([cell[0] for cell in cells]), np.array([[points[n] for n in cell[-4:]] for cell in cells])


@pytest.mark.parametrize("name", STATES)
def test_the_weakest_cell_is_the_one_of_smallest_principal_stretch(name, ends):
    """Number in the file, stretch, det F and undeformed centroid, from corners; the lowest number where several are weakest."""
    found, meshes = ends
    numbers, corners = cells_of(meshes[name])
    if name == "two laws":
        upper = corners[:, :, 2].min(axis=1) > SIDE / 2 - 1e-9
        assert upper.any()
        assert not upper.all()
    now = placed(corners.reshape(-1, 3), **STATES[name]).reshape(corners.shape)
    edges, moved = corners[:, 1:] - corners[:, :1], now[:, 1:] - now[:, :1]
    F = np.swapaxes(np.linalg.solve(edges, moved), 1, 2)
    stretches = np.linalg.svd(F, compute_uv=False)[:, -1]
    alike = np.flatnonzero(stretches < stretches.min() * (1 + 1e-9))
    weakest = alike[numbers[alike].argmin()]
    for cell, stretch, det, centroid, law in (said["weakest"] for said in found[name]):
        assert cell == numbers[weakest]
        assert stretch == pytest.approx(stretches[weakest], rel=1e-9)
        assert det == pytest.approx(np.linalg.det(F[weakest]), rel=1e-9)
        assert centroid == pytest.approx(corners[weakest].mean(axis=0).tolist(), rel=1e-12)
        if name == "two laws":
            assert law == ("svk" if upper[weakest] else "neo_hooke")


@pytest.mark.parametrize("name", STATES)
def test_the_line_says_the_event_definiteness_place_and_cure(name, ends):
    """Definiteness by the eigenvalues of the tangent; the event as a word for programs, and what helps."""
    said = ends[0][name][0]
    cell, stretch, det, centroid, _ = said["weakest"]
    line, (kind, cure) = said["line"], ANSWERS[name]
    assert said["facts"]["kind"] == kind
    place = ", ".join(f"{c:.6g}" for c in centroid)
    assert line.startswith(
        "no equilibrium beyond pseudo-time 0.25: steps of 0.0001 still fail (no convergence); "
    )
    assert line.endswith(
        f"; weakest element {cell} at ({place}): smallest stretch {stretch:.3f}, det F {det:.3f}; {cure}"
    )
    lost = f"has lost definiteness ({said['negative']} negative pivots)"
    assert (lost if said["negative"] else "is still positive definite") in line
    limit = "the material is at its limit: element"
    assert (
        (limit in line) == ("svk carries no more force below 0.577; " in line) == (kind == "material_limit")
    )


def test_some_tangents_are_definite_and_some_are_not(ends):
    negative = {name: said[0]["negative"] > 0 for name, said in ends[0].items()}
    assert negative["column"]
    assert negative["strong"]
    assert not negative["mild"]
    assert not negative["strong neo-Hooke"]


@pytest.mark.parametrize("name", STATES)
def test_every_rank_of_one_two_and_three_says_the_same_line(name, ends):
    lines = [said["line"] for said in ends[0][name]]
    assert len(lines) == 6
    assert len(set(lines)) == 1
