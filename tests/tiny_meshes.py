"""Meshes of a few cells for the tests of reading and choosing."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ancf_petsc.mesh.assemble import assemble
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.mesh.gmsh_session import gmsh_session
from ancf_petsc.mesh.mesh import Mesh
from ancf_petsc.mesh.raw import Block, RawMesh

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]

TWO = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
4
3 1 "body"
3 2 "upper"
2 7 "body"
2 8 "nothing"
$EndPhysicalNames
$Nodes
6
30 0 0 1
10 0 0 0
11 1 0 0
20 0 1 0
41 1 1 1
99 5 5 5
$EndNodes
$Elements
5
1 2 2 7 1 10 20 11
3 4 2 1 1 10 11 20 30
4 4 2 1 1 11 20 30 41
8 4 2 2 1 11 20 30 41
9 15 2 3 1 10
$EndElements
"""
"""Two tetrahedra of one entity; the second is listed in "body" and in "upper". Node 99 is in neither."""


def write_two_bricks(path: Path, *, version: float, binary: bool, save_all: bool = False) -> Path:
    """Two boxes side by side: "all" is both and a point, "left" one of them, "side" the face x = 0."""
    options = {"Mesh.MshFileVersion": version, "Mesh.Binary": float(binary), "Mesh.SaveAll": float(save_all)}
    with gmsh_session(**options, **{"Mesh.MeshSizeMin": 1.2, "Mesh.MeshSizeMax": 1.2}) as gmsh:
        occ = gmsh.model.occ
        occ.fragment([(3, occ.addBox(0, 0, 0, 1, 1, 1))], [(3, occ.addBox(1, 0, 0, 1, 1, 1))])
        occ.synchronize()
        left = gmsh.model.getEntitiesInBoundingBox(-0.1, -0.1, -0.1, 1.1, 1.1, 1.1, 3)
        side = gmsh.model.getEntitiesInBoundingBox(-0.1, -0.1, -0.1, 0.1, 1.1, 1.1, 2)
        gmsh.model.addPhysicalGroup(3, [1, 2], 1, "all")
        gmsh.model.addPhysicalGroup(0, [1], 1, "all")
        gmsh.model.addPhysicalGroup(3, [left[0][1]], 2, "left")
        gmsh.model.addPhysicalGroup(2, [side[0][1]], 3, "side")
        gmsh.model.addPhysicalGroup(2, [side[0][1]], 9)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    return path


def tetrahedra(
    points=CORNERS,
    cells=((0, 1, 2, 3), (1, 2, 3, 4)),
    *,
    duplicates: str = "error",
    kind: str = "tetra",
    blocks=(),
) -> Mesh:
    """A mesh as if read from a file: nodes 10, 11, ..., cells 100, 101, ..., `blocks` beside the cells."""
    points = np.array(points, dtype=float)
    cells = np.array(cells, dtype=np.int64)
    body = Block(kind, 100 + np.arange(len(cells)), 10 + cells)
    raw = RawMesh(10 + np.arange(len(points)), points, [body, *blocks])
    raw.names = list(dict.fromkeys(name for block in raw.blocks for name in block.names))
    return assemble(raw, Path("tiny.msh"), (kind,), duplicates, "3413")


def part(kind: str, nodes, *names: str) -> Block:
    """Parts of one kind on node numbers (10, 11, ...), in groups."""
    nodes = np.array(nodes, dtype=np.int64)
    return Block(kind, 1 + np.arange(len(nodes)), nodes, names)


def grid(nx: int, ny: int, nz: int, **options) -> Mesh:
    """A box nx x ny x nz of unit bricks, each six tetrahedra."""
    from ancf_petsc.mesh.generate import bricks
    from ancf_petsc.mesh.kinds import KUHN

    z, y, x = np.meshgrid(*(np.arange(n + 1.0) for n in (nz, ny, nx)), indexing="ij")
    points, cells = bricks(np.stack([x, y, z], axis=-1))
    return tetrahedra(points, cells[:, np.array(KUHN)].reshape(-1, 4), **options)


def quadratic_bricks(folder: Path, version: float = 4.1, body: str = "bar", divisions=(1, 1, 2)) -> Path:
    """A body of bricks with 20 nodes, which Gmsh makes of those with 8."""
    linear = make_mesh(body, folder / "linear.msh", divisions=divisions, hexahedra=True)
    path = folder / "quadratic.msh"
    with gmsh_session(**{"Mesh.SecondOrderIncomplete": 1.0, "Mesh.MshFileVersion": version}) as gmsh:
        gmsh.merge(str(linear))
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))
    return path
