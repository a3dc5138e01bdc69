"""Newton iterations of load paths with different line searches: columns, arches, blocks, pads that hardly change volume."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ancf_petsc.analysis.build import build
from ancf_petsc.bench.meshes import mesh_path
from ancf_petsc.bench.problems import block
from ancf_petsc.errors import NoEquilibrium
from ancf_petsc.input.load import case_from_dict
from ancf_petsc.mesh.made import cache_folder
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined, on_root
from ancf_petsc.solve.load_path import LoadPath, Marks
from ancf_petsc.solve.newton import Newton, Outcome
from ancf_petsc.solve.petsc import petsc_options

ROUNDING = 1e-11
YOUNG, SLENDER = 1e6, np.pi**2 * 1e6 * 0.1**4 / 12 / 4
"""Of the columns; Euler's load of a column 1 long and 0.1 wide, free at its head."""


def column(mesh: str, element: str, load: float, **material: Any) -> dict[str, Any]:
    """Dead load in parts of Euler's, with a side force of 3e-3 of that."""
    beam = element == "1222"
    held = {"fix": ["x", "z"], "slopes": ["z"]} if beam else {"fix": ["x", "y", "z"]}
    total = [-load * SLENDER, 0.0, 3e-3 * SLENDER]
    case = {
        "title": "column",
        "mesh": {"file": str(mesh_path(mesh)), "element": element},
        "groups": {"foot": {"plane": "x", "at": "min"}, "head": {"plane": "x", "at": "max"}},
        "material": {"law": "svk", "young": YOUNG, "poisson": 0.0, **material},
        "constraint": [{"group": "foot", **held}],
        "load": [{"type": "force", "group": "head", "total": total}],
        "statics": {"steps": 2},
    }
    return case | ({"section": {"area": 0.01, "inertia": 0.1**4 / 12}} if beam else {})


def arch(load: float) -> dict[str, Any]:
    """A shallow arch, clamped at both ends, pressed at the crown up to most of what it carries."""
    path = cache_folder() / "arch.vtu"
    if not path.is_file():
        flat = meshio.read(mesh_path("cantilever:40x1x2"))
        x, y, z = flat.points.T
        points = np.stack((x, y, 0.2 * (z - z.mean()) + 0.08 * (1 - (2 * x - 1) ** 2)), axis=1)
        meshio.Mesh(points, [("tetra", flat.cells_dict["tetra"])]).write(path)
    ends = [{"group": name, "fix": ["x", "y", "z"]} for name in ("left", "right")]
    return {
        "title": "arch",
        "mesh": {"file": str(path), "element": "3-10-1-3"},
        "groups": {
            "left": {"plane": "x", "at": "min"},
            "right": {"plane": "x", "at": "max"},
            "crown": {"box": [[0.499, -1, -1], [0.501, 1, 1]]},
        },
        "material": {"law": "svk", "young": YOUNG, "poisson": 0.3},
        "constraint": ends,
        "load": [{"type": "force", "group": "crown", "total": [0.0, 0.0, -load]}],
        "statics": {"steps": 4},
    }


def pad(element: str, poisson: float) -> dict[str, Any]:
    """A quarter of a pad between bonded plates, pressed by a fifth."""
    case = block("cube:3x3x4", 0.02, 2, law="neo_hooke", element=element, tolerance=1e-10)
    case["material"]["poisson"] = poisson
    return case


PROBLEMS = {
    "column/1222": lambda: column("cantilever:20x1x1:line", "1222", 2.0),
    "column/3843": lambda: column("cantilever:10x1x1:hexahedra", "3843", 1.5, poisson=0.3),
    "column/3-10-1-3": lambda: column("cantilever:10x1x1", "3-10-1-3", 1.5, law="neo_hooke", poisson=0.3),
    "arch/3-10-1-3": lambda: arch(1.0),
    "block/3413": lambda: block("pvc_block_234", 0.025, 5, tolerance=1e-10),
    "block/3-10-1-3": lambda: block("cube:3x3x4", 0.03, 3, law="neo_hooke", element="3-10-1-3"),
    "pad_0.499/3-10-1-3": lambda: pad("3-10-1-3", 0.499),
    "pad_0.499/3413": lambda: pad("3413", 0.499),
}


def line_search(comm: MPI.Comm, *, problem: str, search: str, repetitions: int) -> dict[str, Any]:
    """Newton iterations of the whole path, those of steps that failed included. Facts: failed solves, where it ended.

    search: "program", whole steps and then bt; one of PETSc's; "energy", bt on the potential energy, with the residual as
    second criterion where the change of the energy is lost in rounding.
    """
    case = comm.bcast(on_root(comm, lambda: case_from_dict(PROBLEMS[problem](), Path.cwd(), problem)))
    own = {"energy": "bt"}.get(search, search)
    counts: list[int] = []
    facts: dict[str, Any] = {}
    for _ in range(repetitions):
        with petsc_options({} if search == "program" else {"snes_linesearch_type": own}):
            assembly = Assembly(build(case, comm).model)
            newton = _Counting(assembly, case.spec.statics.tolerance, energy=search == "energy")
        steps = case.spec.statics.steps
        path = LoadPath(newton, Marks.of([k / steps for k in range(1, steps + 1)], ()), 1e-4)
        try:
            path.run()
        except NoEquilibrium as error:
            facts["ended"] = str(error)
        counts.append(newton.iterations)
        facts |= {"failed": newton.failed, "reached": path.s, "dof": assembly.model.dof}
        newton.destroy()
    return {"samples": counts, "error": None, "facts": facts}


class _Counting(Newton):
    """Counts iterations. energy: lets PETSc's line search look at the potential energy."""

    def __init__(self, assembly: Assembly, tolerance: float, *, energy: bool) -> None:
        super().__init__(assembly, tolerance)
        self.iterations = self.failed = 0
        self._start = (np.inf, np.inf)
        if energy:
            self._snes.setObjective(self._objective)

    def solve(self, s: float, x: PETSc.Vec, *, careful: bool = False) -> Outcome:
        outcome = super().solve(s, x, careful=careful)
        self.iterations += outcome.newton
        self.failed += not outcome.converged
        return outcome

    def _objective(self, snes: PETSc.SNES, x: PETSc.Vec) -> float:
        """The potential energy; where its change is lost in rounding, one that falls if the residual does."""
        residual, _ = self.residual_at(x)
        norm = combined(self.comm, float(residual @ residual))
        if not np.isfinite(norm):
            return np.inf
        model = self.assembly.model
        moved = x.array_r.reshape(-1, 3) - model.reference[: model.owned]
        work = combined(self.comm, float(np.vdot(self._external, moved)))
        energy = self.assembly.strain_energy(x) - work
        if x.equal(snes.getSolution()):
            self._start = (energy, norm)
        before, size = self._start
        if abs(energy - before) <= ROUNDING * abs(before) and norm < size:
            return before - abs(before)
        return energy
