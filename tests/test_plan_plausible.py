"""`ancf check` names numbers that look wrong: none in cases of consistent units, one each where one thing is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import pytest
from slender_bodies import grid

from ancf_petsc import case_from_dict, load_case
from ancf_petsc.cli import main
from ancf_petsc.plan.plan import make_plan
from ancf_petsc.plan.plausible import doubts_of

CASES = Path(__file__).resolve().parent.parent / "cases"
SHIPPED = sorted(
    path
    for path in CASES.glob("*/*.toml")
    if path.name != "expected.toml" and not path.name.startswith("study")
)
# Length, modulus of rubber, its density and the earth's gravity, in units of each system.
SYSTEMS = {
    "m, kg, s": (1.0, 6.8e6, 1350.0, 9.81),
    "mm, t, s": (1e3, 6.8, 1.35e-9, 9810.0),
    "mm, kg, ms": (1e3, 6.8e-3, 1.35e-6, 9.81e-3),
}


def doubts(data: dict[str, Any], folder: Path) -> list[str]:
    case = case_from_dict(data, folder)
    return doubts_of(case, make_plan(case))


def bar(folder: Path, system: str = "m, kg, s", *, stiffer: float = 1.0) -> dict[str, Any]:
    """A tenth of a metre long, pressed by a tenth under its weight; with a force and a probe at its free side."""
    length, young, density, gravity = SYSTEMS[system]
    points, cells = grid((4, 2, 2), (0.1 * length, 0.02 * length, 0.02 * length))
    path = folder / f"bar_{length:g}.vtu"
    meshio.Mesh(points, [("hexahedron", cells)]).write(path)
    return {
        "title": "Bar",
        "mesh": {"file": str(path), "element": "3813"},
        "groups": {
            "foot": {"plane": "x", "at": "min"},
            "head": {"plane": "x", "at": "max"},
            "side": {"plane": "z", "at": "max"},
        },
        "material": {"law": "neo_hooke", "young": stiffer * young, "poisson": 0.3, "density": density},
        "constraint": [
            {"group": "foot", "fix": ["x", "y", "z"]},
            {"group": "head", "move": {"x": -0.01 * length}},
        ],
        "load": [
            {"type": "gravity", "acceleration": [0.0, 0.0, -gravity]},
            {"type": "force", "group": "side", "total": [0.0, 0.0, -1e-5 * young * length**2]},
        ],
        "statics": {},
        "probe": [{"name": "middle", "group": "side"}],
    }


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_no_shipped_case_looks_wrong(path):
    case = load_case(path)
    assert doubts_of(case, make_plan(case)) == []


@pytest.mark.parametrize("stiffer", [1e-3, 1.0, 3e4, 1.5e5])
@pytest.mark.parametrize("system", SYSTEMS)
def test_consistent_units_do_not_look_wrong(system, stiffer, tmp_path):
    """Foam, rubber, steel and the stiffest ceramics, in three systems."""
    assert doubts(bar(tmp_path, system, stiffer=stiffer), tmp_path) == []


def change(path: str, value: Any):
    """A change of one key."""

    def apply(data: dict[str, Any]) -> None:
        *tables, last = path.split(".")
        for name in tables:
            data = data[int(name)] if isinstance(data, list) else data[name]
        data[last] = value

    return apply


STEEL = {"law": "svk", "young": 2.1e11, "poisson": 0.3, "density": 7800.0}
SI, MM = "m, kg, s", "mm, t, s"
WRONG = {
    "mesh in mm, modulus in Pa": (
        MM, change("material.young", 6.8e6), ["material.young = 6.8e+06 is in Pa", "density = 1.35e-09 with young = 6.8e+06"]
    ),
    "all but the mesh in SI": (MM, change("material", STEEL), ["material.young = 2.1e+11 is in Pa"]),
    "modulus in MPa, density in kg/m^3": (
        SI,
        change("material.young", 6.8),
        ["sound would travel at 0.071", "more than young = 6.8", "load.side.total: 68 is 1e+03 times young"],
    ),
    "density in t/mm^3": (
        SI, change("material.density", 1e-9), ["density = 1e-09 with young = 6.8e+06", "9810 mm/s^2 goes with it"]
    ),
    "gravity in mm/s^2": (
        SI, change("load.0.acceleration", [0.0, 0.0, -9810.0]), ["load.0.acceleration: 9810 is the earth's"]
    ),
    "gravity in m/s^2": (
        MM, change("load.0.acceleration", [0.0, 9.81, 0.0]), ["load.0.acceleration: 9.81 is the earth's"]
    ),
    "move in mm": (
        SI, change("constraint.1.move", {"x": -10.0}), ["constraint.head.move: x = -10, but the body is 0.1 long"]
    ),
    "move longer than the part": (MM, change("constraint.1.move", {"x": -101.0}), ["x = -101, but the body is 100 long"]),
    "pulled out of sight": (SI, change("constraint.1.move", {"x": 25.0}), ["x = 25, but its size is 0.1"]),
    "force far too large": (SI, change("load.1.total", [0.0, 0.0, 1e6]), ["load.side.total: 1e+06"]),
    "probe on what is held": (SI, change("probe.0.group", "foot"), ["probe.middle: all nodes of 'foot' are held"]),
    "force on what is held": (SI, change("load.1.group", "foot"), ["load.foot.total: without effect"]),
    "force of nothing": (SI, change("load.1.total", [0.0, 0.0, 0.0]), ["load.1.total: without effect"]),
    "ramp without a move": (SI, change("constraint.0.ramp", "cosine"), ["constraint.foot.ramp: without effect"]),
    "move by nothing": (SI, change("constraint.1.move", {"x": 0.0}), ["constraint.head.move: by 0 it is held"]),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_each_wrong_number_is_named(name, tmp_path):
    system, spoil, words = WRONG[name]
    data = bar(tmp_path, system)
    spoil(data)
    found = doubts(data, tmp_path)
    assert len(found) == len(words), found
    for line, word in zip(found, words, strict=True):
        assert word in line


def test_check_shows_it_and_the_case_is_valid_all_the_same(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    assert main(["check", str(CASES / "pvc_block"), "--set", "constraint.top.move={z = -25.0}"]) == 0
    said = capsys.readouterr().out
    assert "looks wrong" in said
    assert "constraint.top.move: z = -25, but the body is 0.1 long in z" in " ".join(said.split())
    assert "case is valid" in said


def test_a_long_pull_of_rubber_is_none(tmp_path):
    data = bar(tmp_path)
    data["constraint"][1]["move"] = {"x": 0.4}
    assert doubts(data, tmp_path) == []
