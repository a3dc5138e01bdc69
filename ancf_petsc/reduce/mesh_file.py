"""A mesh as a Gmsh file of version 2.2 that keeps its numbers; every group is a physical group, as the program reads it."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np

from ancf_petsc.errors import writing
from ancf_petsc.mesh.groups import cells_of, parts_for_load, parts_for_support
from ancf_petsc.mesh.kinds import KINDS, Kind, part_kind
from ancf_petsc.mesh.mesh import Group, Integers, Mesh

Entry = tuple[str, Kind, Integers, Integers]
"""Of a physical group: its name, the kind of its parts, their numbers (m,), their nodes (m, k) as indices of points."""


QUADRATIC = {("tetra", 10): "tetra10", ("triangle", 6): "triangle6", ("hexahedron", 20): "hexahedron20"}
"""Kinds of cells by the kind of their corners and the number of their nodes."""


def write_mesh(mesh: Mesh, path: Path) -> None:
    """Write all of a mesh. Nodes that no cell uses are left out, and those that files of meshes do not know (centres of faces)."""
    corners = KINDS[mesh.kind].nodes
    name = mesh.kind if mesh.cells.shape[1] == corners else QUADRATIC.get((mesh.kind, mesh.cells.shape[1]))
    kind, cells = (KINDS[name], mesh.cells) if name else (KINDS[mesh.kind], mesh.cells[:, :corners])
    entries = [entry for group in mesh.groups.values() for entry in _entries(mesh, group, kind, cells)]
    highest = int(mesh.cell_numbers.max())
    used = np.unique(cells)
    with writing(path, "--out"), path.open("w") as file:
        rows: list[Entry] = [(_free_name(mesh), kind, mesh.cell_numbers, cells), *entries]
        file.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n")
        file.write(f"$PhysicalNames\n{len(rows)}\n")
        for tag, (group, part, *_) in enumerate(rows, start=1):
            file.write(f'{part.dimension} {tag} "{group}"\n')
        file.write(f"$EndPhysicalNames\n$Nodes\n{len(used)}\n")
        np.savetxt(
            file, np.column_stack((mesh.node_numbers[used], mesh.points[used])), "%d %.17g %.17g %.17g"
        )
        file.write(f"$EndNodes\n$Elements\n{sum(len(nodes) for *_, nodes in rows)}\n")
        for tag, (_, part, numbers, nodes) in enumerate(rows, start=1):
            if not len(numbers):
                numbers = highest + 1 + np.arange(len(nodes))
                highest += len(nodes)
            _write_elements(file, mesh, part, tag, numbers, nodes)
        file.write("$EndElements\n")


def _write_elements(
    file: TextIO, mesh: Mesh, kind: Kind, tag: int, numbers: Integers, nodes: Integers
) -> None:
    ordered = nodes[:, np.argsort(kind.gmsh_order)] if kind.gmsh_order else nodes
    head = np.broadcast_to((kind.gmsh, 2, tag, tag), (len(nodes), 4))
    np.savetxt(file, np.column_stack((numbers, head, mesh.node_numbers[ordered])), "%d")


def _free_name(mesh: Mesh) -> str:
    name = "body"
    while name in mesh.groups:
        name += "_"
    return name


def _entries(mesh: Mesh, group: Group, kind: Kind, cells: Integers) -> list[Entry]:
    """The parts of a group; a set of nodes stands as what loads and supports take it for, and the nodes left as points."""
    none = np.empty(0, np.int64)
    parts = dict(group.parts)
    if not parts:
        dimension, rows = parts_for_load(mesh, group)
        parts = {dimension: rows} if dimension else parts_for_support(mesh, group)
    whole = kind.dimension in parts
    parts.pop(kind.dimension, None)
    covered = np.zeros(len(mesh.points), bool)
    for d, rows in parts.items():
        covered[rows] |= d > 0
    if whole:
        own = cells[cells_of(mesh, group)]
        covered[own] = True
    alone = group.nodes[~covered[group.nodes]]
    corner = np.zeros(len(mesh.points), bool)
    corner[cells[:, : kind.corners]] = True
    if any(parts) or whole or cells.shape[1] < mesh.cells.shape[1]:
        alone = alone[corner[alone]]  # other nodes come back with the parts around them
    if len(alone):
        parts[0] = alone[:, None]
    found = [
        (group.name, part_kind(d, rows.shape[1]), none, rows)
        for d, rows in sorted(parts.items())
        if len(rows)
    ]
    return [*found, (group.name, kind, none, own)] if whole and len(own) else found
