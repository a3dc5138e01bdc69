"""Bodies of revolution for the tests: meshes of their sections and cases on them."""

from __future__ import annotations

import meshio
import numpy as np
from family import unit_cube

YOUNG, POISSON = 2.0, 0.3
TURNS = {"x-z": [[1, 0, 0], [0, 0, 1]], "x-y": [[1, 0, 0], [0, 1, 0]], "y-z": [[0, 1, 0], [0, 0, 1]]}
"""Plane of the section -> directions of the radius and of the axis."""


def section(code, n, folder, *, low=(1.0, 0.0), size=(1.0, 0.5), odd=False, turn="x-z"):
    """A rectangle of n x n cells (twice as many triangles) in a plane of radius and axis."""
    mesh = meshio.read(unit_cube(code, n, folder, odd=odd))
    flat = np.array(low) + mesh.points[:, :2] * size
    path = folder / f"section_{code}_{n}_{odd}_{turn}_{low[0]}_{size[1]}.vtu"
    meshio.Mesh(flat @ np.array(TURNS[turn], float), mesh.cells).write(path)
    return path


def ring(mesh, code, turn="x-z", law="neo_hooke", **tables):
    """A case of a section, its four sides named: inner, outer, bottom, top."""
    r, z = turn.split("-")
    sides = {"inner": (r, "min"), "outer": (r, "max"), "bottom": (z, "min"), "top": (z, "max")}
    return {
        "title": f"Ring of {code}",
        "mesh": {"file": str(mesh), "element": code},
        "section": {"plane": "axisymmetric", **tables.pop("section", {})},
        "groups": {name: {"plane": axis, "at": at} for name, (axis, at) in sides.items()},
        "material": {"law": law, "young": YOUNG, "poisson": POISSON, "density": 1.3},
        **({} if "dynamics" in tables else {"statics": {"steps": 1, "tolerance": 1e-12}}),
        **tables,
    }


def disc(code, law, folder, **dynamics):
    """A disc with its axis, of two materials, bonded below, pressed or let go above."""
    data = ring(
        section(code, 4, folder, low=(0.0, 0.0), odd=False),
        code,
        constraint=[{"group": "bottom", "fix": ["x", "z"]}],
        load=[
            {"type": "gravity", "acceleration": [0.0, 0.0, -0.1]},
            {"type": "force", "group": "top", "total": [0.0, 0.0, -0.02]},
        ],
        probe=[{"name": "top", "group": "top", "mean": "area"}],
        **({"dynamics": {"duration": 0.2, "outputs": 2, **dynamics}} if dynamics else {}),
    )
    data["groups"]["outside"] = {"box": [[0.5, -1, -1], [1.0, 1, 1]]}
    whole = data["material"] | {"law": law}
    return data | {"material": [whole, whole | {"group": "outside", "young": 3.0}]}
