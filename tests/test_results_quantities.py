"""What tables, fields and pictures say of a state, computed again by formulas of their own: symmetry, stresses, units."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import meshio
import numpy as np
import pytest
from bodies import assembly_of
from statics_cases import block

from ancf_petsc import case_from_dict, run
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.model.measures import von_mises
from ancf_petsc.post import figures
from ancf_petsc.post.units import ENERGY_OF, STRESS_OF, read_units
from ancf_petsc.post.view import Look, describe, label, scalars

mpl.use("Agg")
SIDE, WIDTH = 0.1, 0.05  # of the shipped cube, a quarter of which is meshed
SYMMETRY = 4.0
PUSHED = {"x": 0.012, "y": 0.007, "z": -0.015}


def sheared(mesh: Path, symmetry: float, law: str) -> dict:
    """The quarter cube, bonded to plates, its top pushed along all axes: no component of stress vanishes."""
    data = block(mesh.name, 0.0, steps=2)
    data["mesh"]["file"] = str(mesh)
    data["material"] |= {"law": law, "density": 1000.0}
    data["constraint"] = [
        {"group": "bottom", "fix": ["x", "y", "z"]},
        {"group": "top", "move": PUSHED, "ramp": "linear"},
    ]
    data["load"] = [{"type": "gravity", "acceleration": [3.0, -2.0, -9.81]}]
    data["probe"] = [{"name": "top", "group": "top"}]
    data["output"] = {"symmetry": symmetry, "curve": {"force": "top.z", "stroke": "top.z"}}
    return data


@pytest.fixture(scope="module")
def cube(tmp_path_factory) -> Path:
    """Cells of unequal size: the middle planes are moved towards the far sides."""
    path = make_mesh("cube", tmp_path_factory.mktemp("cube") / "cube.msh", divisions=(2, 2, 2))
    mesh = meshio.read(path)
    sizes = np.array([WIDTH, WIDTH, SIDE])
    mesh.points += 0.6 * mesh.points * (1.0 - mesh.points / sizes)
    mesh.write(path, file_format="gmsh22", binary=False)
    return path


def both(data, folder):
    """The same run with symmetry 1 and 4."""
    answers = []
    for symmetry in (1.0, SYMMETRY):
        data["output"]["symmetry"] = symmetry
        answers.append(run(case_from_dict(data, folder), folder / f"{symmetry:g}"))
    return answers


@pytest.fixture(scope="module", params=["svk", "neo_hooke"])
def statics(request, cube, tmp_path_factory):
    return both(sheared(cube, 1.0, request.param), tmp_path_factory.mktemp("statics"))


@pytest.fixture(scope="module")
def motion(cube, tmp_path_factory):
    """The same body in motion, damped, its top driven."""
    data = sheared(cube, 1.0, "svk")
    del data["statics"]
    data["dynamics"] = {"duration": 0.02, "step": 0.002, "outputs": 2, "damping": 20.0}
    data["initial"] = {"velocity": [1.0, 2.0, 3.0]}
    return both(data, tmp_path_factory.mktemp("motion"))


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    mpl.pyplot.close("all")


# --- symmetry

MULTIPLIED = ("force", "force_stress_area", ".rx", ".ry", ".rz", "_energy", "_work", "_drift")
AS_IT_IS = ("time", "stroke", "min_det_F", "iterations", "steps", "momentum.x", "momentum.y", "momentum.z")


def test_symmetry_multiplies_forces_energies_and_work_and_nothing_else(statics, motion):
    """Every column of the curve is one or the other; the summary's last row is the curve's."""
    for one, four in (statics, motion):
        is_multiplied_where_it_should(one, four)


def is_multiplied_where_it_should(one, four):
    assert one.curve.keys() == four.curve.keys()
    for name, column in one.curve.items():
        multiplied, kept = name.endswith(MULTIPLIED), name.endswith(AS_IT_IS)
        assert multiplied != kept, f"{name}: is it multiplied?"
        factor = SYMMETRY if multiplied else 1.0
        np.testing.assert_allclose(four.curve[name], factor * column, rtol=1e-12, err_msg=name)
        assert four.summary["final"][name] == four.curve[name][-1]
    for name in {"force", "strain_energy", "external_work", "top.rx", "bottom.rz"} & one.curve.keys():
        assert one.curve[name][-1] != 0.0


def test_symmetry_leaves_probes_and_fields(motion, statics):
    for one, four in (motion, statics):
        assert one.probes.keys() == four.probes.keys()
        for name, column in one.probes.items():
            np.testing.assert_array_equal(four.probes[name], column)
        for name in one.fields:
            np.testing.assert_array_equal(four.field(name), one.field(name))


def test_every_column_of_a_motion_is_there(motion):
    columns = {"kinetic_energy", "potential_energy", "dissipated_energy", "external_work", "energy_drift"}
    assert columns <= motion[0].curve.keys()
    assert all(np.abs(motion[0].curve[name]).max() > 0.0 for name in columns)


# --- loads


def test_a_traction_is_shared_by_area(cube, tmp_path):
    """A third of each facet's share of the whole area on each of its corners; the facets differ in size."""
    data = sheared(cube, 1.0, "svk")
    total = np.array([3.0, -2.0, 7.0])
    data["load"] = [{"type": "force", "group": "top", "total": total.tolist()}]
    model = assembly_of(data, tmp_path).model
    place = model.reference
    on_top = np.abs(place[:, 2] - SIDE) < 1e-12
    facets = [cell[on_top[cell]] for cell in model.cells if on_top[cell].sum() == 3]
    areas = np.array([np.linalg.norm(np.cross(*(place[f[1:]] - place[f[0]]))) / 2 for f in facets])
    assert areas.sum() == pytest.approx(WIDTH**2, rel=1e-12)
    assert areas.max() > 1.5 * areas.min()
    shares = np.zeros(len(place))
    for facet, area in zip(facets, areas, strict=True):
        shares[facet] += area / areas.sum() / 3
    (load,) = model.loads
    np.testing.assert_allclose(load.pattern, np.outer(shares, total), atol=1e-14)


# --- stresses


def test_force_by_stress_and_area_is_the_nodes_mean_over_the_undeformed_face(statics):
    """Cell stresses averaged to nodes by undeformed volume, then over the nodes of the group; the whole body's area."""
    for result, symmetry in zip(statics, (1.0, SYMMETRY), strict=True):
        corners = result.points[result.cells]
        volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
        stress = result.field("cauchy")[:, 8]
        means = [
            np.average(stress[around], weights=volumes[around])
            for around in ((result.cells == node).any(axis=1) for node in result.groups["top"])
        ]
        wanted = symmetry * np.mean(means) * WIDTH**2
        assert result.curve["force_stress_area"][-1] == pytest.approx(wanted, rel=1e-10)


def equivalent(cauchy: np.ndarray) -> np.ndarray:
    """Von Mises stress (e,) by the eigenvalues of the stress (e, 9): half the sum of squared differences."""
    a, b, c = np.linalg.eigvalsh(cauchy.reshape(-1, 3, 3)).T
    return np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2)


@pytest.mark.parametrize(("i", "j"), [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)])
def test_von_mises_of_a_single_component(i, j):
    """A tension s gives s, a shear t gives sqrt(3) t."""
    stress = np.zeros((1, 3, 3))
    stress[0, i, j] = stress[0, j, i] = 7.0
    assert von_mises(stress.reshape(1, 9))[0] == pytest.approx(
        7.0 * (1.0 if i == j else np.sqrt(3)), rel=1e-15
    )


def test_von_mises_of_any_stress_is_that_of_its_principal_stresses():
    stress = np.random.default_rng(5).normal(size=(200, 3, 3))
    stress = (stress + np.swapaxes(stress, 1, 2)).reshape(-1, 9)
    np.testing.assert_allclose(von_mises(stress), equivalent(stress), rtol=1e-13)
    pressure = stress + 1e2 * np.eye(3).ravel()
    np.testing.assert_allclose(von_mises(pressure), von_mises(stress), rtol=1e-11)


def test_von_mises_in_results_and_pictures_is_that_of_the_stress(statics):
    """In the field of a run, and what a picture is coloured by, at every step; shear makes a good part of it."""
    result = statics[0]
    for step in range(len(result.times)):
        cauchy = result.field("cauchy", step)
        wanted = equivalent(cauchy)
        np.testing.assert_allclose(result.field("von_mises", step), wanted, rtol=1e-10, atol=1e-6)
        np.testing.assert_array_equal(
            scalars(result, Look("von_mises"), step), result.field("von_mises", step)
        )
    shear = np.abs(cauchy[:, [1, 2, 5]]).max(axis=1)
    assert np.median(shear / wanted) > 0.1


def test_strain_stress_and_determinant_are_those_of_the_displacement(statics):
    """From corners alone: E = (FᵀF - 1) / 2, det F; the Cauchy stress is symmetric."""
    result = statics[0]
    corners = result.points[result.cells]
    now = corners + result.field("displacement")[result.cells]
    F = np.swapaxes(np.linalg.solve(corners[:, 1:] - corners[:, :1], now[:, 1:] - now[:, :1]), 1, 2)
    strain = (np.swapaxes(F, 1, 2) @ F - np.eye(3)) / 2
    np.testing.assert_allclose(result.field("green_lagrange").reshape(-1, 3, 3), strain, atol=1e-13)
    np.testing.assert_allclose(result.field("det_F"), np.linalg.det(F), rtol=1e-12)
    cauchy = result.field("cauchy").reshape(-1, 3, 3)
    np.testing.assert_allclose(cauchy, np.swapaxes(cauchy, 1, 2), atol=1e-8 * np.abs(cauchy).max())
    lame, shear = 6.8e6 * 0.35 / (1.35 * 0.3), 6.8e6 / 2.7
    if "neo-Hooke" in (result.folder / "log.txt").read_text():
        J = np.linalg.det(F)[:, None, None]
        wanted = (shear * (F @ np.swapaxes(F, 1, 2) - np.eye(3)) + lame * np.log(J) * np.eye(3)) / J
    else:
        second = lame * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 2 * shear * strain
        wanted = F @ second @ np.swapaxes(F, 1, 2) / np.linalg.det(F)[:, None, None]
    np.testing.assert_allclose(cauchy, wanted, atol=1e-10 * np.abs(wanted).max())


# --- units

LABELS = {
    "SI": ("m", "Pa", "m/s", "s", "N", "J", "N s", "N m s"),
    "mm, MPa, N, s": ("mm", "MPa", "mm/s", "s", "N", "mJ", "N s", "N mm s"),
    "mm, kN, ms": ("mm", "GPa", "mm/ms", "ms", "kN", "J", "kN ms", "kN mm ms"),
}


def named(words: str, unit: str) -> str:
    return f"{words} [{unit}]"


@pytest.mark.parametrize("units", LABELS)
def test_every_quantity_of_a_motion_has_its_unit(units, motion):
    """Colours of pictures and axes of figures; lengths, speeds, stresses, energies, momenta are not mixed up."""
    result = motion[0]
    length, stress, speed, time, force, energy, momentum, angular = LABELS[units]
    result.units = units
    assert label(result, Look("displacement")) == named("displacement", length)
    assert label(result, Look("velocity")) == named("velocity", speed)
    assert label(result, Look("velocity", "y")) == named("velocity, y", speed)
    assert label(result, Look("von_mises")) == named("von Mises stress", stress)
    assert label(result, Look("cauchy", "xy")) == named("Cauchy stress, xy", stress)
    assert label(result, Look("green_lagrange", "xx")) == "Green-Lagrange strain, xx"
    assert label(result, Look("det_F")) == "det F"
    assert f"time 0.02 {time}   stroke -0.015 {length}" in describe(result, Look(), -1)
    made = figures.figures_of([result])
    shown = {name: [axes.get_ylabel() for axes in figure.axes] for name, figure in made.items()}
    assert shown["force_stroke"] == [named("compressive force", force)]
    assert made["force_stroke"].axes[0].get_xlabel() == named("compression", length)
    assert shown["energy"] == [named("energy", energy), "drift of the balance\n/ largest energy"]
    assert shown["probes"] == [named(f"{axis} position", length) for axis in "xyz"]
    assert shown["momentum"] == [named("momentum", momentum), named("angular momentum", angular)]
    assert made["energy"].axes[-1].get_xlabel() == named("time", time)


def test_a_static_run_has_pseudo_time_and_displacements(statics):
    statics[0].units = ""
    made = figures.figures_of([statics[0]])
    assert [axes.get_ylabel() for axes in made["probes"].axes] == [f"{axis} displacement" for axis in "xyz"]
    assert made["probes"].axes[-1].get_xlabel() == "pseudo-time"


SIZES = {
    "m": 1.0,
    "mm": 1e-3,
    "N": 1.0,
    "kN": 1e3,
    "Pa": 1.0,
    "kPa": 1e3,
    "MPa": 1e6,
    "GPa": 1e9,
    "mJ": 1e-3,
    "J": 1.0,
    "kJ": 1e3,
}


@pytest.mark.parametrize("pair", sorted(STRESS_OF))
def test_units_that_follow_from_length_and_force_are_consistent(pair):
    """By their sizes in SI: stress is force over length squared, energy force times length; and back from the stress."""
    length, force = pair
    units = read_units(f"{length}, {force}")
    assert SIZES[units.stress] == pytest.approx(SIZES[force] / SIZES[length] ** 2)
    assert SIZES[units.energy] == pytest.approx(SIZES[force] * SIZES[length])
    assert read_units(f"{length}, {units.stress}").force == force
    assert pair in ENERGY_OF
