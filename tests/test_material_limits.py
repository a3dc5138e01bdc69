"""How far laws carry, from their stress and tangent alone, against closed forms and figures of an independent code."""

from __future__ import annotations

import numpy as np
import pytest

from ancf_petsc.material.limits import (
    critical_surface_stretch,
    ellipticity,
    moduli,
    stress,
    surface_margin,
    uniaxial_limit,
)
from ancf_petsc.material.models import LAWS

# Plane strain; computed independently from the surface impedance matrix. Biot's value is 0.5437 for incompressible neo-Hooke.
SURFACE = {
    ("svk", 0.35): 0.6404,
    ("svk", 0.45): 0.6513,
    ("svk", 0.49): 0.6564,
    ("svk", 0.4999): 0.6578,
    ("neo_hooke", 0.35): 0.5169,
    ("neo_hooke", 0.45): 0.5353,
    ("neo_hooke", 0.49): 0.5426,
    ("neo_hooke", 0.4999): 0.5437,
}


def law_of(name: str, poisson: float = 0.35, young: float = 1.0):
    return LAWS[name], LAWS[name].parameters(young, poisson)


@pytest.mark.parametrize(("name", "poisson"), SURFACE)
def test_a_free_surface_in_plane_strain_folds_at_biot_s_stretch(name, poisson):
    """To the last digit of the reference, which is off by one at 0.45; in any unit of the moduli."""
    law, p = law_of(name, poisson, young=6.8e6)
    found = critical_surface_stretch(law, p, in_plane=True)
    assert found == pytest.approx(SURFACE[name, poisson], abs=1e-4)
    assert surface_margin(law, p, found + 1e-3, in_plane=True) > 0.0
    assert surface_margin(law, p, found - 1e-3, in_plane=True) < 0.0


def test_an_undeformed_surface_is_as_far_from_folding_as_it_is():
    for name in LAWS:
        assert surface_margin(*law_of(name), 1.0) == pytest.approx(1.0, rel=1e-6)


def test_waves_aslant_fold_a_surface_no_later():
    """All directions and components are a larger class than those in the plane; for neo-Hooke the plane ones come first."""
    for name in LAWS:
        law, p = law_of(name, 0.45)
        every, plane = critical_surface_stretch(law, p), critical_surface_stretch(law, p, in_plane=True)
        assert every >= plane - 1e-8
    assert every == pytest.approx(plane, abs=1e-7)


def test_a_surface_pressed_from_both_sides_folds_sooner():
    """Incompressible neo-Hooke: l1^2 l3 = Biot's root 0.2956 for waves along the first axis, the stretch across following."""
    law, p = law_of("neo_hooke", 0.49999)
    for transverse in (0.8, 1.25):
        found = critical_surface_stretch(law, p, transverse, in_plane=True)
        assert found**2 * transverse == pytest.approx(0.2956, abs=2e-4)


def test_svk_carries_less_force_below_the_root_of_a_third_whatever_poisson_s_ratio():
    """P = E/2 (l^3 - l) in uniaxial stress; neo-Hooke has no such stretch."""
    for poisson in (0.0, 0.35, 0.4999):
        assert uniaxial_limit(*law_of("svk", poisson)) == pytest.approx(3**-0.5, abs=1e-6)
        assert uniaxial_limit(*law_of("neo_hooke", poisson)) is None


def test_ellipticity_is_lost_where_waves_of_shear_stand_still():
    """svk pressed all round: (3 lambda + 2 mu) E + mu (1 + 2 E) = 0; in uniaxial strain at the latest for waves along the axis,
    E11 = - mu / (lambda + 2 mu). Turned as well.
    """
    law, (lame, shear) = law_of("svk")
    p = np.array([lame, shear])
    around = np.sqrt(1 - 2 * shear / (3 * lame + 4 * shear))
    assert ellipticity(law, p, (around + 1e-4) * np.eye(3)) > 0.0
    assert ellipticity(law, p, (around - 1e-4) * np.eye(3)) < 0.0
    along = np.sqrt(1 - 2 * shear / (lame + 2 * shear))
    turn, _ = np.linalg.qr(np.array([[1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [5.0, 6.0, 1.0]]))
    for F in (np.diag([along, 1.0, 1.0]), turn @ np.diag([along, 1.0, 1.0]) @ turn.T):
        assert ellipticity(law, p, F) < 1e-3
        assert ellipticity(law, p, np.eye(3) + 0.5 * (F - np.eye(3))) > 0.0
    assert ellipticity(law, p, np.eye(3)) == 1.0


@pytest.mark.parametrize("name", LAWS)
def test_moduli_are_the_derivative_of_the_stress(name):
    law, p = law_of(name)
    F = np.eye(3) + 0.1 * np.random.default_rng(0).uniform(-1, 1, (3, 3))
    D = np.random.default_rng(1).uniform(-1, 1, (3, 3))
    slope = (stress(law, p, F + 1e-6 * D) - stress(law, p, F - 1e-6 * D)) / 2e-6
    np.testing.assert_allclose(np.einsum("iJkL,kL->iJ", moduli(law, p, F), D), slope, rtol=1e-7, atol=1e-8)
