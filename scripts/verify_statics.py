"""Checks of statics and of frequencies: closed forms, and what other codes computed (tests/reference)."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from verify_table import ROOT, Row, absolute, check, measure, relative

from ancf_petsc import case_from_dict, load_case, run
from ancf_petsc.analysis.modes import COLUMNS, find_modes
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.solve.newton import Newton

REFERENCE = ROOT / "tests" / "reference"
SOLIDS = {
    "3413": (2, 2, 2),
    "3-10-1-3": (1, 1, 1),
    "3443": (1, 1, 1),
    "3443+4": (1, 1, 1),
    "3813": (2, 2, 2),
    "3843": (1, 1, 1),
}
YOUNG, POISSON = 6.8e6, 0.35


def uniaxial_stress(law: str, stretch: float) -> float:
    """Nominal stress of a bar that is free sideways."""
    lame, shear = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
    if law == "svk":
        return YOUNG * stretch * (stretch**2 - 1) / 2

    def across(b: float) -> float:
        return shear * (b**2 - 1) + lame * np.log(stretch * b**2)

    b = brentq(across, 0.5, 2.0, xtol=1e-15)
    return (shear * (stretch**2 - 1) + lame * np.log(stretch * b**2)) / stretch


@check(
    "Closed forms", "uniaxial stress of both laws by hand; the cube has a side of 0.1 m, a quarter is meshed"
)
def uniaxial_stretch(folder: Path) -> Iterator[Row]:
    for code, divisions in SOLIDS.items():
        mesh = make_mesh("cube", folder / f"{code}.msh", divisions=divisions, hexahedra=code[:2] == "38")
        for law, stretch in (("svk", 0.8), ("svk", 1.3), ("neo_hooke", 0.6), ("neo_hooke", 1.3)):
            case = {
                "title": "Cube in uniaxial stress",
                "mesh": {"file": str(mesh), "element": code},
                "material": {"law": law, "young": YOUNG, "poisson": POISSON},
                "constraint": [
                    {"group": "bottom", "fix": ["z"]},
                    {"group": "symmetry_x", "fix": ["x"]},
                    {"group": "symmetry_y", "fix": ["y"]},
                    {"group": "top", "move": {"z": 0.1 * (stretch - 1)}},
                ],
                "statics": {"steps": 2},
                "output": {"symmetry": 4, "curve": {"force": "top.z", "stroke": "top.z"}},
            }
            force = run(case_from_dict(case, folder), folder / "run", force=True).curve["force"][-1]
            what = f"{code}, {law}, stretch {stretch:g}: force"
            yield relative(what, force, uniaxial_stress(law, stretch) * 0.01, 1e-8, "N")


@check(
    "Closed forms",
    "an affine state is in equilibrium whatever the cells: the patch test, Newton from beside it",
)
def patch_test(folder: Path) -> Iterator[Row]:
    from family import held_all_around, unit_cube

    F = np.array([[1.1, 0.2, 0.0], [-0.1, 0.9, 0.1], [0.05, 0.0, 1.2]])
    for code in SOLIDS:
        mesh = unit_cube(code, 2, folder, odd=True)
        for law in ("svk", "neo_hooke"):
            assembly = held_all_around(code, mesh, folder, law)
            model = assembly.model
            affine = model.reference @ F.T
            x, free = assembly.reference_vector(), model.drive < 0
            x.array[:] = np.where(free, affine + 0.01 * model.size * free, affine).ravel()
            newton = Newton(assembly, 1e-13)
            # Newton leaves driven degrees of freedom where they are: at the affine state.
            outcome = newton.solve(0.0, x)
            apart = np.abs(x.array_r.reshape(-1, 3) - affine).max() / model.size
            apart = apart if outcome.converged else np.nan
            yield measure(
                f"{code}, {law}: largest distance from the affine state over its size", apart, 1e-11
            )
            newton.destroy()


@check(
    "Closed forms", "hanging bar without lateral contraction: E l (l^2 - 1) / 2 = rho g (L - X), integrated"
)
def bar_under_its_weight(folder: Path) -> Iterator[Row]:
    length, young, weight = 0.5, 2e5, 7800.0 * 9.81

    def stretch(place: float) -> float:
        return brentq(lambda s: young * s * (s**2 - 1) / 2 - weight * (length - place), 1.0, 2.0, xtol=1e-15)

    exact = -quad(lambda place: stretch(place) - 1.0, 0.0, length, epsabs=1e-13)[0]
    for code, bound in (("3413", 2e-2), ("3-10-1-3", 1e-4)):
        case = {
            "title": "Bar under its weight",
            "mesh": {"file": str(ROOT / "meshes" / "bar_2x2x10.msh"), "element": code},
            "groups": {"end": {"plane": "z", "at": "min"}, "body": {"box": [[-1, -1, -1], [1, 1, 1]]}},
            "material": {"law": "svk", "young": young, "poisson": 0.0, "density": 7800.0},
            "constraint": [{"group": "top", "fix": ["z"]}, {"group": "body", "fix": ["x", "y"]}],
            "load": [{"type": "gravity", "acceleration": [0.0, 0.0, -9.81]}],
            "statics": {"steps": 2},
            "probe": [{"name": "end", "group": "end", "mean": "area"}],
        }
        found = run(case_from_dict(case, folder), folder / code).probes["end.uz"][-1]
        note = "ten layers of cells; the error is that of the mesh"
        yield relative(f"{code}: displacement of the end", found, exact, bound, "m", note)


@check("Closed forms", "elliptic integrals: K. Mattiasson, Int. J. Numer. Meth. Engng 17 (1981) 145")
def elastica(folder: Path) -> Iterator[Row]:
    from test_family_beam import AREA, INERTIA, YOUNG, clamped

    for load, deflection, shortening in ((1, 0.30172, 0.05643), (10, 0.81061, 0.55500)):
        data = clamped(80, folder, -load * YOUNG * INERTIA, slopes=["z"])
        data["material"]["young"] = 1e3 * YOUNG
        data["section"] = {"area": AREA, "inertia": 1e-3 * INERTIA}
        probes = run(case_from_dict(data, folder), folder / f"run{load}").probes
        what = f"80 beams 1222, P L^2 / (E I) = {load}"
        yield absolute(f"{what}: deflection over length", -probes["end.uz"][-1], deflection, 2e-5)
        yield absolute(f"{what}: shortening over length", -probes["end.ux"][-1], shortening, 2e-5)


@check("Closed forms", "Euler and Bernoulli, roots of cos b cosh b = -1; rod: T = 4 L sqrt(rho / E)")
def frequencies_of_beams(folder: Path) -> Iterator[Row]:
    from test_family_beam import AREA, INERTIA, YOUNG, clamped

    data = clamped(10, folder, 0.0, slopes=["z"])
    del data["load"], data["statics"]
    data["dynamics"] = {"duration": 1.0, "step": 0.1}
    rows = find_modes(case_from_dict(data, folder), folder / "modes", 3, loaded=False, force=False)
    omega = dict(zip(COLUMNS, rows.T, strict=True))["omega"]
    for number, root in enumerate((1.8751041, 4.6940911, 7.8547574)):
        exact = root**2 * np.sqrt(YOUNG * INERTIA / (3900.0 * AREA))
        what = f"10 beams 1222, clamped: mode {number + 1}"
        yield relative(what, omega[number], exact, 5e-4, "rad/s", "cubics raise it by (b h)^4 / 1440")
    case = load_case(ROOT / "cases" / "bar_tension", ["material.poisson=0.0"])
    rows = find_modes(case, folder / "rod", 8, loaded=False, force=False)
    rod = 4 * 0.5 * np.sqrt(7800.0 / 2e5)
    nearest = rows[np.abs(rows[:, 2] - rod).argmin(), 2]
    yield relative(
        "3413, bar without contraction: axial period", nearest, rod, 2e-3, "s", "ten layers of cells"
    )


@check("Statics against other codes", "dolfinx 0.5.2 with MUMPS: force of the whole block at five strokes")
def block_forces(folder: Path) -> Iterator[Row]:
    table = np.genfromtxt(REFERENCE / "pvc_block_forces.csv", delimiter=",", names=True)
    strokes = {"strokes": table["stroke_m"].tolist()}
    for law in ("svk", "neo_hooke"):
        for top, fix in (("fixed", ["x", "y"]), ("free", [])):
            changes = {"material.law": law, "constraint.top.fix": fix, "statics": strokes}
            case = load_case(ROOT / "cases" / "pvc_block").with_changes(changes)
            force = run(case, folder / f"{law}_{top}").curve["force"][1:]
            wanted = table[f"{law}_top_{top}_N"]
            worst = int(np.abs(force / wanted - 1).argmax())
            what = f"PVC block, {law}, top {top}: worst of {len(force)}, at {1e3 * strokes['strokes'][worst]:g} mm"
            yield relative(what, force[worst], wanted[worst], 1e-6, "N")


@check("Statics against other codes", "dolfinx and CalculiX, which agree to all digits written")
def cube_force(folder: Path) -> Iterator[Row]:
    from statics_cases import block

    case = case_from_dict(block("cube_m2.msh", 0.015), folder)
    force = run(case, folder / "run").curve["force"][-1]
    yield relative("cube with bonded faces, svk, pressed by 15 mm: force", force, -2110.66766346, 1e-7, "N")


@check(
    "Statics against other codes", "an independent numpy and numba kernel with scipy's solvers, ten digits"
)
def bar_in_tension(folder: Path) -> Iterator[Row]:
    from statics_cases import bar

    rows = np.genfromtxt(REFERENCE / "bar_tension.csv", delimiter=",", names=True)
    for mesh, elements in (("bar_2x2x10", 240), ("bar_2x2x20", 480)):
        for gravity in (0, 1):
            match = (rows["elements"] == elements) & (rows["gravity"] == gravity)
            wanted = rows[match & (rows["nx"] == 2)][0]
            data = bar(f"{mesh}.msh", gravity=bool(gravity))
            result = run(case_from_dict(data, folder), folder / f"{mesh}_{gravity}")
            what = f"{mesh} {'with' if gravity else 'without'} gravity"
            for name, column in (("middle", "mid_m"), ("end", "end_m")):
                found = result.probes[f"{name}.uz"][-1]
                yield absolute(f"{what}: {name}", found, wanted[column], 2e-10, "m")
            weight = 120.0 + gravity * 7800 * 9.81 * 0.005
            yield relative(
                f"{what}: reaction", result.curve["top.rz"][-1], weight, 1e-9, "N", "load and weight"
            )


@check(
    "Statics against other codes",
    "dolfinx 0.5.2 on the same tetrahedra; a numpy code for elements with slopes",
)
def cantilever(folder: Path) -> Iterator[Row]:
    from family import cantilever as bent
    from family import mesh_of

    def deflection(code: str, divisions: tuple[int, int, int], rule: str = "default") -> float:
        data = bent(mesh_of("cantilever", code, divisions, folder), code, rule=rule)
        return run(case_from_dict(data, folder), folder / "run", force=True).probes["end.uz"][-1]

    with (REFERENCE / "cantilever.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            code = row["element"].partition("(")[2].rstrip(")")
            nx, n = int(row["cells_x"]), int(row["cells_yz"])
            if code not in SOLIDS or nx > 20:
                continue
            wanted = float(row["mean_end_uz_m"])
            yield relative(f"{code}, {nx} x {n} x {n}: end", deflection(code, (nx, n, n)), wanted, 1e-6, "m")
    for code, divisions, rule, wanted in (
        ("3813", (20, 2, 2), "default", -0.314760),
        ("3443", (10, 1, 1), "default", -0.3449803),
        ("3443+4", (10, 1, 1), "default", -0.3479045),
        ("3843", (8, 1, 1), "default", -0.3459002),
    ):
        what = f"{code}, {' x '.join(map(str, divisions))}: end"
        yield absolute(what, deflection(code, divisions, rule), wanted, 1.5e-6, "m")


@check("Frequencies against other codes", "a dense eigensolver of another program")
def periods_of_the_bar(folder: Path) -> Iterator[Row]:
    bar = load_case(ROOT / "cases" / "bar_tension")
    rows = find_modes(bar, folder / "free", 6, loaded=False, force=False)
    for number, wanted in ((1, 2.422115), (2, 2.06323), (6, 0.386335)):
        yield relative(f"bar, mode {number}: period", rows[number - 1, 2], wanted, 2e-6, "s")
    rows = find_modes(bar, folder / "loaded", 1, loaded=True, force=False)
    yield relative("bar under load, mode 1: period", rows[0, 2], 0.868031, 1e-6, "s")
