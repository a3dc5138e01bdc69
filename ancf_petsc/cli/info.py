"""`ancf info`: versions, what PETSc can do, the elements; a short self-check on 1 and 2 ranks."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HELP = "versions, elements, and a 10-second self-check on 1 and 2 ranks"
PACKAGES = ("mumps", "hypre", "ml", "ptscotch", "parmetis", "superlu_dist", "suitesparse")
STRETCH = 0.9
CASE = """
title = "Self-check: a cube pressed by a tenth between smooth plates"
[mesh]
file = "cube.msh"
element = "3413"
[groups]
west = { plane = "x", at = "min" }
south = { plane = "y", at = "min" }
low = { plane = "z", at = "min" }
high = { plane = "z", at = "max" }
[material]
law = "svk"
young = 1.0
poisson = 0.3
[[constraint]]
group = "west"
fix = ["x"]
[[constraint]]
group = "south"
fix = ["y"]
[[constraint]]
group = "low"
fix = ["z"]
[[constraint]]
group = "high"
move = { z = -0.01 }
[statics]
steps = 2
[output]
curve = { force = "high.z", stroke = "high.z" }
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--elements", action="store_true", help="print the catalogue of elements and stop")
    parser.add_argument("--no-check", action="store_true", help="leave the self-check out")


def execute(arguments: argparse.Namespace) -> int:
    from ancf_petsc.cli.console import show_table

    if arguments.elements:
        from ancf_petsc.element.catalog import table

        rows = table()
        show_table(list(rows[0]), [list(row.values()) for row in rows])
        return 0
    _print_versions()
    if arguments.no_check:
        return 0
    return 0 if all([_check_machine_code(), _self_check()]) else 4


def _print_versions() -> None:
    from petsc4py import PETSc

    from ancf_petsc.analysis.host.versions import versions
    from ancf_petsc.cli.console import show_facts
    from ancf_petsc.jit import CACHE_FOLDER

    there = [name for name in PACKAGES if PETSc.Sys.hasExternalPackage(name)]
    show_facts(
        [*versions().items(), ("petsc packages", ", ".join(there)), ("compiled kernels", str(CACHE_FOLDER))],
    )


def _check_machine_code() -> bool:
    """Compare the machine code in the cache with the same functions run by Python; clear the cache if one differs."""
    from ancf_petsc.kernel.selfcheck import wrong_kernels
    from ancf_petsc.kernel.warmup import clear_cache, compiled_sets

    wrong, names, begun = set[str](), set[str](), time.perf_counter()
    for element, laws, flags in compiled_sets():
        wrong.update(wrong_kernels(element, laws, **flags))
        names.update(law.name for law in laws)
    if wrong:
        clear_cache()
        print(
            f"machine code in the cache: WRONG: {', '.join(sorted(wrong))}; the cache is cleared, repeat runs made with it"
        )
        return False
    seconds = time.perf_counter() - begun
    words = (
        f"good: equals its source for {', '.join(sorted(names))}, {seconds:.1f} s" if names else "none yet"
    )
    print(f"machine code in the cache: {words}")
    return True


def _self_check() -> bool:
    """Compress a cube between smooth plates on 1 and 2 ranks: uniaxial stress, known exactly on any mesh."""
    from ancf_petsc.mesh.generate import make_mesh

    exact = 0.05**2 * (STRETCH**3 - STRETCH) / 2
    good = True
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        make_mesh("cube", folder / "cube.msh", divisions=(3, 3, 6))
        (folder / "case.toml").write_text(CASE)
        for ranks in (1, 2):
            begun = time.perf_counter()
            problem, error = _solve(folder, ranks, exact)
            words = (
                problem or f"force off by {error:.1e} of the exact one, {time.perf_counter() - begun:.1f} s"
            )
            passed = not problem and error < 1e-9
            print(f"self-check on {ranks} rank{'s' * (ranks > 1)}: {'good' if passed else 'FAILED'}: {words}")
            good = good and passed
    return good


def _solve(folder: Path, ranks: int, exact: float) -> tuple[str, float]:
    """What went wrong, if anything, and the relative error of the last force."""
    from ancf_petsc.errors import EnvironmentProblem
    from ancf_petsc.launcher import environment, on_ranks
    from ancf_petsc.results.reader import open_results

    out = folder / f"run{ranks}"
    command = [sys.executable, "-m", "ancf_petsc", "run", str(folder), "--out", str(out)]
    try:
        command = on_ranks(ranks, command)
    except EnvironmentProblem as problem:
        return str(problem), 1.0
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=False, env=environment()
    )
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if any(c.isalnum() for c in line)]
        return lines[0] if lines else f"exit code {done.returncode}", 1.0
    force = open_results(out).curve["force"][-1]
    return "", abs(force / exact - 1.0)
