"""The planar beam 1222: held at a node, bent far, and in steps that keep energy."""

import numpy as np
import pytest
from element_cells import corners_of
from family import mesh_of
from test_kernel_generic import assembled

from ancf_petsc import CaseError, case_from_dict, run
from ancf_petsc.algebra.graph import block_starts, neighbours
from ancf_petsc.analysis.modes import COLUMNS, find_modes
from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.kernel import point_beam
from ancf_petsc.kernel.interface import Span, Target
from ancf_petsc.kernel.tables import make_tables

BEAM = ELEMENTS["1222"]
KERNELS, ONE = point_beam.make_kernels(None), Span(0, 1)
YOUNG, AREA, INERTIA = 1e6, 2e-4, 2e-9


def body(cells, folder, **tables):
    """A beam of length 1 along x, in the plane x-z."""
    return {
        "title": "Beam",
        "mesh": {"file": str(mesh_of("ellipsograph", "1222", (cells, 1, 1), folder)), "element": "1222"},
        "section": {"area": AREA, "inertia": INERTIA},
        "material": {"law": "svk", "young": YOUNG, "poisson": 0.3, "density": 3900.0},
        "probe": [{"name": "end", "group": "right"}],
        **tables,
    }


def clamped(cells, folder, force, **clamp):
    return body(
        cells,
        folder,
        constraint=[{"group": "left", "fix": ["x", "z"], **clamp}],
        load=[{"type": "force", "group": "right", "total": [0.0, 0.0, force]}],
        statics={"steps": 4},
    )


# Deflection and shortening over the length for P L^2 / (E I) = 1 and 10: elliptic integrals, K. Mattiasson, Int. J. Numer. Meth.
# Engng 17 (1981) 145.
@pytest.mark.parametrize(
    ("load", "deflection", "shortening"), [(1, 0.30172, 0.05643), (10, 0.81061, 0.55500)]
)
def test_a_clamped_beam_is_the_elastica(load, deflection, shortening, tmp_path):
    data = clamped(80, tmp_path, -load * YOUNG * INERTIA, slopes=["z"])
    # An axis that hardly stretches, by 1e-5: E I as it was, E A ten times more. Beyond, Newton needs hundreds of iterations.
    data["material"]["young"], data["section"] = 10 * YOUNG, {"area": AREA, "inertia": INERTIA / 10}
    results = run(case_from_dict(data, tmp_path), tmp_path / "run")
    assert results.probes["end.uz"][-1] == pytest.approx(-deflection, abs=2e-5)
    assert results.probes["end.ux"][-1] == pytest.approx(-shortening, abs=2e-5)
    assert results.curve["left.rz"][-1] == pytest.approx(load * YOUNG * INERTIA, rel=1e-9)


# Displacement of the end over the length: ANCFCable2D of Exudyn (L = 2 m, section 0.1 m x 0.1 m, E = 2.07e11 Pa, F = 3 E I / L^2)
# finds -1.2072398545 m; theta' = M / (E I), stretch = 1 + N / (E A), integrated along the undeformed axis, gives all ten digits.
EXTENSIBLE_ELASTICA = np.array([-0.5085373043, -1.2072398545]) / 2.0


def test_a_bent_beam_that_stretches_is_the_extensible_elastica(tmp_path):
    """Of more than the fourth order in the length of cells, down to the seventh digit; curvature per deformed length, or
    Green's strain in place of the stretch, end 1e-3 and 4e-7 away from it."""
    inertia, errors = 0.05**4 / 12, []
    for cells in (16, 32):
        data = clamped(cells, tmp_path, -3 * YOUNG * inertia, slopes=["z"])
        data["section"] = {"area": 0.05**2, "inertia": inertia}
        data["statics"]["tolerance"] = 1e-12
        results = run(case_from_dict(data, tmp_path), tmp_path / f"run_{cells}")
        found = np.array([results.probes["end.ux"][-1], results.probes["end.uz"][-1]])
        errors.append(abs(found / EXTENSIBLE_ELASTICA - 1.0))
    assert np.all(errors[1] < errors[0] / 20)
    assert np.all(errors[1] < 6e-8)


def test_a_clamp_does_not_keep_the_axis_from_stretching(tmp_path):
    """P = E A (l - 1), up to the clamp itself."""
    data = clamped(2, tmp_path, 0.0, slopes=["z"])
    stretch = 1.1
    data["load"][0]["total"] = [YOUNG * AREA * (stretch - 1.0), 0.0, 0.0]
    results = run(case_from_dict(data, tmp_path), tmp_path / "run")
    np.testing.assert_allclose(results.field("slopes").reshape(-1, 3, 3)[:2, 0, 0], stretch, rtol=1e-9)
    assert results.probes["end.ux"][-1] == pytest.approx(stretch - 1.0, rel=1e-9)


def test_frequencies_of_a_clamped_beam(tmp_path):
    """Euler and Bernoulli's, roots b of cos b cosh b = -1, raised by cubics of length h by (b h)^4 / 1440 of themselves."""
    cells = 10
    data = clamped(cells, tmp_path, 0.0, slopes=["z"])
    del data["load"], data["statics"]
    data["dynamics"] = {"duration": 1.0, "step": 0.1}
    rows = find_modes(case_from_dict(data, tmp_path), tmp_path / "modes", 3, loaded=False, force=False)
    found = dict(zip(COLUMNS, rows.T, strict=True))["omega"]
    roots = np.array([1.8751041, 4.6940911, 7.8547574])
    exact = roots**2 * np.sqrt(YOUNG * INERTIA / (3900.0 * AREA))
    np.testing.assert_allclose(found / exact - 1.0, (roots / cells) ** 4 / 1440, rtol=0.05, atol=1e-7)


def test_without_the_slope_the_end_is_a_hinge(tmp_path):
    with pytest.raises(CaseError, match=r"leave rigid motions free: rotation about the axis along y through"):
        run(case_from_dict(clamped(2, tmp_path, -1e-6), tmp_path), tmp_path / "run")


def test_energy_and_momenta_of_a_free_beam_stay(tmp_path):
    """Thrown and spinning fast enough to stretch by a tenth, in steps of a fiftieth of a turn."""
    data = body(
        6,
        tmp_path,
        initial={"velocity": [1.0, 0.0, 2.0], "spin": [0.0, 25.0, 0.0]},
        dynamics={"duration": 0.5, "integrator": "energy_momentum", "step": 0.005, "outputs": 20},
    )
    curve = run(case_from_dict(data, tmp_path), tmp_path / "run").curve
    assert curve["strain_energy"].max() > 0.01 * curve["kinetic_energy"].max()
    np.testing.assert_allclose(curve["energy_drift"], 0.0, atol=1e-9 * curve["kinetic_energy"][0])
    for name in ("momentum.x", "momentum.z", "angular_momentum.y"):
        scale = abs(curve[name]).max()
        np.testing.assert_allclose(curve[name], curve[name][0], rtol=0, atol=1e-9 * scale, err_msg=name)


class TwoStates:
    """One beam in two strained states far apart."""

    p = np.array([1.0, 0.3])

    def __init__(self):
        cells = np.arange(4, dtype=np.int32)[None]
        corners = corners_of(BEAM.cell, "right-corner")
        axis = ((corners[0, 1] - corners[0, 0]) / np.linalg.norm(corners[0, 1] - corners[0, 0]))[:, None]
        self.tables = make_tables(BEAM, cells, corners, axes=axis)
        generator = np.random.default_rng(4)
        reference = np.stack((corners[0, 0], axis[:, 0], corners[0, 1], axis[:, 0]))
        self.before, self.after = (reference + 0.2 * generator.normal(size=(4, 3)) for _ in range(2))

    def force(self, before, after):
        result = np.zeros((4, 3))
        KERNELS.mean_force((before, after), self.tables, self.p, ONE, result)
        return result

    def tangent(self):
        cells = self.tables.nodes
        pointers, columns = neighbours(cells, 4, 4)
        none = np.zeros(5, np.int64)
        starts = block_starts(cells, 4, pointers, columns, none, np.zeros(0, np.int32), 3)
        strides = np.stack((np.full(4, 12, np.int32), np.zeros(4, np.int32)), axis=1)
        values = np.zeros(144)
        matrix = Target(starts, strides, 144, np.zeros(4, np.uint8), values)
        KERNELS.mean_tangent((self.before, self.after), self.tables, self.p, ONE, matrix)
        return values.reshape(12, 12)


def test_mean_force_does_the_work_of_the_energy_and_balances():
    """Rounding of sums of some hundred terms."""
    two = TwoStates()
    energies = [KERNELS.energy((r,), two.tables, two.p, ONE) for r in (two.before, two.after)]
    force = two.force(two.before, two.after)
    scale = abs(force).sum()
    assert np.sum(force * (two.after - two.before)) == pytest.approx(
        energies[1] - energies[0], abs=1e-14 * scale
    )
    middle = 0.5 * (two.before + two.after)
    np.testing.assert_allclose(np.cross(middle, force).sum(axis=0), 0.0, atol=1e-14 * scale)
    np.testing.assert_allclose(force[::2].sum(axis=0), 0.0, atol=1e-14 * scale)


def test_mean_force_of_one_state_is_the_force():
    two, force = TwoStates(), np.zeros((4, 3))
    KERNELS.internal_force((two.after,), two.tables, two.p, ONE, force)
    np.testing.assert_allclose(two.force(two.after, two.after), force, rtol=0, atol=1e-13 * abs(force).max())


def test_mean_tangent_is_the_derivative_of_the_mean_force():
    """Central differences of sixth order."""
    two, h = TwoStates(), 1e-3
    tangent = two.tangent()
    for column in range(12):
        v = np.eye(12)[column].reshape(4, 3)
        steps = [
            two.force(two.before, two.after + k * h * v) - two.force(two.before, two.after - k * h * v)
            for k in (1, 2, 3)
        ]
        slope = (45 * steps[0] - 9 * steps[1] + steps[2]) / (60 * h)
        np.testing.assert_allclose(tangent[:, column], slope.ravel(), atol=1e-9 * abs(tangent).max())


@pytest.mark.parametrize("shape", ["right-corner", "random 0", "far", "micrometre", "kilometre"])
def test_force_is_the_gradient_of_the_energy_and_the_tangent_that_of_the_force(shape):
    """Central differences of sixth order; positions move by a part of the length, slopes by a pure number."""
    cells = np.arange(4, dtype=np.int32)[None]
    corners = corners_of(BEAM.cell, shape)
    length = np.linalg.norm(corners[0, 1] - corners[0, 0])
    axis = ((corners[0, 1] - corners[0, 0]) / length)[:, None]
    tables, p = make_tables(BEAM, cells, corners, axes=axis), np.array([1.0, 0.3 * length**2])
    generator = np.random.default_rng(6)
    unit = np.array([length, 1.0, length, 1.0])[:, None]
    reference = np.stack((corners[0, 0], axis[:, 0], corners[0, 1], axis[:, 0]))
    r, h = reference + 0.1 * unit * generator.normal(size=(4, 3)), 1e-3

    def energy(x):
        return KERNELS.energy((x,), tables, p, ONE)

    def force(x):
        found = np.zeros((4, 3))
        KERNELS.internal_force((x,), tables, p, ONE, found)
        return found

    def difference(function, v):
        steps = [function(r + k * h * v) - function(r - k * h * v) for k in (1, 2, 3)]
        return (45 * steps[0] - 9 * steps[1] + steps[2]) / (60 * h)

    K = assembled(KERNELS, r, tables, p)
    # Far away the positions carry 1e4 eps of the length, and the difference divides by h.
    accuracy = 1e-6 if shape == "far" else 1e-9
    scaled = K * np.repeat(unit, 3) * np.repeat(unit, 3)[:, None]
    np.testing.assert_allclose(scaled, scaled.T, rtol=0, atol=1e-14 * abs(scaled).max())
    for _ in range(3):
        v = unit * generator.normal(size=(4, 3))
        size = np.linalg.norm(force(r) * unit) * np.linalg.norm(v / unit)
        assert np.sum(force(r) * v) == pytest.approx(difference(energy, v), abs=accuracy * size)
        product, change = (K @ v.ravel()).reshape(4, 3) * unit, difference(force, v) * unit
        np.testing.assert_allclose(product, change, rtol=0, atol=accuracy * abs(product).max())
