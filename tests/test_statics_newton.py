"""Newton's convergence near the solution."""

from __future__ import annotations

import sys

import pytest
from bodies import assembly_of
from statics_cases import block

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
