"""Columns and arches that buckle or snap, of a few cells each, in any place, direction and unit of length."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from ancf_petsc import case_from_dict, open_results, run
from ancf_petsc.errors import NoEquilibrium
from ancf_petsc.mesh.generate import bricks
from ancf_petsc.mesh.kinds import KUHN
from ancf_petsc.results.reader import Results

YOUNG, LENGTH, WIDTH = 1e6, 1.0, 0.1


def grid(counts: tuple[int, int, int], size: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Points and bricks of a box along x with its axis on the x axis."""
    steps = [np.linspace(0.0, size[i], counts[i] + 1) for i in range(3)]
    z, y, x = np.meshgrid(*steps[::-1], indexing="ij")
    points, cells = bricks(np.stack((x, y, z), axis=-1))
    return points - [0.0, size[1] / 2, size[2] / 2], cells


def column(
    folder: Path,
    code: str,
    *,
    unit: float = 1.0,
    axis: int = 0,
    depth: float = WIDTH,
    counts: tuple[int, int, int] = (6, 1, 1),
    **tables: Any,
) -> dict[str, Any]:
    """A column clamped at one end, its other end moved by a fifth of its length towards it and kept from turning.

    unit: of length, in metres. Euler's load is pi^2 E I / L^2: both ends keep their direction, one may sway.
    """
    points, cells = grid(counts, (LENGTH / unit, WIDTH / unit, depth / unit))
    points = np.roll(points, axis, axis=1)
    path = folder / f"column_{counts[0]}_{axis}_{unit}_{depth}.vtu"
    meshio.Mesh(points, [("hexahedron", cells)]).write(path)
    name = "xyz"[axis]
    return {
        "title": "Column",
        "mesh": {"file": str(path), "element": code},
        "groups": {"foot": {"plane": name, "at": "min"}, "head": {"plane": name, "at": "max"}},
        "material": {"law": "neo_hooke", "young": YOUNG * unit**2, "poisson": 0.0},
        "constraint": [
            {"group": "foot", "fix": ["x", "y", "z"]},
            {"group": "head", "move": {name: -0.2 * LENGTH / unit}},
        ],
        "statics": {"steps": 5},
        "output": {"curve": {"force": f"head.{name}", "stroke": f"head.{name}"}},
        "probe": [{"name": "head", "group": "head"}],
        **tables,
    }


def euler(depth: float = WIDTH) -> float:
    """Of `column`, in newtons."""
    return np.pi**2 * YOUNG * depth * WIDTH**3 / 12 / LENGTH**2


def arch(folder: Path, *, load: float | None, **statics: Any) -> dict[str, Any]:
    """Half a shallow arch, pinched at the crown: by a force on one node, or by a displacement of this node (load None)."""
    points, cells = grid((6, 1, 1), (1.0, 0.05, 0.05))
    points[:, 1] += 0.15 * (1 - points[:, 0] ** 2)
    path = folder / "arch.vtu"
    meshio.Mesh(points, [("tetra", cells[:, np.array(KUHN)].reshape(-1, 4))]).write(path)
    crown = [0.0, 0.15 + 0.025, -0.025]
    data = {
        "title": "Shallow arch",
        "mesh": {"file": str(path), "element": "3-10-1-3"},
        "groups": {
            "middle": {"plane": "x", "at": "min"},
            "support": {"plane": "x", "at": "max"},
            "side": {"plane": "z", "at": "min"},
            "crown": {"nearest": crown},
        },
        "material": {"law": "svk", "young": 1e4, "poisson": 0.0},
        "constraint": [
            {"group": "support", "fix": ["x", "y", "z"]},
            {"group": "middle", "fix": ["x"]},
            {"group": "side", "fix": ["z"]},
        ],
        "statics": statics,
        "output": {"curve": {"force": "support.y", "stroke": "crown.y"}},
    }
    if load is None:
        data["constraint"].append({"group": "crown", "move": {"y": -0.35}})
    else:
        data["load"] = [{"type": "force", "group": "crown", "total": [0.0, -load, 0.0]}]
    return data


def solved(data: dict[str, Any], folder: Path) -> tuple[Results, dict[str, Any], str]:
    """Results and summary of a run, whether or not it came to its end, and what was said if it did not."""
    said = ""
    try:
        run(case_from_dict(data, folder), folder / "run", force=True)
    except NoEquilibrium as error:
        said = str(error)
    summary = json.loads((folder / "run" / "summary.json").read_text())
    return open_results(folder / "run"), summary, said
