"""Bodies that every element of the catalogue is tried on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
from mpi4py import MPI

from ancf_petsc import case_from_dict, run
from ancf_petsc.analysis.build import build
from ancf_petsc.element.catalog import ELEMENTS, element
from ancf_petsc.element.shape import cartesian_values
from ancf_petsc.mesh.generate import bricks, make_mesh
from ancf_petsc.mesh.kinds import KUHN
from ancf_petsc.model.assembly import Assembly

REFERENCE = Path(__file__).parent / "reference"
SECTION = {"thickness": 0.1, "plane": "stress"}


def mesh_of(body: str, code: str, divisions: tuple[int, int, int], folder: Path, *, order: int = 1) -> Path:
    """A mesh of one of the project's bodies with the cells of an element."""
    kind = element(code).cell_name
    path = folder / f"{body}_{kind}{order}_{'_'.join(map(str, divisions))}.msh"
    flat = kind if kind in ("triangle", "quad", "line") else ""
    return make_mesh(body, path, divisions=divisions, hexahedra=kind == "hexahedron", flat=flat, order=order)


def cantilever(mesh: Path, code: str, *, steps: int = 1, **mesh_keys: Any) -> dict[str, Any]:
    """The beam of tests/reference/cantilever.csv: clamped, bent by a dead traction on its end."""
    case = {
        "title": f"Cantilever of {code}",
        "mesh": {"file": str(mesh), "element": code, **mesh_keys},
        "material": {"law": "svk", "young": 1e7, "poisson": 0.3, "density": 1000.0},
        "constraint": [{"group": "clamp", "fix": ["x", "y", "z"]}],
        "load": [{"type": "force", "group": "end", "total": [0.0, 0.0, -100.0]}],
        "statics": {"steps": steps},
        "probe": [{"name": "end", "group": "end", "mean": "area"}],
    }
    return case | ({"section": SECTION} if element(code).is_plane else {})


def unit_cube(code: str, n: int, folder: Path, *, odd: bool = False) -> Path:
    """n x n x n cells (n x n in the plane); odd: no two cells are alike, bricks are parallelepipeds still."""
    kind, generator = element(code).cell_name, np.random.default_rng(3)
    steps = [np.linspace(0, 1, n + 1) for _ in range(3)]
    if odd:
        for axis in steps:
            axis[1:-1] += generator.uniform(-0.2, 0.2, n - 1) / n
    if kind in ("triangle", "quad"):
        x, y = np.meshgrid(steps[0], steps[1])
        index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
        cells = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(
            -1, 4
        )
        points = np.stack((x.ravel(), y.ravel(), np.zeros(x.size)), axis=1)
        inner = ((points[:, :2] > 1e-9) & (points[:, :2] < 1 - 1e-9)).all(axis=1)
    if kind == "triangle":
        cells = cells[:, ((0, 1, 2), (0, 2, 3))].reshape(-1, 3)
        points[inner, :2] += odd * 0.06 * generator.uniform(-1, 1, (int(inner.sum()), 2))
    if kind not in ("triangle", "quad"):
        z, y, x = np.meshgrid(*steps[::-1], indexing="ij")
        points, cells = bricks(np.stack((x, y, z), axis=-1))
    if kind == "tetra":
        cells = cells[:, np.array(KUHN)].reshape(-1, 4)
        inner = ((points > 1e-9) & (points < 1 - 1e-9)).all(axis=1)
        points[inner] += odd * 0.06 * generator.uniform(-1, 1, (int(inner.sum()), 3))
    if odd:
        shear = np.array([[1.0, 0.2, 0.1], [0.0, 0.9, -0.2], [0.1, 0.0, 1.2]])
        d = 2 if kind in ("triangle", "quad") else 3
        points[:, :d] = points[:, :d] @ shear[:d, :d].T
    path = folder / f"cube_{kind}_{n}_{odd}.vtu"
    meshio.Mesh(points, [(kind, cells)]).write(path)
    return path


def held_all_around(code: str, mesh: Path, folder: Path, law: str = "svk", **mesh_keys: Any) -> Assembly:
    """A body whose whole boundary is held; its assembly on one rank."""
    row = element(code)
    read = meshio.read(mesh)
    cells = read.cells_dict[row.cell_name].astype(np.int64)
    from ancf_petsc.mesh.parts import outer_sides

    sides = outer_sides(row.cell_name, cells, len(read.points))
    named = folder / f"{mesh.stem}_held.msh"
    _write_with_sides(named, read.points, row.cell_name, cells, sides)
    data = {
        "title": "Held all around",
        "mesh": {"file": str(named), "element": code, **mesh_keys},
        "material": {"law": law, "young": 1.0, "poisson": 0.3, "density": 1.0},
        "constraint": [{"group": "boundary", "fix": ["x", "y", "z"][: row.components]}],
        "statics": {"steps": 1},
    }
    if row.is_plane:
        data["section"] = {"thickness": 1.0, "plane": "strain"}
    return Assembly(build(case_from_dict(data, folder), MPI.COMM_SELF).model)


def _write_with_sides(path: Path, points: Any, kind: str, cells: Any, sides: Any) -> None:
    side = {"triangle": "line", "quad": "line", "tetra": "triangle", "hexahedron": "quad"}[kind]
    tags = [np.full(len(sides), 1), np.full(len(cells), 2)]
    dimension = {"line": 1, "triangle": 2, "quad": 2}[side]
    meshio.Mesh(
        points,
        [(side, sides), (kind, cells)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"boundary": np.array([1, dimension]), "solid": np.array([2, dimension + 1])},
    ).write(path, file_format="gmsh22", binary=False)


def motion(mesh: Path, code: str, duration: float, **dynamics: Any) -> dict[str, Any]:
    """A hinged body of the pendulum's material that falls from rest."""
    return {
        "title": f"Pendulum of {code}",
        "mesh": {"file": str(mesh), "element": code},
        "material": {"law": "svk", "young": 2e6, "poisson": 0.3, "density": 7800.0},
        "constraint": [{"group": "hinge", "fix": ["x", "y", "z"]}],
        "load": [{"type": "gravity", "acceleration": [0.0, 0.0, -9.81]}],
        "dynamics": {"duration": duration, "outputs": round(100 * duration) or 1, **dynamics},
        "probe": [{"name": "tip", "group": "tip", "mean": "area"}],
    }


def point(results: Any, code: str, xi: Any) -> Any:
    """Positions (steps, 3) of a point of the first cell, from the nodal vectors in the results."""
    row = ELEMENTS[code]
    nodes = results.cells[0, : len(row.cell.corners)]
    jacobian = row.geometry(results.points[nodes][None]).jacobian
    values = cartesian_values(row.values(np.array([xi])), row.slot, jacobian)[0, 0]
    track = []
    for step in range(len(results.times)):
        now = (results.points + results.field("displacement", step))[nodes]
        slopes = results.field("slopes", step)[nodes].reshape(len(nodes), 3, 3)
        track.append(
            values @ np.concatenate((now[:, None], np.swapaxes(slopes, 1, 2)), axis=1).reshape(-1, 3)
        )
    return np.array(track)


def reference_fall(name: str) -> tuple[Any, Any]:
    """Times (t,) and centroids (t, 3) of the end section in a file of tests/reference."""
    table = np.genfromtxt(REFERENCE / name, delimiter=",", names=True)
    return table["t"], np.stack([table[axis] for axis in "xyz"], axis=1)


def fall_of_one_brick(rule: str, folder: Path) -> tuple[Any, Any]:
    """Times (t,) and centroids (t, 3) of the end section of the pendulum as one 3843 that falls for a second."""
    mesh = mesh_of("pendulum", "3843", (1, 1, 1), folder)
    data = motion(mesh, "3843", 1.0, integrator="runge_kutta_5dp", tolerance=1e-8)
    data["mesh"]["rule"] = rule
    results = run(case_from_dict(data, folder), folder / "run")
    return np.array(results.times), point(results, "3843", [0.5, 0.0, 0.0])
