"""Bodies of revolution in the whole program: closed forms, the body in space, motions, ranks, what is refused."""

from __future__ import annotations

from functools import cache
from math import pi, sqrt

import meshio
import numpy as np
import pytest
from mpi4py import MPI
from rings import POISSON, TURNS, YOUNG, ring, section
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ancf_petsc import CaseError, MeshError, case_from_dict, run
from ancf_petsc.analysis.build import build
from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.material import LAWS
from ancf_petsc.mesh.generate import bricks
from ancf_petsc.mesh.groups import boundary_faces
from ancf_petsc.mesh.kinds import KUHN
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.mass import Mass
from ancf_petsc.model.measures import mean_stress
from ancf_petsc.plan.plan import make_plan
from ancf_petsc.solve.modes import modes_at

CODES = tuple(code for code, row in ELEMENTS.items() if row.is_plane)
each_element = pytest.mark.parametrize("code", CODES)


def solved(data, folder, name="run"):
    return run(case_from_dict(data, folder), folder / name)


# --- uniform states


@each_element
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("turn", TURNS)
def test_a_cylinder_pressed_between_lubricated_plates_is_in_uniaxial_stress(code, law, turn, tmp_path):
    """From its axis on, where the radius is held by itself and slopes keep their symmetry; in every plane of the axes."""
    mesh = section(code, 2, tmp_path, low=(0.0, 0.0), turn=turn)
    r, z = turn.split("-")
    data = ring(
        mesh,
        code,
        turn,
        law,
        constraint=[{"group": "bottom", "fix": [z]}, {"group": "top", "move": {z: -0.05}}],
        output={"curve": {"force": f"top.{z}", "stroke": f"top.{z}"}},
    )
    results = solved(data, tmp_path)
    p, axial = LAWS[law].parameters(YOUNG, POISSON), 0.9

    def stress(wide):
        return LAWS[law].stress((wide, 0.0, 0.0, 0.0, wide, 0.0, 0.0, 0.0, axial), p)

    wide = brentq(lambda wide: stress(wide)[0], 1.0, 1.2, xtol=1e-14)
    assert results.curve["force"][-1] == pytest.approx(pi * stress(wide)[8], rel=1e-9)
    along = "xyz".index(r)
    moved = results.field("displacement")[:, along]
    np.testing.assert_allclose(moved, (wide - 1) * results.points[:, along], rtol=0, atol=1e-9)
    # The hoop stands across the section, equal to the radial stretch; true stress is along the axis alone.
    strain, hoop = results.field("green_lagrange").reshape(-1, 3, 3), 3 - along - "xyz".index(z)
    np.testing.assert_allclose(strain[:, hoop, hoop], 0.5 * (wide**2 - 1), rtol=0, atol=1e-9)
    np.testing.assert_allclose(results.field("von_mises"), -stress(wide)[8] / wide**2, rtol=1e-8)
    np.testing.assert_allclose(results.field("det_F"), wide**2 * axial, rtol=1e-9)


@each_element
@pytest.mark.parametrize("rule", ["default", "reduced"])
def test_patch_of_odd_cells_that_widens_evenly(code, rule, tmp_path):
    """r = 1.1 R, z = 0.95 Z is an equilibrium: radial and hoop stress are equal. Rules integrate R dN/dR + N exactly."""
    if rule not in ELEMENTS[code].points:
        rule = "exact"
    data = ring(section(code, 3, tmp_path, odd=True), code)
    data["groups"] = {"all": {"box": [[-9, -9, -9], [9, 9, 9]]}}
    data["mesh"]["rule"] = rule
    data["constraint"] = [{"group": "all", "fix": ["x", "y", "z"]}]
    model = build(case_from_dict(data, tmp_path), MPI.COMM_SELF).model
    body, mesh = Assembly(model), read_mesh(data["mesh"]["file"], ELEMENTS[code].kinds)
    origin = model.origin * (model.slots == 0)[:, None]
    x = body.reference_vector()
    x.array[:] = ((model.reference + origin) * [1.1, 1.0, 0.95] - origin).ravel()
    force, _ = body.internal_force(x)
    sides = mesh.points[boundary_faces(mesh)]
    outside = np.concatenate((sides[:, 0], sides.mean(axis=1)))
    here = (model.reference + origin)[np.flatnonzero(model.slots == 0)[np.cumsum(model.slots == 0) - 1]]
    inside = np.linalg.norm(here[:, None] - outside, axis=2).min(axis=1) > 1e-9
    assert inside.any()
    np.testing.assert_allclose(force[inside], 0.0, atol=1e-14 * len(force) * np.abs(force).max())


# --- thick-walled cylinders


def walled(code, n, delta, folder, law="neo_hooke", name="run", **section_keys):
    """A pipe of radii 1 and 2 between smooth plates, its bore widened by delta; pushed from within."""
    data = ring(
        section(code, n, folder, size=(1.0, 0.25)),
        code,
        law=law,
        section=section_keys,
        constraint=[
            {"group": "bottom", "fix": ["z"]},
            {"group": "top", "fix": ["z"]},
            {"group": "inner", "move": {"x": delta}},
        ],
        output={"curve": {"force": "inner.x", "stroke": "inner.x"}},
        probe=[{"name": "outer", "group": "outer"}],
    )
    return solved(data, folder, name)


LAME = {"2312": 6e-3, "2412": 3e-3, "2-6-1-2": 3e-5, "2432": 3e-5}


@each_element
def test_a_thick_walled_pipe_under_small_strain_is_lames(code, tmp_path):
    """u = A R + B / R, A = delta / 2 ((1 - 2 nu) / ((1 - 2 nu) + (b/a)^2)) and so on, by the condition of no stress outside."""
    delta, (a, b, h) = 1e-6, (1.0, 2.0, 0.25)
    lame, mu = LAWS["svk"].parameters(YOUNG, POISSON)
    # Radial stress 2 (lame + mu) A - 2 mu B / R^2: zero outside; A a + B / a = delta.
    A = delta / (a + (lame + mu) * b**2 / (mu * a))
    B = A * (lame + mu) * b**2 / mu
    force = 2 * pi * a * h * (2 * mu * B / a**2 - 2 * (lame + mu) * A)
    results = walled(code, 8, delta, tmp_path, "svk")
    assert results.curve["force"][-1] == pytest.approx(force, rel=LAME[code])
    assert results.probes["outer.ux"][-1] == pytest.approx(A * b + B / b, rel=LAME[code])


@cache
def finite(delta, law):
    """Energy and radial force, per angle and height, of the pipe whose bore is widened by delta: its equation in the radius.

    (P_rr)' = (P_hoop - P_rr) / R for r(R), by shooting from within for the slope there that leaves no stress outside.
    """
    row, p = LAWS[law], LAWS[law].parameters(YOUNG, POISSON)
    radial, hoop = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)

    def F(slope, wide):
        return (slope, 0.0, 0.0, 0.0, wide, 0.0, 0.0, 0.0, 1.0)

    def rates(R, y):
        r, slope, _ = y
        at = F(slope, r / R)
        P = row.stress(at, p)
        along, across = row.tangent(at, radial, radial, p)[0], row.tangent(at, radial, hoop, p)[1]
        bend = ((P[4] - P[0]) / R - across * (slope / R - r / R**2)) / along
        return slope, bend, row.energy(at, p) * R

    def shot(slope):
        how = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
        return solve_ivp(rates, (1.0, 2.0), (1.0 + delta, slope, 0.0), **how).y[:, -1]

    def outside(slope):
        r, end, _ = shot(slope)
        return row.stress(F(end, r / 2.0), p)[0]

    slope = brentq(outside, 0.7, 1.0, xtol=1e-13)
    return shot(slope)[2], -row.stress(F(slope, 1.0 + delta), p)[0]


ORDERS = {"2312": (8, 16, 2), "2412": (8, 16, 2), "2-6-1-2": (4, 8, 4), "2432": (4, 8, 6)}


@each_element
@pytest.mark.parametrize("law", LAWS)
def test_a_pipe_widened_by_a_tenth_converges_to_its_differential_equation(code, law, tmp_path):
    """Energy and reaction; the error of the energy falls with twice the degree that is complete."""
    energy, force = (2 * pi * 0.25 * value for value in finite(0.1, law))
    coarse, fine, order = ORDERS[code]
    runs = [walled(code, n, 0.1, tmp_path, law, f"run{n}") for n in (coarse, fine)]
    errors = [abs(found.curve["strain_energy"][-1] / energy - 1) for found in runs]
    assert errors[1] < 2e-3
    # Coarse meshes are not yet in the limit.
    assert np.log(errors[0] / errors[1]) / np.log(fine / coarse) == pytest.approx(order, abs=0.7)
    assert runs[1].curve["force"][-1] == pytest.approx(force, rel=3 * max(errors[1], 1e-7))


def test_forces_and_energies_are_those_of_the_angle_asked_for(tmp_path):
    whole, part = (
        walled("2-6-1-2", 2, 0.2, tmp_path, name=f"run{a}", **k) for a, k in ((0, {}), (1, {"angle": 30.0}))
    )
    for column in ("force", "strain_energy", "inner.rx", "external_work"):
        assert part.curve[column][-1] == pytest.approx(whole.curve[column][-1] / 12, rel=1e-12)
    assert part.probes["outer.ux"][-1] == pytest.approx(whole.probes["outer.ux"][-1], rel=1e-12)


# --- the block of the paper


def test_the_rounded_block_at_5_mm(tmp_path):
    """-8860.4 N: quadratic triangles of another code, extrapolated from 1,676 to 27,197 of them, to 0.1 N."""
    mesh = {"body": "pvc_block_rounded", "flat": "triangle", "size": 0.004, "rim": 0.0002}
    data = {
        "title": "Grooved ring",
        "mesh": {**mesh, "element": "2-6-1-2"},
        "section": {"plane": "axisymmetric"},
        "material": {"law": "neo_hooke", "young": 6.8e6, "poisson": 0.35},
        "constraint": [
            {"group": "bottom", "fix": ["x", "z"]},
            {"group": "top", "fix": ["x"], "move": {"z": -0.005}},
        ],
        "statics": {"steps": 1},
        "output": {"curve": {"force": "top.z", "stroke": "top.z"}},
    }
    force = solved(data, tmp_path).curve["force"][-1]
    assert force == pytest.approx(-8860.4, rel=2e-4)


def test_a_quarter_in_space_comes_to_the_force_of_the_section(tmp_path):
    """Bonded and pressed: tetrahedra on chords err by the square of the angle, and what is left of two meshes is the section's."""
    pressed = [
        {"group": "bottom", "fix": ["x", "y", "z"]},
        {"group": "top", "fix": ["x", "y"], "move": {"z": -0.05}},
    ]
    output = {"curve": {"force": "top.z", "stroke": "top.z"}}
    data = ring(section("2-6-1-2", 3, tmp_path), "2-6-1-2", constraint=pressed, output=output)
    force = solved(data, tmp_path, "ring").curve["force"][-1]
    del data["section"]
    planes = [{"group": f"at_{axis}", "fix": [axis]} for axis in "xy"]
    sides = {"bottom": ("z", "min"), "top": ("z", "max"), "at_x": ("x", "min"), "at_y": ("y", "min")}
    data["groups"] = {name: {"plane": axis, "at": at} for name, (axis, at) in sides.items()}
    data |= {"constraint": [*pressed, *planes], "output": output | {"symmetry": 4}}
    found = []
    for n in (3, 6):
        angle, r, z = np.linspace(0, pi / 2, n + 1), np.linspace(1, 2, 4), np.linspace(0, 0.5, 4)
        z, angle, r = np.meshgrid(z, angle, r, indexing="ij")
        cosine = np.where(angle == angle.max(), 0.0, np.cos(angle))
        points, cells = bricks(np.stack((r * cosine, r * np.sin(angle), z), axis=-1))
        path = tmp_path / f"quarter{n}.vtu"
        meshio.Mesh(points, [("tetra", cells[:, np.array(KUHN)].reshape(-1, 4))]).write(path)
        data["mesh"] = {"file": str(path), "element": "3-10-1-3"}
        found.append(solved(data, tmp_path, f"run{n}").curve["force"][-1])
    assert found[1] == pytest.approx(force, rel=2e-2)
    assert (4 * found[1] - found[0]) / 3 == pytest.approx(force, rel=1e-3)


# --- loads, measures, supports


@each_element
def test_a_force_is_spread_over_the_ring_and_areas_are_those_swept(code, tmp_path):
    """An even traction on the top of a pipe between smooth walls: uniaxial strain, at every radius the same."""
    area = pi * (2.0**2 - 1.0**2)
    data = ring(
        section(code, 3, tmp_path),
        code,
        law="svk",
        constraint=[
            {"group": "inner", "fix": ["x"]},
            {"group": "outer", "fix": ["x"]},
            {"group": "bottom", "fix": ["z"]},
        ],
        load=[{"type": "force", "group": "top", "total": [0.0, 0.0, -0.1 * area]}],
        output={"curve": {"force": "bottom.z", "stroke": "top.z"}},
        probe=[{"name": "top", "group": "top", "mean": "area"}],
    )
    results = solved(data, tmp_path)
    lame, mu = LAWS["svk"].parameters(YOUNG, POISSON)
    stretch = brentq(lambda s: (lame / 2 + mu) * (s**3 - s) + 0.1, 0.8, 1.0, xtol=1e-14)
    tops = np.isclose(results.points[:, 2], 0.5)
    np.testing.assert_allclose(results.field("displacement")[tops, 2], 0.5 * (stretch - 1), rtol=1e-9)
    assert results.curve["force_stress_area"][-1] == pytest.approx(-0.1 * area, rel=1e-9)
    assert results.curve["force"][-1] == pytest.approx(0.1 * area, rel=1e-9)
    assert results.probes["top.x"][-1] == pytest.approx((2**3 - 1) / 3 / (3 / 2), rel=1e-12)


def test_nodes_count_as_their_rings_in_the_mean_stress(tmp_path):
    """A stress that grows with the radius, on a disc with its axis: the mean over nodes would be 1/2, over the area 2/3."""
    data = ring(
        section("2-6-1-2", 8, tmp_path, low=(0.0, 0.0)),
        "2-6-1-2",
        constraint=[{"group": "bottom", "fix": ["z"]}],
        output={"curve": {"force": "top.z", "stroke": "top.z"}},
    )
    built = build(case_from_dict(data, tmp_path), MPI.COMM_SELF)
    body = built.model
    corners = body.cells[:, :3]
    stress = np.zeros((len(corners), 9))
    stress[:, 8] = body.reference[corners, 0].mean(axis=1)
    assert mean_stress(Assembly(body), stress, "top", 2) == pytest.approx(2 / 3, rel=0.02)


@each_element
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_a_free_ring_falls_as_a_whole_and_has_its_mass(code, mass, tmp_path):
    """Load and mass have the same shares; momentum and energy are those of 2 pi R A rho, slopes do not move."""
    data = ring(
        section(code, 2, tmp_path, odd=True),
        code,
        load=[{"type": "gravity", "acceleration": [0.0, 0.0, -9.81]}],
        dynamics={
            "duration": 1e-3,
            "outputs": 1,
            "step": 2.5e-4,
            "integrator": "central_difference",
            "mass": mass,
        },
        initial={"velocity": [0.0, 0.0, 3.0]},
    )
    results = solved(data, tmp_path)
    mesh = meshio.read(data["mesh"]["file"])
    (cells,) = mesh.cells_dict.values()
    p = mesh.points[cells][..., [0, 2]]
    area = 0.5 * np.abs(
        sum(p[:, i, 0] * p[:, i - 1, 1] - p[:, i - 1, 0] * p[:, i, 1] for i in range(p.shape[1]))
    )
    total = 1.3 * 2 * pi * (area * p[..., 0].mean(axis=1)).sum()
    curve = results.curve
    assert curve["kinetic_energy"][0] == pytest.approx(total * 4.5, rel=1e-12)
    assert curve["momentum.z"][-1] == pytest.approx(total * (3.0 - 9.81e-3), rel=1e-11)
    assert curve["momentum.x"][-1] == curve["angular_momentum.y"][-1] == 0.0
    np.testing.assert_allclose(results.field("velocity")[:, 2], 3.0 - 9.81e-3, rtol=1e-9)
    np.testing.assert_allclose(results.field("velocity")[:, 0], 0.0, atol=1e-8)


def test_a_slender_ring_breathes_with_its_frequency(tmp_path):
    """omega^2 = E / rho R^2 of a slender ring that widens, half of it where its square section rolls; nothing resists the axis."""
    data = ring(
        section("2-6-1-2", 2, tmp_path, low=(9.95, 0.0), size=(0.1, 0.1)),
        "2-6-1-2",
        law="svk",
        dynamics={"duration": 1.0, "step": 0.1},
    )
    assembly = Assembly(build(case_from_dict(data, tmp_path), MPI.COMM_SELF).model)
    rigid, rolling, breathing = modes_at(
        assembly, Mass(assembly), assembly.reference_vector(), 3
    ).omega_squared
    assert abs(rigid) < 1e-9 * breathing
    # Thickness 1 % of the radius: terms of its square are left out.
    assert sqrt(breathing) == pytest.approx(sqrt(YOUNG / 1.3) / 10.0, rel=1e-4)
    assert sqrt(rolling) == pytest.approx(sqrt(YOUNG / 2.6) / 10.0, rel=1e-4)


REST = {"uz": -0.0650052, "ux": -0.0038194}
"""By runge_kutta_5dp with tolerance 1e-10."""


@pytest.mark.parametrize(
    ("name", "more", "drift"),
    [
        ("energy_momentum", {"step": 0.01}, 1e-10),
        ("generalized_alpha", {"step": 0.005}, 2e-2),
        ("runge_kutta_5dp", {"tolerance": 1e-8}, 1e-6),
        ("central_difference", {"step": 5e-3}, 1e-3),
    ],
)
def test_a_ring_let_go_comes_to_the_same_place_by_every_integrator(name, more, drift, tmp_path):
    """A thick ring pulled along its axis by its weight, its upper side held: the same motion, and the energy is kept."""
    data = ring(
        section("2-6-1-2", 2, tmp_path),
        "2-6-1-2",
        constraint=[{"group": "top", "fix": ["x", "z"]}],
        load=[{"type": "gravity", "acceleration": [0.0, 0.0, -0.5]}],
        dynamics={"duration": 1.0, "outputs": 4, "integrator": name, **more},
        probe=[{"name": "bottom", "group": "bottom"}],
    )
    results = solved(data, tmp_path)
    curve = results.curve
    assert np.abs(curve["energy_drift"]).max() < drift * curve["external_work"].max()
    assert results.probes["bottom.uz"][-1] == pytest.approx(REST["uz"], rel=2e-3)
    assert results.probes["bottom.ux"][-1] == pytest.approx(REST["ux"], rel=1e-2)


# --- what is refused

HELD = [{"group": "bottom", "fix": ["x", "z"]}]
WRONG = {
    "spin": (
        {"initial": {"spin": [0.0, 0.0, 1.0]}, "dynamics": {"duration": 1.0, "step": 0.1}},
        "initial.spin: a body of revolution moves in the plane of its section and does not rotate.*expected no spin",
    ),
    "velocity": (
        {"initial": {"velocity": [1.0, 0.0, 1.0]}, "dynamics": {"duration": 1.0, "step": 0.1}},
        "initial.velocity: this has a component across the axis of revolution.*expected a component along z alone",
    ),
    "gravity": (
        {"constraint": HELD, "load": [{"type": "gravity", "acceleration": [9.81, 0.0, 0.0]}]},
        r"load.0: this has a component across the axis.*found .9.81, 0.0, 0.0., expected a component along z alone",
    ),
    "force": (
        {"constraint": HELD, "load": [{"type": "force", "group": "outer", "total": [1.0, 0.0, 0.0]}]},
        "load.0: this has a component across the axis of revolution, and around the axis components across it cancel",
    ),
    "out of plane": (
        {"constraint": HELD, "load": [{"type": "force", "group": "outer", "total": [0.0, 1.0, 0.0]}]},
        "load.0: .*this acts along y",
    ),
    "axis": (
        {"constraint": HELD, "section": {"axis": "y"}},
        'section.axis: .*plane x-z: found \'y\', expected "x" or "z"',
    ),
    "thickness": (
        {"constraint": HELD, "section": {"thickness": 1.0}},
        "section.thickness: a body of revolution does not read it: found 1.0, expected plane and axis and angle",
    ),
    "angle": (
        {"constraint": HELD, "section": {"angle": 400.0}},
        r"section.angle: found 400.0, expected a number in \(0, 360\]",
    ),
    "strain": (
        {"constraint": HELD, "section": {"plane": "strain", "thickness": 1.0, "angle": 90.0}},
        "section.angle: element 2-6-1-2 does not read it: found 90.0, expected thickness and plane",
    ),
    "free": (
        {"constraint": [{"group": "inner", "fix": ["x"]}]},
        "constraint: the supports leave rigid motions free: translation along z",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_differs_around_the_axis_is_refused(name, tmp_path):
    tables, message = WRONG[name]
    data = ring(section("2-6-1-2", 1, tmp_path), "2-6-1-2", **tables)
    with pytest.raises(CaseError, match=message):
        make_plan(case_from_dict(data, tmp_path))


def test_a_ring_needs_no_support_across_its_axis(tmp_path):
    """Neither a radial one nor one against rotation: the hoop holds both."""
    data = ring(section("2-6-1-2", 1, tmp_path), "2-6-1-2", constraint=[{"group": "bottom", "fix": ["z"]}])
    make_plan(case_from_dict(data, tmp_path))


def test_nodes_beyond_the_axis_are_named(tmp_path):
    data = ring(section("2412", 2, tmp_path, low=(-0.25, 0.0)), "2412", constraint=HELD)
    message = (
        r"3 nodes lie beyond the axis of revolution, z, the first is node 1 at x = -0.25: expected all nodes at x >= 0, "
        r'the radius; move the mesh, or give the other axis: \[section\] axis = "x"'
    )
    with pytest.raises(MeshError, match=message):
        make_plan(case_from_dict(data, tmp_path))


def test_the_other_axis_of_the_plane(tmp_path):
    """About x the same mesh is another body: a disc of radius 1/2."""
    data = ring(section("2412", 2, tmp_path), "2412", constraint=[{"group": "inner", "fix": ["x", "z"]}])
    data["section"]["axis"] = "x"
    model = build(case_from_dict(data, tmp_path), MPI.COMM_SELF).model
    assert model.volumes.sum() == pytest.approx(pi * 0.25, rel=1e-13)


def test_nodes_on_the_axis_are_held_and_said(tmp_path):
    """A drive of their radius contradicts it; holding it does not."""
    mesh = section("2-6-1-2", 1, tmp_path, low=(0.0, 0.0))
    plan = make_plan(case_from_dict(ring(mesh, "2-6-1-2", constraint=HELD), tmp_path))
    assert "3 nodes lie on the axis of revolution: their component x is held" in plan.mesh.notes
    on = plan.space.points[:, 0] == 0.0
    assert (plan.supports.drive[plan.space.positions[on], 0] >= 0).all()
    data = ring(mesh, "2-6-1-2", constraint=[*HELD, {"group": "top", "move": {"x": 0.1}}])
    with pytest.raises(CaseError, match="'axis of revolution' and 'top' contradict each other: 1 nodes"):
        make_plan(case_from_dict(data, tmp_path))
