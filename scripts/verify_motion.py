"""Checks of motions: other codes' motions (tests/reference), orders of methods, what has to be conserved."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from verify_table import ROOT, Row, absolute, check, measure, relative

from ancf_petsc.analysis.run import run_case
from ancf_petsc.input.load import load_case
from ancf_petsc.results.tables import read_table

CASES = ROOT / "cases"
MOTIONS = {
    "pendulum/case.toml": ("pendulum_96_undamped.csv", "tip"),
    "pendulum/damped.toml": ("pendulum_96_damped.csv", "tip"),
    "pendulum/vertical.toml": ("pendulum_96_vertical.csv", "tip"),
    "ellipsograph/case.toml": ("ellipsograph_78.csv", "A"),
}


@check("Motions against other codes", "scipy's DOP853 on the same equations, within 1e-10 m of itself")
def reference_motions(folder: Path) -> Iterator[Row]:
    from motion_cases import REFERENCE, run_of

    for case, (file, probe) in MOTIONS.items():
        path, _ = run_of(case)
        probes = read_table(path / "probes.csv")
        expected = np.genfromtxt(REFERENCE / file, delimiter=",", names=True)
        apart = np.sqrt(sum((probes[f"{probe}.{axis}"] - expected[axis]) ** 2 for axis in "xyz"))
        yield measure(f"{case}: largest distance of {len(apart)} samples", apart.max(), 1e-8, "m")


@check(
    "Motions against other codes", "a numpy code of its own with DOP853, whose forces are integrated exactly"
)
def one_brick(folder: Path) -> Iterator[Row]:
    from family import fall_of_one_brick, reference_fall

    _, exact = reference_fall("pendulum_3843_1x1x1.csv")
    for rule, bound in (("default", 2e-4), ("exact", 1e-6)):
        (folder / rule).mkdir()
        times, found = fall_of_one_brick(rule, folder / rule)
        apart = np.abs(found - exact)
        what = f"one 3843, {rule} rule"
        yield measure(f"{what}: at 0.25, 0.5, 0.75 and 1 s", apart[25::25].max(), bound, "m")
        at = times[apart.max(axis=1).argmax()]
        yield measure(f"{what}: largest of 101 samples", apart.max(), None, "m", f"at {at:g} s")


@check("Orders of methods", "theory; gravity raised by a cosine, or fixed steps inside the stable limit")
def orders(folder: Path) -> Iterator[Row]:
    from motion_cases import GRAVITY, Followed, pendulum, slope

    raised = {**GRAVITY, "ramp": "cosine"}

    def position(duration: float, load: dict, **how) -> np.ndarray:
        return Followed(pendulum({"duration": duration, "outputs": 1, **how}, load=[load])).positions

    def order(name: str, duration: float, load: dict, sizes: tuple[int, ...], answer: np.ndarray) -> float:
        ends = [position(duration, load, integrator=name, step=duration / n) for n in sizes]
        return -slope(sizes, [np.abs(end - answer).max() for end in ends])

    answer = position(0.5, raised, integrator="runge_kutta_5dp", step=0.5 / 2000)
    for name in ("generalized_alpha", "energy_momentum", "theta", "bdf"):
        found = order(name, 0.5, raised, (50, 100, 200, 400, 800), answer)
        yield absolute(f"{name}, 50 to 800 steps", found, 2, 0.1)
    found = order("rosenbrock", 0.5, raised, (50, 100, 200, 400, 800), answer)
    yield Row("rosenbrock, 50 to 800 steps", found, 3.0, max(3.0 - found, 0.0), 0.0, note="3 or more")
    answer = position(0.1, GRAVITY, integrator="runge_kutta_5dp", step=0.1 / 6400)
    for name, wanted in (("runge_kutta_5dp", 5), ("runge_kutta_4", 4)):
        found = order(name, 0.1, GRAVITY, (250, 350, 500, 700), answer)
        yield absolute(f"{name}, 250 to 700 steps", found, wanted, 0.15)


@check("Conservation", "a free body keeps its energy and momenta; the trapezoidal rule does not")
def free_flight(folder: Path) -> Iterator[Row]:
    from motion_cases import run_of

    for case, trapezoidal in (("case.toml", "trapezoidal.toml"), ("fast.toml", "fast_trapezoidal.toml")):
        curve = read_table(run_of(f"tumbling_block/{case}")[0] / "curve.csv")
        energy = curve["kinetic_energy"] + curve["strain_energy"]
        yield measure(
            f"tumbling_block/{case}: relative change of energy", np.abs(energy / energy[0] - 1).max(), 1e-8
        )
        for name in ("momentum", "angular_momentum"):
            vectors = np.stack([curve[f"{name}.{axis}"] for axis in "xyz"], axis=1)
            change = np.linalg.norm(vectors - vectors[0], axis=1).max() / np.linalg.norm(vectors[0])
            yield measure(f"tumbling_block/{case}: relative change of {name.replace('_', ' ')}", change, 1e-8)
        path, error = run_of(f"tumbling_block/{trapezoidal}")
        curve = read_table(path / "curve.csv")
        energy = curve["kinetic_energy"] + curve["strain_energy"]
        what = f"tumbling_block/{trapezoidal}: energy over its first value"
        note = f"{'fails' if error else 'ends'} at step {curve['steps'].sum():.0f}"
        yield Row(
            what, float(energy.max() / energy[0]), None, float(energy.max() / energy[0]), None, note=note
        )


@check(
    "Conservation", "statics of another code (tests/reference/bar_tension.csv); energy, loss and work balance"
)
def damped_bar(folder: Path) -> Iterator[Row]:
    from motion_cases import run_of

    path, _ = run_of("bar_tension/case.toml")
    probes, curve = read_table(path / "probes.csv"), read_table(path / "curve.csv")
    yield relative("bar_tension: end of the damped motion", probes["end.uz"][-1], -0.0644134138, 1e-5, "m")
    balance = np.abs(curve["energy_drift"]).max() / curve["external_work"][-1]
    yield measure("bar_tension: energy balance over external work", balance, 1e-6)


@check(
    "Conservation", "statics: the distance of slow damped motion from it is the drag, inverse to the duration"
)
def slow_loading(folder: Path) -> Iterator[Row]:
    changes = {"material.density": 1350.0, "constraint.top.move": {"z": -0.01}}

    def force(**analysis) -> np.ndarray:
        case = load_case(CASES / "pvc_block").with_changes({**changes, **analysis})
        run_case(case, folder / "run", force=True)
        return read_table(folder / "run" / "curve.csv")["force"]

    still, before = force(statics={"steps": 10}), None
    for duration in (0.05, 0.1, 0.2, 0.4):
        dynamics = {"duration": duration, "step": duration / 100, "outputs": 10, "damping": 500.0}
        apart = np.abs(force(statics=None, dynamics=dynamics) - still).max() / np.abs(still).max()
        what = f"PVC block pressed by 10 mm in {duration:g} s: distance from statics"
        yield (
            measure(what, apart, None)
            if before is None
            else relative(what, apart, before / 2, 0.05, note="half of the one before")
        )
        before = apart
