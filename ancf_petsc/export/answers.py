"""What CalculiX answers to a deck, beside what a run of the same case found."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.errors import EnvironmentProblem, NoEquilibrium
from ancf_petsc.export import applied
from ancf_petsc.export.calculix import EVERY_NODE, WHOLE_BODY, axes_of_deck, forces_printed
from ancf_petsc.export.names import deck_names
from ancf_petsc.input.load import Case
from ancf_petsc.plan.outputs import output_times
from ancf_petsc.plan.plan import Plan

Floats = NDArray[np.float64]
PROGRAM = "ccx"
TOTAL = re.compile(r"total force \(fx,fy,fz\) for set (\S+) and time +(\S+)\s+(\S+) +(\S+) +(\S+)")


class ForceRow(NamedTuple):
    """A component of the force on a group at an output: ours, CalculiX's, their difference over the largest force there."""

    pseudo_time: float
    group: str
    axis: str
    ours: float
    theirs: float
    difference: float


def solve(deck: Path, threads: int = 1) -> dict[str, Floats]:
    """Run CalculiX on a deck, in its folder. Returns name of a set -> its forces (k, 4): time and three components.

    Raises EnvironmentProblem where there is no CalculiX, NoEquilibrium where it does not reach the end.
    """
    program = shutil.which(PROGRAM)
    if program is None:
        raise EnvironmentProblem(f"{PROGRAM} was not found: install CalculiX (apt-get install calculix-ccx)")
    environment = os.environ | {"OMP_NUM_THREADS": str(threads)}
    done = subprocess.run(
        [program, "-i", deck.stem],
        cwd=deck.parent,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    printed = deck.with_suffix(".dat")
    text = printed.read_text() if printed.is_file() else ""
    found: dict[str, list[list[float]]] = {}
    for name, *numbers in TOTAL.findall(text):
        found.setdefault(name, []).append([float(number) for number in numbers])
    problems = [line.strip() for line in done.stdout.splitlines() if "*ERROR" in line]
    if done.returncode or problems or not found:
        why = problems[0] if problems else f"it ends with {done.returncode}"
        raise NoEquilibrium(f"{deck}: CalculiX does not solve it: {why}")
    return {name: np.array(rows) for name, rows in found.items()}


def compare(case: Case, plan: Plan, ours: dict[str, Floats], theirs: dict[str, Floats]) -> list[ForceRow]:
    """Forces on all groups at all outputs. ours: columns of curve.csv, from the undeformed body on; theirs: from `solve`."""
    times = output_times(case.spec, case.file)
    names, turn = deck_names(plan.mesh.groups, (EVERY_NODE, WHOLE_BODY)), axes_of_deck(plan)
    loads = applied.forces(case, plan), applied.weight(case, plan)
    components = [1] if plan.revolution else range(plan.element.cell.dimension)
    rows = []
    for k, s in enumerate(times):
        at_time = []
        for group, members in plan.members.items():
            printed = theirs[names[group]]
            if len(printed) != len(times):
                raise NoEquilibrium(f"CalculiX reached {len(printed)} of {len(times)} outputs")
            own = np.sum([applied.on_group(load, members, s) for load in loads], axis=0)[turn]
            reaction = case.spec.output.symmetry * (printed[k, 1:] * forces_printed(plan) - own)
            for i in components:
                axis = AXES[turn[i]]
                at_time.append((group, axis, float(ours[f"{group}.r{axis}"][k + 1]), float(reaction[i])))
        printed_largest = max(float(np.abs(theirs[names[group]][k, 1:]).max()) for group in plan.members)
        largest = case.spec.output.symmetry * printed_largest * forces_printed(plan) or 1.0
        rows += [ForceRow(s, *row, abs(row[2] - row[3]) / largest) for row in at_time]
    return rows
