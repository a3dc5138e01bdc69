"""A small run made by formula, written on any number of ranks: results_writer.py FOLDER [gathered]."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from mpi4py import MPI

from ancf_petsc.parallel.slabs import slab_bounds
from ancf_petsc.results.store import ResultStore
from ancf_petsc.results.tables import CsvTable

TITLE, UNITS, NOTE = "Cube, twisted", "mm, MPa, N", "A cube that nobody drew."
TIMES = (0.0, 0.1, 1.0 / 3.0, 1.0)
GROUPS = {"base": np.array([0, 1, 2, 3]), "a/b: 100 %": np.array([7, 2])}
BRICK = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


def mesh() -> tuple[np.ndarray, np.ndarray]:
    """Unit cube of six tetrahedra: points (8, 3), cells (6, 4)."""
    z, y, x = np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], indexing="ij")
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), BRICK


def node_fields(time: float) -> dict[str, np.ndarray]:
    """displacement (n, 3): compressed by 0.1 t, twisted by 0.3 t; temperature (n,)."""
    points, _ = mesh()
    turn = 0.3 * time * points[:, 2] * (points[:, [1, 0]] * [-1.0, 1.0]).T
    return {
        "displacement": np.column_stack([*turn, -0.1 * time * points[:, 2]]),
        "temperature": time * points[:, 0],
    }


def cell_fields(time: float) -> dict[str, np.ndarray]:
    """cauchy (e, 3, 3), not symmetric so that the order of components shows; det_F (e,)."""
    count = len(mesh()[1])
    return {
        "cauchy": time * np.arange(count * 9.0).reshape(count, 3, 3) - 20.0,
        "det_F": 1.0 - 0.1 * time * np.arange(count),
    }


def write(folder: Path, comm: MPI.Comm, *, parallel: bool | None = None) -> None:
    """Tables and fields, as a run writes them."""
    folder.mkdir(parents=True, exist_ok=True)
    points, cells = mesh()
    nodes = _slab(len(points), comm)
    elements = _slab(len(cells), comm)
    store = ResultStore(folder, comm, TITLE, UNITS, note=NOTE, version="0", parallel=parallel)
    groups = GROUPS if comm.rank == 0 else None
    numbers = np.arange(10, 18)[nodes], np.arange(100, 106)[elements]
    store.write_mesh(points[nodes], "tetra", cells[elements], *numbers, groups)
    for time in TIMES:
        at_nodes = {name: rows[nodes] for name, rows in node_fields(time).items()}
        over_cells = {name: rows[elements] for name, rows in cell_fields(time).items()}
        store.write_step(time, at_nodes, over_cells, {"stroke": -0.1 * time})
    if comm.rank == 0:
        _write_tables(folder)


def _slab(rows: int, comm: MPI.Comm) -> slice:
    bounds = slab_bounds(rows, comm.size)
    return slice(bounds[comm.rank], bounds[comm.rank + 1])


def _write_tables(folder: Path) -> None:
    columns = (
        "pseudo_time",
        "stroke",
        "force",
        "strain_energy",
        "external_work",
        "min_det_F",
        "newton_iterations",
    )
    with CsvTable(folder / "curve.csv", columns) as curve:
        for step, time in enumerate(TIMES):
            energy = 0.5 * 200.0 * (0.1 * time) ** 2
            curve.append([time, -0.1 * time, -20.0 * time, energy, energy, 1 - 0.5 * time, 3 * (step > 0)])
    with CsvTable(
        folder / "probes.csv", ("pseudo_time", *(f"top.{axis}" for axis in ("x", "y", "z", "ux", "uy", "uz")))
    ) as probes:
        for time in TIMES:
            probes.append([time, 0.5, 0.5, 1 - 0.1 * time, 0.0, 0.0, -0.1 * time])


if __name__ == "__main__":
    write(Path(sys.argv[1]), MPI.COMM_WORLD, parallel=False if "gathered" in sys.argv else None)
