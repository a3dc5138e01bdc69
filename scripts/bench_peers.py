#!/usr/bin/env python3
"""The quarter block through CalculiX, dolfinx and ancf_petsc, side by side: seconds, forces, ratios.

    .venv/bin/python scripts/bench_peers.py --sizes 9k 74k --json docs/benchmarks/peers.json

CalculiX is timed as a whole process, dolfinx without imports and code generation, ancf_petsc without
imports: reading the mesh and writing results count. Where a program is missing, it says what to install.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from ancf_petsc.bench.machine import commit, machine, now
from ancf_petsc.bench.meshes import mesh_path
from ancf_petsc.bench.problems import POISSON, YOUNG
from ancf_petsc.bench.row import BLOCK_9K, BLOCK_74K, BLOCK_480K
from ancf_petsc.bench.suite import launch
from ancf_petsc.errors import AncfError
from ancf_petsc.launcher import environment, on_ranks
from ancf_petsc.mesh.mesh import Mesh
from ancf_petsc.mesh.read import read_mesh

SYSTEM_PYTHON = "/usr/bin/python3"
SIZES = {"9k": BLOCK_9K, "74k": BLOCK_74K, "480k": BLOCK_480K}
DIRECT = ("calculix", "dolfinx mumps")
RANKS = 2
HELPED = "dolfinx gamg, helped"
"""With this program's predictor and a preconditioner that is kept: what is left is assembly, solver and the rest."""
AGREE = {"calculix": 1e-5, "dolfinx mumps": 1e-6, "dolfinx gamg": 1e-6, HELPED: 1e-6, "ancf_petsc": 1e-6}
TOTAL_FORCE = re.compile(r"total force .* for set TOP and time.*\n\s*\n?\s*(\S+)\s+(\S+)\s+(\S+)")
FACES = (("bottom", "1, 3"), ("symmetry_x", "1, 1"), ("symmetry_y", "2, 2"), ("top", "1, 2"))
Problem = dict[str, Any]


def main() -> int:
    arguments = _arguments()
    programs = _programs()
    report: dict[str, Any] = {"date": now(), "commit": commit(), "machine": machine(), "ranks": RANKS}
    report["results"] = {}
    try:
        for size in arguments.sizes:
            chosen = [name for name in programs if size != "480k" or name not in DIRECT or arguments.direct]
            report["results"][size] = _compare(SIZES[size], chosen, arguments.repetitions)
            _print(size, report["results"][size])
            if arguments.json:
                arguments.json.write_text(json.dumps(report, indent=1) + "\n")
    except AncfError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0 if all(found["agree"] for found in report["results"].values()) else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--sizes", nargs="+", choices=list(SIZES), default=list(SIZES), help="elements (default all)"
    )
    parser.add_argument(
        "--repetitions", type=int, default=3, metavar="N", help="of every program (default 3)"
    )
    parser.add_argument(
        "--direct", action="store_true", help="direct solvers on the largest mesh too: many minutes"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was measured, after each size")
    return parser.parse_args()


def _programs() -> list[str]:
    found = ["ancf_petsc"]
    if shutil.which("ccx"):
        found.append("calculix")
    else:
        print("CalculiX is missing: apt-get install calculix-ccx")
    asked = [SYSTEM_PYTHON, "-c", "import dolfinx"]
    if subprocess.run(asked, env=_clean_environment(), capture_output=True, check=False).returncode == 0:
        found += ["dolfinx gamg", HELPED, "dolfinx mumps"]
    else:
        print("dolfinx is missing: apt-get install python3-dolfinx-real")
    return found


def _compare(problem: Problem, programs: list[str], repetitions: int) -> dict[str, Any]:
    """Every program in turn, again and again: a drift of the machine meets all of them."""
    mesh = read_mesh(mesh_path(problem["mesh"]), ("tetra",))
    runs: dict[str, list[dict[str, Any]]] = {name: [] for name in programs}
    with tempfile.TemporaryDirectory() as place:
        _write_inputs(problem, mesh, Path(place))
        for _ in range(repetitions):
            for name in programs:
                runs[name].append(_run(name, problem, Path(place)))
    table = {name: _summary(found) for name, found in runs.items()}
    return {"elements": len(mesh.cells), "dof": 3 * len(mesh.points), "programs": table, **_judged(table)}


def _summary(runs: list[dict[str, Any]]) -> dict[str, Any]:
    good = [run for run in runs if "problem" not in run]
    if not good:
        return runs[-1]
    totals = [sum(run["seconds"].values()) for run in good]
    spread = (max(totals) - min(totals)) / 2 / median(totals)
    return {**good[-1], "samples": totals, "median": median(totals), "spread": spread}


def _judged(table: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Ratios to ancf_petsc, and whether all forces agree with dolfinx's, or the first there is."""
    good = {name: found for name, found in table.items() if "median" in found}
    right = next(
        (good[name]["force"] for name in ("dolfinx mumps", "dolfinx gamg", "ancf_petsc") if name in good), 0.0
    )
    for found in good.values():
        found["difference"] = abs(found["force"] / right - 1)
        if "ancf_petsc" in good:
            found["ratio"] = found["median"] / good["ancf_petsc"]["median"]
    agree = all(found["difference"] <= AGREE[name] for name, found in good.items())
    own = ("ancf_petsc", HELPED)
    peers = [found["ratio"] for name, found in good.items() if name not in own and "ratio" in found]
    return {"agree": agree and len(good) == len(table), "best_peer_ratio": min(peers, default=None)}


def _run(name: str, problem: Problem, folder: Path) -> dict[str, Any]:
    if name == "ancf_petsc":
        return _run_own(problem)
    return _run_calculix(folder) if name == "calculix" else _run_dolfinx(name, problem, folder)


def _run_own(problem: Problem) -> dict[str, Any]:
    warm_up = {**BLOCK_9K, "steps": 1}
    result = launch("run", {"problem": problem, "warm_up": warm_up, "repetitions": 1}, ranks=RANKS)
    if "problem" in result:
        return result
    facts = result["facts"]
    parts = {part: spent for part, spent in facts["seconds"].items() if part not in ("import", "total")}
    return {"seconds": parts, "force": facts["force"], "iterations": facts["iterations"]}


# --- dolfinx


def _clean_environment() -> dict[str, str]:
    return {
        name: value for name, value in environment().items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))
    }


def _run_dolfinx(name: str, problem: Problem, folder: Path) -> dict[str, Any]:
    task, answer = folder / "task.json", folder / "answer.json"
    solver, helped = name.removesuffix(", helped").split()[1], name == HELPED
    asked = {
        "solver": solver,
        "helped": helped,
        "young": YOUNG,
        "poisson": POISSON,
        "arrays": str(folder / "mesh.npz"),
    }
    task.write_text(json.dumps(asked | {name: problem[name] for name in ("stroke", "steps")}))
    answer.unlink(missing_ok=True)
    script = Path(__file__).with_name("peer_dolfinx.py")
    command = on_ranks(RANKS, [SYSTEM_PYTHON, "-m", "mpi4py", str(script), str(task), str(answer)])
    done = subprocess.run(command, env=_clean_environment(), capture_output=True, text=True, check=False)
    if not answer.is_file():
        return {"problem": next(reversed(done.stderr.strip().splitlines()), f"exit code {done.returncode}")}
    return json.loads(answer.read_text())


# --- CalculiX


def _write_inputs(problem: Problem, mesh: Mesh, folder: Path) -> None:
    np.savez(folder / "mesh.npz", points=mesh.points, cells=mesh.cells)
    with (folder / "block.inp").open("w") as file:
        file.write("*NODE, NSET=ALL\n")
        numbers = np.arange(1, len(mesh.points) + 1)
        np.savetxt(file, np.column_stack((numbers, mesh.points)), fmt="%d, %.17g, %.17g, %.17g")
        file.write("*ELEMENT, TYPE=C3D4, ELSET=SOLID\n")
        cells = np.column_stack((np.arange(1, len(mesh.cells) + 1), mesh.cells + 1))
        np.savetxt(file, cells, fmt="%d", delimiter=", ")
        for name in dict(FACES):
            file.write(f"*NSET, NSET={name.upper()}\n")
            np.savetxt(file, mesh.groups[name].nodes + 1, fmt="%d,")
        file.write(
            f"*MATERIAL, NAME=M\n*ELASTIC\n{YOUNG}, {POISSON}\n*SOLID SECTION, ELSET=SOLID, MATERIAL=M\n"
        )
        file.write("*BOUNDARY\n" + "".join(f"{name.upper()}, {parts}\n" for name, parts in FACES))
        steps = problem["steps"]
        file.write(f"*STEP, NLGEOM, INC={steps}\n*STATIC, DIRECT\n{1 / steps}, 1.\n")
        file.write(f"*BOUNDARY\nTOP, 3, 3, {-problem['stroke']}\n")
        file.write(f"*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY={steps}\nRF\n*END STEP\n")


def _run_calculix(folder: Path) -> dict[str, Any]:
    """A whole process with two threads."""
    threads = {
        "OMP_NUM_THREADS": str(RANKS),
        "CCX_NPROC_STIFFNESS": str(RANKS),
        "CCX_NPROC_EQUATION_SOLVER": str(RANKS),
    }
    begun = time.perf_counter()
    done = subprocess.run(
        ["ccx", "-i", "block"],
        cwd=folder,
        env=os.environ | threads,
        capture_output=True,
        text=True,
        check=False,
    )
    seconds = time.perf_counter() - begun
    said = TOTAL_FORCE.findall((folder / "block.dat").read_text()) if (folder / "block.dat").is_file() else []
    if done.returncode or not said:
        return {"problem": f"CalculiX ended with exit code {done.returncode} and no force"}
    return {"seconds": {"process": seconds}, "force": float(said[-1][2]), "iterations": {}}


def _print(size: str, found: dict[str, Any]) -> None:
    print(f"\n{size}: {found['elements']} elements, {found['dof']} degrees of freedom")
    for name, run in found["programs"].items():
        if "problem" in run:
            print(f"  {name:<21} cannot run: {run['problem']}")
            continue
        parts = ", ".join(f"{part} {spent:.3g}" for part, spent in run["seconds"].items())
        ratio = f"{run['ratio']:6.2f} x ancf_petsc" if "ratio" in run else ""
        print(f"  {name:<21}{run['median']:9.3f} s {ratio}  force {run['force']:.10g}  ({parts})")
    print(f"  forces {'agree' if found['agree'] else 'DIFFER'}")


if __name__ == "__main__":
    sys.exit(main())
