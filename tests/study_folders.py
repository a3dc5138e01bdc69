"""Study folders for the tests of charts, as `ancf study` leaves them: study.csv, study.json, tables of runs."""

import csv
import json
import math

STANDARD = ("elements", "dof", "h", "ranks", "steps", "newton", "linear", "solve_seconds", "total_seconds")


def write(folder, *, keys, quantities, rows, charts=(), orders=(), title="Study", units="SI"):
    """rows: cells by column; what is missing is empty. keys: values by key; quantities: facts by name."""
    folder.mkdir(parents=True, exist_ok=True)
    columns = [*keys, "status", "outcome", "reason"]
    for name in quantities:
        columns += [name, f"{name}_error", f"{name}_uncertainty"]
    columns += [*STANDARD, "seconds_alone", "memory_peak_bytes", "run"]
    with (folder / "study.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns)
        table.writeheader()
        table.writerows(
            {"status": "done", "outcome": "reached", "seconds_alone": "true", **row} for row in rows
        )
    facts = {
        "format": 1,
        "title": title,
        "case": "case.toml",
        "units": units,
        "axes": [{"key": key, "values": values} for key, values in keys.items()],
        "quantities": quantities,
        "orders": list(orders),
        "charts": list(charts),
    }
    (folder / "study.json").write_text(json.dumps(facts), encoding="utf-8")
    return folder


FORCE = {
    "force": {
        "column": "force",
        "unit": "N",
        "reference": {"kind": "richardson", "value": -8860.4, "uncertainty": 1e-4, "words": "extrapolated"},
    }
}
SIZES = [0.016, 0.008, 0.004, 0.002]
ORDERS = {"3413": 1.0, "3-10-1-3": 2.0, "3443": 3.0}


def ladder(folder, charts=(), title="Block: element and mesh"):
    """Errors that fall with known orders; the finest run of 3443 folds, one of 3413 shared the machine."""
    rows = []
    for code, order in ORDERS.items():
        for size in SIZES:
            error = 4.0 * size**order * 10 ** (order - 1)
            dof = 3 * round((0.1 / size) ** 3)
            row = {
                "mesh.element": code, "mesh.size": size, "force": -8860.4 * (1 + error), "force_error": error,
                "force_uncertainty": 1e-4, "elements": dof // 3, "dof": dof, "h": size,
                "solve_seconds": 0.02 + 1e-5 * dof * order**2, "total_seconds": 1.0 + 1e-5 * dof * order**2,
                "run": f"runs/{code}_{size}",
                "seconds_alone": "false" if (code, size) == ("3413", 0.004) else "true",
            }  # fmt: skip
            if (code, size) == ("3443", 0.002):
                row |= {"status": "failed", "outcome": "surface_fold", "reason": "a fold", "force": "",
                        "force_error": "", "force_uncertainty": ""}  # fmt: skip
            rows.append(row)
    orders = [
        {"quantity": "force", "line": {"mesh.element": "3413"}, "order": 1.02, "limit": -8860.0,
         "uncertainty": 1e-3, "verdict": "asymptotic", "words": ""},
        {"quantity": "force", "line": {"mesh.element": "3443"}, "order": None, "limit": None,
         "uncertainty": None, "verdict": "not asymptotic", "words": ""},
    ]  # fmt: skip
    return write(
        folder, keys={"mesh.element": list(ORDERS), "mesh.size": SIZES}, quantities=FORCE, rows=rows,
        charts=charts, orders=orders, title=title,
    )  # fmt: skip


STEPS, SPINS = [0.01, 0.02, 0.04, 0.08], [5.0, 10.0, 20.0]


def motion(folder, charts=(), *, curves=True):
    """Two integrators over step and spin: one grows in energy and then diverges, one stays."""
    rows = []
    for method in ("energy_momentum", "theta"):
        for step in STEPS:
            for spin in SPINS:
                name = f"{method}_{step}_{spin}"
                grown = 1e-9 if method == "energy_momentum" else step * spin
                row = {"dynamics.integrator": method, "dynamics.step": step, "initial.spin": spin, "drift": grown,
                       "limit": 1 / spin, "run": f"runs/{name}"}  # fmt: skip
                if grown > 0.5:
                    row |= {"status": "failed", "outcome": "diverged", "reason": "not finite"}
                rows.append(row)
                if curves:
                    place = folder / "runs" / name
                    place.mkdir(parents=True)
                    lines = ["time,kinetic_energy,strain_energy"]
                    lines += [f"{t / 20},{2 + grown * t / 20},{math.sin(t) ** 2}" for t in range(21)]
                    (place / "curve.csv").write_text("\n".join(lines) + "\n")
    return write(
        folder,
        keys={"dynamics.integrator": ["energy_momentum", "theta"], "dynamics.step": STEPS, "initial.spin": SPINS},
        quantities={"drift": {"column": "energy_drift", "unit": ""}, "limit": {"column": "", "unit": "s"}},
        rows=rows, charts=charts, title="Tumbling block",
    )  # fmt: skip
