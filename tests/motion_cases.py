"""Bodies in motion for the tests: cases as tables, and runs without files."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ancf_petsc import case_from_dict, load_case
from ancf_petsc.analysis.build import build
from ancf_petsc.analysis.motion import MotionAnalysis
from ancf_petsc.analysis.run import run_case
from ancf_petsc.errors import AncfError
from ancf_petsc.motion.integration import TimeIntegration

PROJECT = Path(__file__).resolve().parent.parent
CASES = PROJECT / "cases"
REFERENCE = Path(__file__).parent / "reference"
GRAVITY = {"type": "gravity", "acceleration": [0.0, 0.0, -9.81]}
HINGE = {"group": "hinge", "fix": ["x", "y", "z"]}


def body(mesh: str, dynamics: dict[str, Any], **tables: Any) -> dict[str, Any]:
    """A case of a mesh of the project; the pendulum's material unless `material` changes it."""
    material = {"law": "svk", "young": 2e6, "poisson": 0.3, "density": 7800.0, **tables.pop("material", {})}
    return {
        "title": "Body in motion",
        "mesh": {"file": str(PROJECT / "meshes" / mesh), "element": "3413"},
        "material": material,
        "dynamics": dynamics,
        **deepcopy(tables),
    }


def pendulum(dynamics: dict[str, Any], **tables: Any) -> dict[str, Any]:
    """96 tetrahedra, hinged at an edge, falling from the horizontal."""
    return body("pendulum_96.msh", dynamics, **{"constraint": [HINGE], "load": [GRAVITY], **tables})


class Followed:
    """A motion that was followed to its end. rows: what `look(motion)` returned at the start and after each
    step.
    """

    def __init__(self, data: dict[str, Any], look=None, comm: MPI.Comm = MPI.COMM_SELF) -> None:
        case = case_from_dict(data, PROJECT)
        self.motion = MotionAnalysis(case, build(case, comm))
        self.steps: list = []
        self.rows = [look(self.motion)] if look else []

        def on_step(step) -> None:
            self.steps.append(step)
            if look:
                self.rows.append(look(self.motion))

        path = TimeIntegration(self.motion.integrator, self.motion.times, on_step, lambda time: None)
        try:
            path.run()
            self.positions = self.motion.integrator.x.array_r.reshape(-1, 3).copy()
            self.velocities = self.motion.integrator.v.array_r.reshape(-1, 3).copy()
        finally:
            path.destroy()
            self.motion.destroy()


def slope(sizes, errors) -> float:
    """Order of convergence by least squares in logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


@cache
def run_of(case: str) -> tuple[Path, AncfError | None]:
    """Folder of a run of a shipped case, made once for all tests, and the error it ended with, if it did."""
    folder = Path(tempfile.mkdtemp(prefix="ancf-motion-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    try:
        run_case(load_case(CASES / case), folder)
    except AncfError as error:
        return folder, error
    return folder, None
