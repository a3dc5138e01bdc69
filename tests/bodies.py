"""Small models made in memory, for tests of forces and tangents."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ancf_petsc import case_from_dict
from ancf_petsc.analysis.build import build
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.model.assembly import Assembly


def odd_mesh(path: Path, seed: int = 0) -> Path:
    """A cube of 162 tetrahedra whose inner nodes are moved and which is sheared: no two cells are alike."""
    import meshio

    make_mesh("cube", path, divisions=(3, 3, 3))
    mesh = meshio.read(path)
    points = mesh.points / mesh.points.max(axis=0)
    inner = ((points > 1e-9) & (points < 1 - 1e-9)).all(axis=1)
    points[inner] += 0.06 * np.random.default_rng(seed).uniform(-1, 1, (int(inner.sum()), 3))
    mesh.points = points @ np.array([[1.0, 0.2, 0.1], [0.0, 0.9, -0.2], [0.1, 0.0, 1.2]]).T
    cells = [("tetra", mesh.cells_dict["tetra"])]
    meshio.Mesh(mesh.points, cells).write(path.with_suffix(".vtu"))
    return path.with_suffix(".vtu")


def assembly_of(data: dict[str, Any], folder: Path) -> Assembly:
    """The assembly of a case given by its tables, on one rank."""
    return Assembly(build(case_from_dict(data, folder), MPI.COMM_SELF).model)


def free_body(mesh: Path, law: str) -> dict[str, Any]:
    """A case that holds nothing (so it has to be a motion), for looking at forces only."""
    return {
        "title": "Free body",
        "mesh": {"file": str(mesh), "element": "3413"},
        "material": {"law": law, "young": 2.0, "poisson": 0.3, "density": 1.0},
        "dynamics": {"duration": 1.0, "step": 0.1},
    }


def random_state(assembly: Assembly, size: float = 0.05, seed: int = 1):
    """The undeformed state with random displacements, as PETSc vector."""
    x = assembly.reference_vector()
    x.array[:] += size * np.random.default_rng(seed).uniform(-1, 1, len(x.array_r))
    return x
