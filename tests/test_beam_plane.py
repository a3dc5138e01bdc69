"""The plane a beam or a plane body moves in, from all that a case says of it."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

from ancf_petsc import CaseError, case_from_dict
from ancf_petsc.analysis.modes import COLUMNS, find_modes
from ancf_petsc.plan.plan import make_plan

AXES = "xyz"
DYNAMICS = {"dynamics": {"duration": 1.0, "step": 0.1}}
PINS = {"first": ["x", "z"], "last": ["z"]}


def beam_mesh(folder, axis, cells=4):
    """A beam of length 1 along an axis, with its ends and its whole as groups."""
    points = np.zeros((cells + 1, 3))
    points[:, axis] = np.linspace(0, 1, cells + 1)
    line = np.stack((np.arange(cells), np.arange(1, cells + 1)), axis=1)
    path = folder / f"beam_{axis}_{cells}.vtu"
    meshio.Mesh(points, [("line", line)]).write(path)
    return path


def case(folder, supports=(), axis=0, cells=4, **tables):
    """supports: group -> axes held, or a [[constraint]] of its own."""
    data = {
        "title": "Beam",
        "mesh": {"file": str(beam_mesh(folder, axis, cells)), "element": "1222"},
        "groups": {
            "first": {"plane": AXES[axis], "at": "min"},
            "last": {"plane": AXES[axis], "at": "max"},
            "all": {"box": [[-1, -1, -1], [2, 2, 2]]},
        },
        "section": {"area": 1e-4, "inertia": 1e-8 / 12},
        "material": {"law": "svk", "young": 1e9, "poisson": 0.0, "density": 1000.0},
        "constraint": [
            {"group": group, "fix": held} if isinstance(held, list) else {"group": group, **held}
            for group, held in dict(supports).items()
        ],
        **({} if "statics" in tables else DYNAMICS),
        **tables,
    }
    return case_from_dict(data, folder)


def normal_of(read):
    """The one axis that is held at every nodal vector."""
    held = (make_plan(read).supports.drive >= 0).all(axis=0)
    assert held.sum() == 1
    return AXES[int(np.argmax(held))]


FORCE = {"type": "force", "group": "last"}
SAID = {
    "a load": ({"load": [{**FORCE, "total": [1.0, 0.0, -1.0]}]}, "y"),
    "gravity": ({"load": [{"type": "gravity", "acceleration": [0.0, 9.81, 0.0]}]}, "z"),
    "a velocity": ({"initial": {"velocity": [1.0, 0.0, 2.0]}}, "y"),
    "a spin": ({"initial": {"spin": [0.0, 3.0, 0.0]}}, "y"),
    "gravity of a rotated model": (
        {"load": [{"type": "gravity", "acceleration": [0.0, 6e-16, -9.81]}]},
        "y",
    ),
    "another spin": ({"initial": {"spin": [1.0, 0.0, 3.0]}}, "z"),
    "a motion": ({"supports": {"first": {"fix": ["x"], "move": {"z": 0.1}}}}, "y"),
    "pins": ({"supports": PINS}, "y"),
    "pins in y": ({"supports": {"first": ["x", "y"], "last": ["y"]}}, "z"),
    "held slopes": ({"supports": {"first": {"fix": ["x"], "slopes": ["z"]}}}, "y"),
    "all of it held across": ({"supports": {"all": ["y"], **PINS}}, "y"),
    "held in space at one end, pinned at the other": (
        {"supports": {"first": ["x", "y", "z"], "last": ["z"]}},
        "y",
    ),
    "held in space at both": ({"supports": {"first": ["x", "y", "z"], "last": ["y", "z"]}}, "y"),
    "the curve": ({"output": {"curve": {"force": "first.x", "stroke": "last.z"}}}, "y"),
    "a load, whatever supports hold": (
        {"supports": PINS | {"first": ["x", "y", "z"]}, "load": [{**FORCE, "total": [0.0, 1.0, 0.0]}]},
        "z",
    ),
}


@pytest.mark.parametrize(("tables", "normal"), SAID.values(), ids=list(SAID))
def test_what_determines_the_plane(tables, normal, tmp_path):
    assert normal_of(case(tmp_path, **tables)) == normal


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_beam_along_any_axis_moves_in_the_plane_of_its_pins(axis, tmp_path):
    for within in set(range(3)) - {axis}:
        supports = {"first": [AXES[axis], AXES[within]], "last": [AXES[within]]}
        assert normal_of(case(tmp_path, supports, axis)) == AXES[3 - axis - within]


def test_frequencies_of_a_pinned_beam_whose_plane_only_its_pins_say(tmp_path):
    """n^2 pi / 2 sqrt(E I / (rho A)) / L^2; cubics of length h raise them by (n pi h)^4 / 1440."""
    rows = find_modes(case(tmp_path, PINS, cells=20), tmp_path / "modes", 3, loaded=False, force=False)
    frequencies = dict(zip(COLUMNS, rows.T, strict=True))["frequency"]
    exact = np.array([1, 4, 9]) * np.pi / 2 * np.sqrt(1e9 * 1e-8 / 12 / (1000.0 * 1e-4))
    np.testing.assert_allclose(frequencies, exact, rtol=5e-5)
    assert exact[0] == pytest.approx(4.534, abs=1e-3)


REFUSED = {
    "nothing": ({}, r"nothing determines the plane the beam moves in.*hold the other one.*fix = \[.y.\]"),
    "only along it": ({"supports": {"first": ["x"]}}, "nothing determines the plane"),
    "a spin about itself": ({"initial": {"spin": [2.0, 0.0, 0.0]}}, "nothing determines the plane"),
    "two planes": (
        {"load": [{**FORCE, "total": [0.0, 1.0, 0.0]}], "initial": {"velocity": [0.0, 0.0, 1.0]}},
        r"initial\.velocity: load\.0 acts along y, initial\.velocity along z: expected one plane",
    ),
    "a load out of the plane": (
        {"load": [{**FORCE, "total": [0.0, 1.0, 1.0]}]},
        r"load\.0 acts along y, load\.0 along z",
    ),
}


@pytest.mark.parametrize(("tables", "words"), REFUSED.values(), ids=list(REFUSED))
def test_a_plane_that_is_not_determined_is_an_error(tables, words, tmp_path):
    with pytest.raises(CaseError, match=words):
        make_plan(case(tmp_path, **tables))


@pytest.mark.parametrize(
    ("tables", "key"),
    [
        ({"load": [{"type": "gravity", "acceleration": [0.0, 0.0, -9.81]}]}, r"load\.0"),
        ({"initial": {"velocity": [1.0, 0.0, 1.0]}}, r"initial\.velocity"),
        ({"initial": {"spin": [0.0, 1.0, 0.0]}}, r"initial\.spin"),
        ({"constraint": [{"group": "low", "move": {"z": 0.1}}]}, r"constraint\.low\.move"),
    ],
)
def test_nothing_acts_across_the_plane_of_plane_elements(tables, key, tmp_path):
    """It would be dropped without a word: their third component is held."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    meshio.Mesh(points, [("quad", np.array([[0, 1, 2, 3]]))]).write(tmp_path / "quad.vtu")
    data = {
        "title": "Plane",
        "mesh": {"file": "quad.vtu", "element": "2412"},
        "groups": {"low": {"plane": "y", "at": "min"}},
        "section": {"thickness": 0.1, "plane": "stress"},
        "material": {"law": "svk", "young": 1.0, "poisson": 0.3, "density": 1.0},
        **DYNAMICS,
        **tables,
    }
    with pytest.raises(CaseError, match=rf"{key}: the body moves in the plane x-y and this acts along z"):
        make_plan(case_from_dict(data, tmp_path))
