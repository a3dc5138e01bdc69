"""Newton's convergence near the solution."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from bodies import assembly_of
from statics_cases import bar, block

from ancf_petsc.solve.newton import Newton


@pytest.mark.parametrize("law", ["svk", "neo_hooke"])
def test_newton_converges_quadratically(law, tmp_path, capsys):
    """r_(k+1) <= C r_k^2 with one C: the ratios r_(k+1) / r_k^2 stay bounded while r falls by decades."""
    data = block("pvc_block_234.msh", 0.005)
    data["material"]["law"] = law
    assembly = assembly_of(data, tmp_path)
    newton = Newton(assembly, 1e-14)
    x = assembly.reference_vector()
    newton.predict(x, 0.0, 1.0)
    outcome = newton.solve(1.0, x)
    residuals = outcome.residuals
    pairs = [(a, b) for a, b in zip(residuals, residuals[1:], strict=False) if 1e-7 < a < 1e-1]
    ratios = [b / a**2 for a, b in pairs]
    words = [f"{law}: residuals", *(f"{r:.2e}" for r in residuals), "ratios", *(f"{r:.3g}" for r in ratios)]
    with capsys.disabled():
        sys.stdout.write("\n" + " ".join(words) + "\n")
    assert outcome.converged
    assert len(pairs) >= 2
    assert max(ratios) < 100
    assert residuals[-1] < 1e-12


def stretched(total):
    """The bar pulled at its lower edges; its own weight holds half of that."""
    data = bar("bar_2x2x10.msh", gravity=True)
    data["load"][0]["total"] = [0.0, 0.0, total]
    return data


@pytest.mark.parametrize("total", [-120.0, 1e6])
def test_the_force_scale_is_the_larger_of_loads_and_reactions(total, tmp_path):
    """At rest all of the load is out of balance and nothing is supported, then reactions count, which hold load and weight.

    One residual by hand: |free components of Q - Q_e| over the norm of the loads or of the reactions, whichever is larger.
    """
    assembly = assembly_of(stretched(total), tmp_path)
    newton = Newton(assembly, 1e-9)
    x = assembly.reference_vector()
    loads = assembly.external_force(1.0).ravel()
    driven = assembly.driven
    for stretch in (1.0, 1.2):
        x.array[2::3] = stretch * assembly.model.reference[: assembly.model.owned, 2]
        assembly.set_driven(x, 1.0)
        balance = assembly.internal_force(x)[0].ravel() - loads
        free = np.linalg.norm(np.delete(balance, driven))
        scale = max(np.linalg.norm(balance[driven]), np.linalg.norm(loads))
        first = newton.solve(1.0, x.copy()).residuals[0]
        assert first == pytest.approx(free / scale, rel=1e-12)


@pytest.mark.parametrize("gravity", [False, True])
def test_the_predicted_state_errs_with_the_square_of_the_step(gravity, tmp_path):
    """The tangent at the start of a path: moved nodes by the columns of driven degrees of freedom, and loads."""
    data = block("cube_m2.msh", 0.01)
    data["constraint"][-1]["ramp"] = "linear"
    if gravity:
        data["material"]["density"] = 1e4
        data["load"] = [{"type": "gravity", "acceleration": [30.0, 0.0, -100.0]}]
    assembly = assembly_of(data, tmp_path)
    newton = Newton(assembly, 1e-12)
    errors, moved = [], []
    for s in (0.05, 0.1):
        x = assembly.reference_vector()
        assert newton.predict(x, 0.0, s)
        predicted = x.array_r.copy()
        assert newton.solve(s, x).converged
        errors.append(np.linalg.norm(predicted - x.array_r))
        moved.append(np.linalg.norm(predicted - assembly.reference_vector().array_r))
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.1)
    assert errors[1] < 0.05 * moved[1]
