"""What quadrature does to an element: only rigid motions without energy, the whole mass, the exact energy."""

import numpy as np
import pytest
from element_cells import CODES, SHAPES, corners_of, functions_at, nodal_vectors, size_of, turnings

from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.element.quadrature import rule, rule_of_degree
from ancf_petsc.element.shape import cartesian_values

SOLIDS = [code for code in CODES if ELEMENTS[code].components == ELEMENTS[code].cell.dimension]
HIGH = {"triangle": 8, "tetra": 12, "line": 17, "quad": 17, "hexahedron": 17}
"""Degrees above all that is integrated here."""
SAFE = [(code, name) for code in SOLIDS for name in ELEMENTS[code].points if name != "mass"]


def strain_matrix(element, geometry, points, weights):
    """B (q s, a m): BᵀB is the linear stiffness for Lame constants of 1, slopes scaled by the size."""
    _, gradients = functions_at(element, geometry, points)
    h, d = size_of(geometry.jacobian[0]), element.cell.dimension
    gradients = h * gradients / np.where(element.slot > 0, h, 1.0)[:, None]
    unit = np.eye(d)
    strain = 0.5 * (np.einsum("qaj,im->qijam", gradients, unit) + np.einsum("qai,jm->qijam", gradients, unit))
    dilatation = gradients[:, None]
    rows = np.concatenate(
        [np.sqrt(2) * strain.reshape(len(points), d * d, -1), dilatation.reshape(len(points), 1, -1)], axis=1
    )
    return (np.sqrt(weights)[:, None, None] * rows).reshape(-1, element.functions * d)


def free_motions(B):
    """Number of displacements without energy.

    Singular values are square roots of energies: on cells of 1:100 the smallest elastic one is above 1e-7 of
    the largest and zeros are at rounding, 1e-13.
    """
    values = np.linalg.svd(B, compute_uv=False)
    return B.shape[1] - int((values > 1e-10 * values[0]).sum())


@pytest.mark.parametrize(("code", "name"), SAFE)
@pytest.mark.parametrize("shape", SHAPES)
def test_only_rigid_motions_are_free_of_energy(code, name, shape):
    """Six in space, three in the plane, with every quadrature the catalogue offers for the stiffness."""
    element = ELEMENTS[code]
    d = element.cell.dimension
    geometry = element.geometry(corners_of(element.cell, shape))
    chosen = element.rule(name)
    B = strain_matrix(element, geometry, chosen.points, chosen.weights)
    assert free_motions(B) == {2: 3, 3: 6}[d]
    h = size_of(geometry.jacobian[0])
    q = (
        nodal_vectors(element, geometry.jacobian[0], np.eye(d, dtype=int))
        * np.where(element.slot > 0, h, 1)[:, None]
    )
    for i in range(d):
        for j in range(i):
            spin = np.zeros((d, d))
            spin[i, j], spin[j, i] = 1, -1
            motion = (q @ spin).ravel()
            # Rounding of the gradients, times the condition of the edge vectors.
            tolerance = 1e-13 * np.linalg.cond(geometry.jacobian[0])
            assert np.linalg.norm(B @ motion) < tolerance * np.linalg.norm(B) * np.linalg.norm(motion)


@pytest.mark.parametrize(
    ("code", "points", "free"),
    [
        ("3-10-1-3", 1, 24),
        ("3443", 8, 7),
        ("3443+4", 8, 12),
        ("3813", 1, 18),
        ("3843", 8, 48),
        ("2412", 1, 5),
        ("2-6-1-2", 1, 9),
    ],
)
def test_too_few_points_are_found(code, points, free):
    """The count sees what a patch test does not: one point less leaves motions that no stress resists."""
    element = ELEMENTS[code]
    chosen = rule(element.cell_name, points)
    geometry = element.geometry(corners_of(element.cell, "random 0"))
    assert free_motions(strain_matrix(element, geometry, chosen.points, chosen.weights)) == free


@pytest.mark.parametrize("name", ["default", "reduced", "exact"])
def test_the_beam_is_free_of_energy_in_three_motions(name):
    """Axial strain u' and curvature w'' of a straight beam along x."""
    beam = ELEMENTS["1222"]
    chosen = beam.rule(name)
    axial, bending = beam.gradients(chosen.points)[..., 0], beam.derivative(chosen.points, (2,))
    weights = np.sqrt(chosen.weights)[:, None]
    assert free_motions(weights * axial) + free_motions(weights * bending) == 3


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("shape", SHAPES)
def test_mass_is_the_volume_and_positive(code, shape):
    """For unit density: a uniform motion has the mass V, the matrix is regular and is the exact integral."""
    element = ELEMENTS[code]
    geometry = element.geometry(corners_of(element.cell, shape))
    h = np.where(element.slot > 0, size_of(geometry.jacobian[0]), 1.0)

    def mass(chosen):
        values = cartesian_values(element.values(chosen.points), element.slot, geometry.jacobian)[0] / h
        return geometry.determinant[0] * np.einsum("q,qa,qb->ab", chosen.weights, values, values)

    M = mass(element.rule("mass"))
    volume = geometry.determinant[0] * float(element.cell.volume)
    uniform = (element.slot == 0).astype(float)
    assert uniform @ M @ uniform == pytest.approx(volume, rel=1e-13)
    exact = mass(rule_of_degree(element.cell_name, HIGH[element.cell_name]))
    np.testing.assert_allclose(M, exact, rtol=0, atol=1e-13 * abs(M).max())
    # A flat direction makes a slope's mass (1/100)^2; Cholesky itself is the test of positivity.
    np.linalg.cholesky(M)


@pytest.mark.parametrize("code", SOLIDS)
def test_exact_rule_integrates_the_energy_of_svk(code):
    """(FᵀF)² has four times the degree of F: the exact rule and one of more points agree."""
    element = ELEMENTS[code]
    geometry = element.geometry(corners_of(element.cell, "random 1"))
    q = np.random.default_rng(1).normal(size=(element.functions, element.components))
    q /= np.where(element.slot > 0, size_of(geometry.jacobian[0]), 1.0)[:, None]

    def energy(chosen):
        _, gradients = functions_at(element, geometry, chosen.points)
        F = np.einsum("qaj,ai->qij", gradients, q)
        C = np.einsum("qki,qkj->qij", F, F)
        return np.einsum("q,qij,qij->", chosen.weights, C, C)

    more = rule_of_degree(element.cell_name, HIGH[element.cell_name])
    assert energy(element.rule("exact")) == pytest.approx(energy(more), rel=1e-12)


@pytest.mark.parametrize("code", SOLIDS)
def test_numbering_of_corners_does_not_matter(code):
    """The linear energy of a displacement is the same in every numbering, with reduced rules too."""
    element = ELEMENTS[code]
    d = element.cell.dimension
    points = corners_of(element.cell, "random 0")
    name = "reduced" if "reduced" in element.points else "default"
    chosen, energies = element.rule(name), []
    for order in turnings(element.cell):
        geometry = element.geometry(points[:, list(order)])
        B = strain_matrix(element, geometry, chosen.points, chosen.weights)
        B *= np.sqrt(geometry.determinant[0]) / size_of(geometry.jacobian[0])
        x = geometry.origin[0, :d] + element.node_coordinates @ geometry.jacobian[0].T
        bend = np.array([[0.3, -0.2, 0.5], [0.1, 0.4, -0.3], [-0.6, 0.2, 0.1]])[:d, :d]
        u = np.sin(x @ bend)[element.node]
        slopes = np.einsum("nm,jm->njm", np.cos(x @ bend), bend)
        for j in range(d):
            rows = element.slot == j + 1
            u[rows] = size_of(geometry.jacobian[0]) * slopes[element.node[rows], j]
        energies.append(np.sum((B @ u.ravel()) ** 2))
    np.testing.assert_allclose(energies, energies[0], rtol=1e-12)
