"""Assembled tangents against differences of assembled forces: tangents_on_ranks.py CASES.json, on three ranks.

The first rank alone, the two others together, then all three: errors over the size of what they are errors of, by case and ranks.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.build import build
from ancf_petsc.model.assembly import Assembly

STEP = 2.5e-5
"""Of differences of fourth order, in cells of 0.1 to 1: truncation below 5e-9 for mean forces, 3e-12 for others; rounding 1e-11."""
DIRECTIONS = 2


def state(assembly: Assembly, seed: int) -> Any:
    """Displacements that depend on the position in the undeformed body alone, the same on any number of ranks."""
    model = assembly.model
    x, where = assembly.reference_vector(), model.reference[: model.owned]
    waves = np.random.default_rng(seed).uniform(-2.0, 2.0, (3, 3))
    slots = model.slots[: model.owned, None]
    x.array[:] += (0.04 * np.sin(where @ waves + slots + seed)).ravel()
    return x


def difference(assembly: Assembly, force: Callable, x: Any, direction: np.ndarray) -> np.ndarray:
    """(3 n,) derivative of force(x) along a direction (3 n,) of owned degrees of freedom."""
    ends = []
    for step in (-2 * STEP, -STEP, STEP, 2 * STEP):
        moved = x.copy()
        moved.array[:] += step * direction
        ends.append(force(moved)[0].ravel().copy())
        moved.destroy()
    return (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * STEP)


def product(assembly: Assembly, matrix: Any, direction: np.ndarray) -> np.ndarray:
    """(3 n,) a matrix times a direction."""
    given, result = assembly.vector(), assembly.vector()
    given.array[:] = direction
    matrix.mult(given, result)
    return result.array_r.copy()


def compare(data: dict[str, Any], comm: MPI.Comm) -> dict[str, float]:
    """Errors of all that is assembled at one state, and numbers that are the same on any number of ranks."""
    assembly = Assembly(build(case_from_dict(data, Path(".")), comm).model)
    before, x = state(assembly, 1), state(assembly, 2)
    driven = (assembly.model.drive[: assembly.model.owned] >= 0).ravel()
    forces = {"tangent": assembly.internal_force, "mean_tangent": partial(assembly.mean_force, before)}
    add = {"tangent": assembly.add_tangent, "mean_tangent": partial(assembly.add_mean_tangent, before)}
    filled = assembly.create_matrix(symmetric=False)
    matrix = filled.mat
    answer: dict[str, float] = {}

    def note(name: str, found: np.ndarray, wanted: np.ndarray) -> None:
        sums = comm.allreduce(np.array([np.abs(found - wanted).sum(), np.abs(wanted).sum()]))
        answer[name] = float(np.maximum(answer.get(name, 0.0), sums[0] / sums[1]))  # nan stays

    for seed in range(DIRECTIONS):
        direction = np.random.default_rng((seed, comm.rank)).normal(size=len(driven))
        free = np.where(driven, 0.0, direction)
        for name, force in forces.items():
            filled.clear()
            add[name](x, filled)
            filled.finish()
            slope = difference(assembly, force, x, free)
            note(name, product(assembly, matrix, free), np.where(driven, 0.0, slope))
            diagonal = matrix.getDiagonal().array_r
            totals = comm.allreduce(np.array([diagonal[~driven].sum(), (~driven).sum()]))
            held = product(assembly, matrix, np.where(driven, direction, 0.0))
            note(f"{name} where driven", held, np.where(driven, totals[0] / totals[1] * direction, 0.0))
        along = assembly.vector()
        along.array[:] = direction
        slope = difference(assembly, assembly.internal_force, x, direction)
        note("tangent_product", assembly.tangent_product(x, along).ravel(), slope)
    moved = x.array_r - before.array_r
    work = comm.allreduce(float(assembly.mean_force(before, x)[0].ravel() @ moved))
    rise = assembly.strain_energy(x) - assembly.strain_energy(before)
    answer["work of mean_force"] = abs(work - rise) / abs(rise)
    answer |= {"energy": assembly.strain_energy(x), "smallest_det": assembly.smallest_det(x)}
    return answer | {"driven": comm.allreduce(int(driven.sum()))}


def main() -> None:
    world = MPI.COMM_WORLD
    cases = json.loads(Path(sys.argv[1]).read_text())
    part = world.Split(min(world.rank, 1), world.rank)
    found = {
        name: {"alone_or_two": compare(data, part), "three": compare(data, world)}
        for name, data in cases.items()
    }
    every = world.gather(found)
    if world.rank == 0:
        told = {
            name: [every[0][name]["alone_or_two"], every[1][name]["alone_or_two"], found[name]["three"]]
            for name in cases
        }
        sys.stdout.write("FOUND" + json.dumps(told))


if __name__ == "__main__":
    main()
