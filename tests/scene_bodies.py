"""Bodies for the tests of smaller models: boxes of bricks, rings of tetrahedra, in any place, orientation and unit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np

from ancf_petsc import Case, case_from_dict
from ancf_petsc.mesh.generate import bricks
from ancf_petsc.mesh.gmsh_session import gmsh_session


def box_mesh(path: Path, divisions=(4, 2, 4), low=(0.0, 0.0, 0.0), size=(2.0, 1.0, 3.0)) -> Path:
    """Bricks that fill a box: a mesh that is its own mirror image about all middle planes."""
    axes = [low[i] + size[i] * np.linspace(0.0, 1.0, divisions[i] + 1) for i in range(3)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    points, cells = bricks(np.stack([x, y, z], axis=-1))
    meshio.write(path, meshio.Mesh(points, [("hexahedron", cells)]))
    return path


def box_case(folder: Path, element="3813", **more: Any) -> Case:
    """The box pressed along z between rough plates; its middle is (1, 0.5, 1.5)."""
    path = box_mesh(folder / "box.vtu") if not (folder / "box.vtu").exists() else folder / "box.vtu"
    data = {
        "title": "Box",
        "mesh": {"file": str(path), "element": element},
        "groups": {"low": {"plane": "z", "at": "min"}, "high": {"plane": "z", "at": "max"}},
        "material": {"law": "svk", "young": 1e3, "poisson": 0.3, "density": 2.0},
        "constraint": [
            {"group": "low", "fix": ["x", "y", "z"]},
            {"group": "high", "fix": ["x", "y"], "move": {"z": -0.3}},
        ],
        "statics": {"steps": 2},
        "output": {"curve": {"force": "high.z", "stroke": "high.z"}},
    }
    return case_from_dict(
        {name: value for name, value in {**data, **more}.items() if value is not None}, folder
    )


ENDS = {"low": 1.0, "high": 11.0}
CENTRE = (3.0, 4.0)
OUTER, INNER = 8.0, 3.0


def ring_mesh(
    path: Path, size=3.0, *, axis: int = 2, hollow: float = INNER, notch: float = 0.0, rotation=None
) -> Path:
    """A ring, radii 8 and 3, height 10, about the line through (3, 4) along an axis (their order is cyclic); by Gmsh.

    rotation (3, 3): of all of it, about the origin.
    """
    with gmsh_session(
        **{"Mesh.MeshSizeMax": size, "Mesh.MeshSizeMin": size, "Mesh.MshFileVersion": 2.2}
    ) as gmsh:
        occ = gmsh.model.occ
        body = occ.addCylinder(*CENTRE, ENDS["low"], 0, 0, ENDS["high"] - ENDS["low"], OUTER)
        tools = [occ.addCylinder(*CENTRE, ENDS["low"], 0, 0, 10, hollow)] if hollow else []
        if notch:
            tools.append(occ.addBox(CENTRE[0] + OUTER - notch, CENTRE[1] - 1, 3, 2 * notch, 2, 3))
        if tools:
            occ.cut([(3, body)], [(3, tool) for tool in tools])
        occ.synchronize()
        for _, tag in gmsh.model.getEntities(2):
            height = occ.getCenterOfMass(2, tag)[2]
            for number, (name, level) in enumerate(ENDS.items(), start=2):
                if abs(height - level) < 1e-6:
                    gmsh.model.addPhysicalGroup(2, [tag], number, name)
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], 1, "body")
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.affineTransform(turn(axis))
        if rotation is not None:
            gmsh.model.mesh.affineTransform(np.hstack((rotation, np.zeros((3, 1)))).ravel().tolist())
        gmsh.write(str(path))
    return path


def turn(axis: int) -> list[float]:
    """The rows (12,) that bring z onto an axis, x and y onto those that follow it."""
    rows = np.roll(np.eye(3), axis - 2, axis=0)
    return np.hstack((rows, np.zeros((3, 1)))).ravel().tolist()


def ring_case(folder: Path, element="3413", axis: int = 2, **mesh: Any) -> Case:
    """The ring pressed along its axis by half a millimetre; units mm, N, MPa."""
    path = ring_mesh(folder / "ring.msh", axis=axis, **mesh)
    name = "xyz"[axis]
    data = {
        "title": "Ring",
        "mesh": {"file": str(path), "element": element},
        "material": {"law": "neo_hooke", "young": 5.0, "poisson": 0.4},
        "constraint": [
            {"group": "low", "fix": ["x", "y", "z"]},
            {"group": "high", "fix": [other for other in "xyz" if other != name], "move": {name: -0.5}},
        ],
        "statics": {"steps": 1},
        "output": {"curve": {"force": f"low.{name}", "stroke": f"high.{name}"}},
    }
    return case_from_dict(data, folder)
