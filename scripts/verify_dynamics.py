#!/usr/bin/env python3
"""Computes again what is claimed of motions and prints it beside its target. Takes two minutes."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from family import fall_of_one_brick, reference_fall  # noqa: E402
from motion_cases import GRAVITY, REFERENCE, Followed, pendulum, run_of, slope  # noqa: E402

from ancf_petsc.analysis.modes import find_modes  # noqa: E402
from ancf_petsc.analysis.run import run_case  # noqa: E402
from ancf_petsc.input.load import load_case  # noqa: E402
from ancf_petsc.results.tables import read_table  # noqa: E402

CASES = ROOT / "cases"
MOTIONS = {
    "pendulum/case.toml": ("pendulum_96_undamped.csv", "tip", 1e-6),
    "pendulum/damped.toml": ("pendulum_96_damped.csv", "tip", 1e-6),
    "pendulum/vertical.toml": ("pendulum_96_vertical.csv", "tip", 1e-5),
    "ellipsograph/case.toml": ("ellipsograph_78.csv", "A", 1e-5),
}


def tell(what: str, found: object, target: str) -> None:
    shown = f"{found:.4g}" if isinstance(found, float) else str(found)
    print(f"{what:<62} {shown:<24} {target}", flush=True)


def references() -> None:
    for case, (file, probe, target) in MOTIONS.items():
        folder, _ = run_of(case)
        probes, expected = (
            read_table(folder / "probes.csv"),
            np.genfromtxt(REFERENCE / file, delimiter=",", names=True),
        )
        apart = np.sqrt(sum((probes[f"{probe}.{axis}"] - expected[axis]) ** 2 for axis in "xyz"))
        tell(f"{case}: largest distance of {len(apart)} samples, m", float(apart.max()), f"< {target:g}")


def one_brick() -> None:
    """How far the pendulum of one 3843 is from the exact rule of another code, by the rule of quadrature."""
    _, exact = reference_fall("pendulum_3843_1x1x1.csv")
    for rule, target in (("default", "< 2e-4 at the quarters"), ("exact", "< 1e-6")):
        with tempfile.TemporaryDirectory() as folder:
            times, found = fall_of_one_brick(rule, Path(folder))
        apart = np.abs(found - exact)
        what = f"one 3843, {rule} rule"
        tell(f"{what}: at 0.25, 0.5, 0.75 and 1 s, m", float(apart[25::25].max()), target)
        for axis, column in zip("xyz", apart.T, strict=True):
            at = times[column.argmax()]
            tell(f"{what}: largest of 101 samples along {axis}, m", f"{column.max():.3g} at {at:g} s", "")
        if rule == "default":
            late = times[(apart > 2e-4).any(axis=1)]
            tell(f"{what}: samples beyond 2e-4 m, s", ", ".join(f"{t:g}" for t in late), "")


def orders() -> None:
    raised = {**GRAVITY, "ramp": "cosine"}

    def position(duration: float, load: dict, **how) -> np.ndarray:
        return Followed(pendulum({"duration": duration, "outputs": 1, **how}, load=[load])).positions

    answer = position(0.5, raised, integrator="runge_kutta_5dp", step=0.5 / 2000)
    sizes = (50, 100, 200, 400, 800)
    for name in ("generalized_alpha", "energy_momentum", "theta", "bdf", "rosenbrock"):
        errors = [np.abs(position(0.5, raised, integrator=name, step=0.5 / n) - answer).max() for n in sizes]
        target = "2 within 0.1" if name != "rosenbrock" else "3 or more"
        tell(f"order of {name}, gravity raised by a cosine, 50 to 800 steps", -slope(sizes, errors), target)
    answer = position(0.1, GRAVITY, integrator="runge_kutta_5dp", step=0.1 / 6400)
    sizes = (250, 350, 500, 700)
    for name, order in (("runge_kutta_5dp", 5), ("runge_kutta_4", 4)):
        errors = [np.abs(position(0.1, GRAVITY, integrator=name, step=0.1 / n) - answer).max() for n in sizes]
        tell(f"order of {name}, fixed steps inside the limit", -slope(sizes, errors), f"{order} within 0.15")


def free_flight() -> None:
    for case, trapezoidal in (("case.toml", "trapezoidal.toml"), ("fast.toml", "fast_trapezoidal.toml")):
        curve = read_table(run_of(f"tumbling_block/{case}")[0] / "curve.csv")
        energy = curve["kinetic_energy"] + curve["strain_energy"]
        tell(f"tumbling_block/{case}: energy", float(np.abs(energy / energy[0] - 1).max()), "< 1e-8")
        for name in ("momentum", "angular_momentum"):
            vectors = np.stack([curve[f"{name}.{axis}"] for axis in "xyz"], axis=1)
            change = np.linalg.norm(vectors - vectors[0], axis=1).max() / np.linalg.norm(vectors[0])
            tell(f"tumbling_block/{case}: {name}", float(change), "< 1e-8")
        folder, error = run_of(f"tumbling_block/{trapezoidal}")
        curve = read_table(folder / "curve.csv")
        energy = curve["kinetic_energy"] + curve["strain_energy"]
        found = f"step {curve['steps'].sum():.0f}, E / E0 {energy.max() / energy[0]:.3g}"
        tell(f"tumbling_block/{trapezoidal}: fails at", found, "before 400, or E > 1.5 E0")
        print(f"    {error}")


def bar() -> None:
    folder, _ = run_of("bar_tension/case.toml")
    probes, curve = read_table(folder / "probes.csv"), read_table(folder / "curve.csv")
    tell("bar_tension: end against statics", float(abs(probes["end.uz"][-1] / -0.0644134138 - 1)), "< 1e-5")
    balance = np.abs(curve["energy_drift"]).max() / curve["external_work"][-1]
    tell("bar_tension: energy balance over external work", float(balance), "< 1e-6")
    for loaded, expected in ((False, 2.422115), (True, 0.868031)):
        with tempfile.TemporaryDirectory() as place:
            rows = find_modes(
                load_case(CASES / "bar_tension"), Path(place) / "m", 1, loaded=loaded, force=False
            )
        tell(
            f"bar_tension: first period {'under load' if loaded else 'unloaded'}, s",
            f"{rows[0, 2]:.6f}",
            str(expected),
        )


def block() -> None:
    changes = {"material.density": 1350.0, "constraint.top.move": {"z": -0.01}}

    def force(**analysis) -> np.ndarray:
        case = load_case(CASES / "pvc_block").with_changes({**changes, **analysis})
        with tempfile.TemporaryDirectory() as place:
            run_case(case, Path(place) / "run")
            return read_table(Path(place) / "run" / "curve.csv")["force"]

    still = force(statics={"steps": 10})
    for duration in (0.05, 0.1, 0.2, 0.4):
        dynamics = {"duration": duration, "step": duration / 100, "outputs": 10, "damping": 500.0}
        apart = np.abs(force(statics=None, dynamics=dynamics) - still).max() / np.abs(still).max()
        tell(
            f"pvc_block pressed by 10 mm in {duration:g} s: distance from statics",
            float(apart),
            "halves each time",
        )


if __name__ == "__main__":
    for part in (references, one_brick, orders, free_flight, bar, block):
        part()
