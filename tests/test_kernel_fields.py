"""Strains, stresses and det F of cells with several points: means by weights, summed here from shape functions."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import assembly_of, random_state
from family import unit_cube

from ancf_petsc.element.catalog import element
from ancf_petsc.material import LAWS

LAME, SHEAR = 0.3 / (1.3 * 0.4), 1.0 / 2.6  # of Young's modulus 1 and Poisson's ratio 0.3


def cauchy(law, F):
    """By hand, (..., 3, 3)."""
    J, one = np.linalg.det(F)[..., None, None], np.eye(3)
    B = F @ np.swapaxes(F, -1, -2)
    if law == "neo_hooke":
        return (SHEAR * (B - one) + LAME * np.log(J) * one) / J
    E = (np.swapaxes(F, -1, -2) @ F - one) / 2
    S = LAME * np.trace(E, axis1=-2, axis2=-1)[..., None, None] * one + 2 * SHEAR * E
    return F @ S @ np.swapaxes(F, -1, -2) / J


@pytest.mark.parametrize("rule", ["default", "exact"])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("code", ["3-10-1-3", "3813"])
def test_fields_are_means_over_the_undeformed_cell(code, law, rule, tmp_path):
    data = {
        "title": "Fields",
        "mesh": {"file": str(unit_cube(code, 2, tmp_path, odd=True)), "element": code, "rule": rule},
        "material": {"law": law, "young": 1.0, "poisson": 0.3, "density": 1.0},
        "dynamics": {"duration": 1.0, "step": 0.1},
    }
    assembly = assembly_of(data, tmp_path)
    model, row = assembly.model, element(code)
    x = random_state(assembly, 0.03)
    tables = row.tables(rule)
    weights = tables.weights / tables.weights.sum()
    corners = model.reference[model.cells[:, : len(row.cell.corners)]]
    inverse = np.linalg.inv(row.geometry(corners).jacobian)
    now = x.array_r.reshape(-1, 3)[model.cells]
    F = np.einsum("eai,qak,ekj->eqij", now, tables.gradients, inverse)
    strain, stress, det = assembly.fields(x)
    assert len(weights) > 1
    E = (np.swapaxes(F, -1, -2) @ F - np.eye(3)) / 2
    np.testing.assert_allclose(det, np.linalg.det(F) @ weights, rtol=1e-12)
    np.testing.assert_allclose(strain.reshape(-1, 3, 3), np.einsum("eqij,q->eij", E, weights), atol=1e-13)
    wanted = np.einsum("eqij,q->eij", cauchy(law, F), weights)
    np.testing.assert_allclose(stress.reshape(-1, 3, 3), wanted, atol=1e-12)
