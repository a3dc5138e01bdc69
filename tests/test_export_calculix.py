"""Decks for CalculiX: what CalculiX answers to them is our answer, and what they cannot say is refused by name."""

from __future__ import annotations

import runpy
import shutil
from copy import deepcopy

import meshio
import numpy as np
import pytest
from statics_cases import MESHES, bar, block

from ancf_petsc import CaseError, EnvironmentProblem, NoEquilibrium, case_from_dict, run
from ancf_petsc.cli import main
from ancf_petsc.export.amplitudes import grouped
from ancf_petsc.export.answers import compare, solve
from ancf_petsc.export.calculix import TYPES, write
from ancf_petsc.export.names import deck_names
from ancf_petsc.export.planes import solved_for
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.plan.plan import make_plan

DIGITS = 5e-7
"""Half a unit in the last of the seven digits that CalculiX prints."""
WEDGES = TYPES["2-6-1-2", "axisymmetric"].within
calculix = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")


def compared(data, folder):
    """Rows of all forces, ours and CalculiX's."""
    case = case_from_dict(data, folder)
    plan = make_plan(case)
    deck = folder / "deck.inp"
    deck.write_text(write(case, plan)[0])
    return compare(case, plan, run(case, folder / "run").curve, solve(deck))


def cube(element="3413", mesh="bar_2x2x10.msh", **more):
    """A body between rough plates normal to z, which press it and let go to a half."""
    return {
        "title": "Cube",
        "mesh": {"file": str(MESHES / mesh), "element": element},
        "groups": {"low": {"plane": "z", "at": "min"}, "high": {"plane": "z", "at": "max"}},
        "material": {"law": "svk", "young": 2.0e6, "poisson": 0.4},
        "constraint": [
            {"group": "low", "fix": ["x", "y", "z"]},
            {
                "group": "high",
                "fix": ["x", "y"],
                "move": {"z": -0.0005},
                "ramp": [[0, 0], [0.4, 1], [1, 0.5]],
            },
        ],
        "statics": {"times": [0.2, 0.7, 1.0]},
        "output": {"curve": {"force": "high.z", "stroke": "high.z"}, "symmetry": 2},
        **more,
    }


def pressed_block():
    data = block("pvc_block_234.msh", 0.010, steps=2)
    data["output"]["symmetry"] = 4
    return data


def quadratic_bar():
    data = cube("3-10-1-3")
    data["mesh"]["rule"] = "reduced"
    return data


def loaded_bar():
    """Two forces that share nodes and follow different ramps, on a body that has the law without lambda."""
    up = {"type": "force", "group": "high", "total": [200.0, 0.0, 3e3], "ramp": "cosine"}
    side = {"type": "force", "group": "edge", "total": [0.0, 500.0, 0.0], "ramp": [[0, 0.5], [1, 1]]}
    data = cube("3413", load=[up, side], constraint=[{"group": "low", "fix": ["x", "y", "z"]}])
    data["groups"]["edge"] = {"plane": [1, 0, 1], "at": "max"}
    data["material"] = {"law": "neo_hooke", "young": 2.0e6, "poisson": 0.0}
    data["output"] = {}
    return data


@calculix
@pytest.mark.parametrize(
    "data", [pressed_block(), cube(mesh="cube_m2.msh"), quadratic_bar(), bar("bar_2x2x10.msh", gravity=True), loaded_bar()],
    ids=["block", "cube", "quadratic bar", "bar with weight", "two ramps"],
)  # fmt: skip
def test_calculix_gives_our_forces_to_the_digits_it_prints(tmp_path, data):
    """All components on all groups, supports' reactions with weight and forces taken off."""
    rows = compared(data, tmp_path)
    assert len(rows) >= 3
    assert max(abs(row.ours) for row in rows) > 0
    assert max(row.difference for row in rows) < DIGITS


@calculix
def test_bricks_and_plane_strain(tmp_path):
    """A bar of bricks bent by its weight, and a plane body in y-z: CalculiX has plane bodies in its own x-y."""
    points, cells = box((3, 1, 2))
    meshio.write(tmp_path / "bricks.vtu", meshio.Mesh(points, [("hexahedron", cells)]))
    bricks = cube("3813", load=[{"type": "gravity", "acceleration": [0.1, 0.0, -1.0]}])
    bricks["mesh"]["file"] = str(tmp_path / "bricks.vtu")
    bricks["material"] = {"law": "svk", "young": 1e4, "poisson": 0.3, "density": 20.0}
    bricks["constraint"][1]["move"] = {"z": -0.05}
    (tmp_path / "bricks").mkdir()
    assert max(row.difference for row in compared(bricks, tmp_path / "bricks")) < DIGITS
    flat = np.unique(points[:, [1, 2]], axis=0)
    quads = [[0, 1, 4, 3], [1, 2, 5, 4]]
    assert len(flat) == 6
    y, z = flat.T
    meshio.write(
        tmp_path / "plane.vtu", meshio.Mesh(np.column_stack((0 * y, y, z)), [("quad", np.array(quads))])
    )
    plane = deepcopy(bricks) | {"section": {"plane": "strain", "thickness": 0.3}}
    plane["mesh"] = {"file": str(tmp_path / "plane.vtu"), "element": "2412"}
    plane["load"] = [{"type": "force", "group": "high", "total": [0.0, 40.0, 0.0]}]
    plane["constraint"][1] = {"group": "high", "move": {"z": -0.05}}
    (tmp_path / "plane").mkdir()
    assert max(row.difference for row in compared(plane, tmp_path / "plane")) < DIGITS


@calculix
@pytest.mark.parametrize("angle", [0.5, np.pi / 2])
def test_planes_held_along_their_normals(tmp_path, angle):
    """A block rotated about z: a side along x is *BOUNDARY, oblique ones are equations, also where two meet and where x moves."""
    points, cells = box((2, 1, 2))
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    meshio.write(tmp_path / "block.vtu", meshio.Mesh(points @ turn, [("hexahedron", cells)]))
    data = cube("3813", load=[{"type": "gravity", "acceleration": [0.4, 0.3, -1.0]}])
    data["mesh"]["file"] = str(tmp_path / "block.vtu")
    data["material"] = {"law": "svk", "young": 1e4, "poisson": 0.3, "density": 20.0}
    data["groups"] |= {f"side{k}": {"plane": turn[k].tolist(), "at": "min"} for k in range(2)}
    held = [{"group": f"side{k}", "fix": ["normal"]} for k in range(2)]
    moved = {"group": "high", "fix": ["z"], "move": {"x": 0.04}}
    data["constraint"] = [
        {"group": "low", "fix": ["normal"]},
        {**moved, "move": {"z": -0.1}, "fix": []},
        *held,
    ]
    rows = compared(data, tmp_path)
    assert {row.group for row in rows} == {"low", "high", "side0", "side1"}
    assert max(row.difference for row in rows) < DIGITS
    assert ("*EQUATION" in (tmp_path / "deck.inp").read_text()) == (angle == 0.5)
    data["constraint"] = [{"group": "low", "fix": ["normal"]}, moved, held[0]]
    if angle == 0.5:
        (tmp_path / "moved").mkdir()
        assert max(row.difference for row in compared(data, tmp_path / "moved")) < DIGITS


def test_equations_each_give_a_component_of_their_own():
    slanted, free = np.array([[0.6, 0.8, 0.0], [0.0, 0.6, 0.8]]), np.ones(3, bool)
    for rows, allowed in ((slanted, free), (slanted, np.array([False, True, True])), (slanted[:1], free)):
        found = solved_for(rows, allowed)
        given = [terms[0][0] for terms in found]
        assert len(set(given)) == len(found) == len(rows)
        assert all(allowed[i] for i in given)
        assert all(i not in given for terms in found for i, _ in terms[1:])
        back = np.zeros((len(found), 3))
        for row, terms in zip(back, found, strict=True):
            for i, factor in terms:
                row[i] = factor
        assert np.linalg.matrix_rank(np.concatenate((back, rows))) == len(rows)
    assert solved_for(slanted[:1], np.array([False, False, True])) == []
    assert solved_for(np.repeat(slanted[:1], 2, axis=0), free) == solved_for(slanted[:1], free)


@calculix
@pytest.mark.parametrize(("angle", "inner"), [(360.0, 1.0), (90.0, 1.0), (360.0, 0.0)])
def test_a_ring_and_a_disc(tmp_path, angle, inner):
    """With weight and a force on a circle; forces of CalculiX's sector times 180, whose wedges degenerate at the axis."""
    radius, height = (a.ravel() for a in np.meshgrid(np.linspace(inner, inner + 1, 4), np.linspace(0, 2, 4)))
    first = np.arange(15)[np.arange(15) % 4 < 3][:9]
    quads = np.stack((first, first + 1, first + 5, first + 4), axis=1)
    triangles = np.concatenate((quads[:, :3], quads[:, [0, 2, 3]]))
    points = np.column_stack((radius, 0 * radius, height))
    meshio.write(tmp_path / "ring.vtu", meshio.Mesh(points, [("triangle", triangles)]))
    data = cube("2-6-1-2", section={"plane": "axisymmetric", "axis": "z", "angle": angle})
    data["mesh"] |= {"file": str(tmp_path / "ring.vtu"), "rule": "reduced"}
    data["material"] = {"law": "svk", "young": 1e6, "poisson": 0.35, "density": 1e3}
    data["constraint"][1] = {"group": "high", "fix": ["x"], "move": {"z": -0.2}}
    data["groups"]["circle"] = {"nearest": [inner + 1, 0.0, 1.3]}
    rows = compared(data, tmp_path)
    assert {row.axis for row in rows} == {"z"}
    assert max(row.difference for row in rows) < (DIGITS if inner else WEDGES)
    data["load"] = [
        {"type": "gravity", "acceleration": [0.0, 0.0, -30.0]},
        {"type": "force", "group": "circle", "total": [0.0, 0.0, 2e4], "ramp": "cosine"},
    ]
    (tmp_path / "loaded").mkdir()
    assert max(row.difference for row in compared(data, tmp_path / "loaded")) < WEDGES


def box(divisions):
    """Points and unit bricks of a box."""
    from ancf_petsc.mesh.generate import bricks

    z, y, x = np.meshgrid(*(np.arange(n + 1.0) for n in divisions[::-1]), indexing="ij")
    return bricks(np.stack([x, y, z], axis=-1))


def test_numbers_groups_and_faces_return_when_the_deck_is_read_as_a_mesh(tmp_path):
    case = case_from_dict(cube("3413"), tmp_path)
    plan = make_plan(case)
    (tmp_path / "deck.inp").write_text(write(case, plan)[0])
    read, mesh = read_mesh(tmp_path / "deck.inp", ("tetra",)), plan.mesh
    assert np.array_equal(read.node_numbers, mesh.node_numbers[mesh.used])
    assert np.array_equal(read.node_numbers[read.cells], mesh.node_numbers[mesh.cells])
    assert np.array_equal(read.cell_numbers, mesh.cell_numbers)
    np.testing.assert_allclose(read.points, mesh.points[mesh.used], rtol=1e-12, atol=0)
    for name, group in mesh.groups.items():
        back = read.groups[name.upper()]
        assert np.array_equal(read.node_numbers[back.nodes], mesh.node_numbers[group.nodes]), name


def test_names_that_calculix_takes():
    found = deck_names(["top", "Top", "top face", "3d", "x" * 90, "x" * 91, "Größe"], ["TOP"])
    assert found["top"] == "TOP_2"
    assert found["Top"] == "TOP_3"
    assert found["top face"] == "TOP_FACE"
    assert found["3d"] == "G_3D"
    assert len(set(found.values())) == 7
    assert all(len(word) <= 63 and word.isascii() for word in found.values())


def test_forces_are_sorted_by_the_ramps_they_follow():
    forces = np.zeros((4, 3, 2))
    forces[0, 2] = [2.0, 0.0]
    forces[1, 2] = [-4.0, 0.0]
    forces[2, 0] = [1.0, 3.0]
    forces[3, 1] = [2.0, 6.0]
    found = {
        tuple(shares): (nodes.tolist(), axes.tolist(), list(sizes))
        for shares, nodes, axes, sizes in grouped(forces)
    }
    assert found[1.0, 0.0] == ([0, 1], [2, 2], [2.0, -4.0])
    (both,) = (key for key in found if key[1] == 1.0)
    assert both[0] == pytest.approx(1 / 3, rel=1e-11)
    assert found[both] == ([2, 3], [0, 1], [3.0, 6.0])
    assert grouped(np.zeros((2, 3, 0))) == []


REFUSED = {
    "slopes": ({"mesh.element": "3443"}, "mesh.element.*neither slopes.*'3443'"),
    "neo_hooke": ({"material.law": "neo_hooke"}, "material.law.*volumetric term.*'neo_hooke'.*poisson = 0"),
    "arc length": ({"statics.control": "arc_length", "constraint.high.ramp": "linear"}, "statics.control"),
    "branches": ({"statics.on_bifurcation": "follow"}, "statics.on_bifurcation.*'follow'"),
    "motion": (
        {"statics": None, "dynamics": {"duration": 1.0, "step": 0.1}, "material.density": 1.0, "constraint.high.ramp": "cosine"},
        "dynamics.*motions are not exported",
    ),
    "two ramps of gravity": (
        {
            "material.density": 1.0,
            "load": [{"type": "gravity", "acceleration": [0.0, 0.0, 1.0], "ramp": r} for r in ("linear", "cosine")],
        },
        "gravity.*one ramp",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_what_calculix_cannot_be_told_is_refused_by_name(tmp_path, changes, message):
    case = case_from_dict(cube("3413"), tmp_path).with_changes(changes)
    with pytest.raises(CaseError, match=message) as error:
        write(case, make_plan(case))
    assert "\n" not in str(error.value)


def test_the_verb_writes_a_deck_and_says_what_differs(tmp_path, capsys, monkeypatch, project):
    monkeypatch.chdir(tmp_path)
    case = str(project / "cases" / "pvc_block")
    assert main(["export", case, "--format", "calculix"]) == 0
    assert "816 elements, 234 nodes" in capsys.readouterr().out
    assert (tmp_path / "pvc_block.inp").read_text().rstrip().endswith("*END STEP")
    assert main(["export", case, "--set", "mesh.element=3-10-1-3", "--out", "q.inp"]) == 0
    assert 'with 4 points, this case with 14; mesh.rule = "reduced"' in capsys.readouterr().out
    assert main(["export", case, "--out", str(tmp_path / "no" / "such.inp")]) == 2
    assert "--out" in capsys.readouterr().err
    assert main(["export", case, "--set", "material.law=neo_hooke"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_without_calculix_and_with_a_deck_it_refuses(tmp_path, monkeypatch):
    (tmp_path / "deck.inp").write_text("*NODE\n1, 0., 0., 0.\n*STEP\n*STATIC\n*END STEP\n")
    if shutil.which("ccx"):
        with pytest.raises(NoEquilibrium, match="CalculiX does not solve it"):
            solve(tmp_path / "deck.inp")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(EnvironmentProblem, match="apt-get install calculix-ccx"):
        solve(tmp_path / "deck.inp")


def test_forces_too_small_for_calculix_are_noted(tmp_path):
    """Its threshold for a residual is a number without a unit."""
    case = case_from_dict(cube(), tmp_path)
    assert write(case, make_plan(case))[1] == []
    soft = case.with_changes({"material.young": 2e-3})
    (note,) = write(soft, make_plan(soft))[1]
    assert "takes forces below 1e-06 for none" in note


@calculix
def test_the_script_prints_both_and_judges(tmp_path, capsys, monkeypatch, project):
    script = runpy.run_path(str(project / "scripts" / "cross_check"))
    case = str(project / "cases" / "bar_tension" / "statics.toml")
    monkeypatch.setattr(
        "sys.argv", ["cross_check", case, "--set", "statics.steps=1", "--keep", str(tmp_path / "kept")]
    )
    assert script["main"]() == 0
    said = capsys.readouterr().out
    assert "5.025900e+02" in said
    assert "equal: they differ by" in said
    assert (tmp_path / "kept" / "deck.dat").is_file()
    monkeypatch.setattr("sys.argv", ["cross_check", case, "--set", "material.law=neo_hooke"])
    assert script["main"]() == 2
    assert "volumetric term" in capsys.readouterr().err
