"""A mesh as its file has it, before anything is checked: what readers hand to `assemble`."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.mesh import Floats, Integers


@dataclass(frozen=True)
class Block:
    """Cells of one kind that belong to the same groups.

    kind: meshio's name. numbers: (m,) in the file. nodes: (m, k) node numbers of the file.
    """

    kind: str
    numbers: Integers
    nodes: Integers
    names: tuple[str, ...] = ()


@dataclass
class RawMesh:
    """Everything a file says, in any order.

    node_numbers: (n,), points: (n, 3).
    names: groups the file speaks of, in its order, also those without a cell.
    node_sets: name -> node numbers, groups without parts.
    materials: names of sets of cells that name materials only where a node set or a surface has the name too.
    notes: what the reader noticed, for the log.
    refused: names that cannot be used as groups -> why; boundary_only: groups whose parts must be on the boundary.
    """

    node_numbers: Integers
    points: Floats
    blocks: list[Block]
    names: list[str] = field(default_factory=list)
    node_sets: dict[str, Integers] = field(default_factory=dict)
    materials: set[str] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    boundary_only: set[str] = field(default_factory=set)


def mesh_error(path: str | Path) -> partial[MeshError]:
    """Makes errors about the mesh file `path`."""
    return partial(MeshError, file=str(path), key="mesh.file")
