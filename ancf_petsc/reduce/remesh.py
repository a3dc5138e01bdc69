"""A mesh of what planes leave of a body, where they go through its cells: its boundary cut, closed and filled anew."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.kinds import KINDS, edge_lengths
from ancf_petsc.mesh.mesh import Group, Mesh
from ancf_petsc.reduce.caps import fill
from ancf_petsc.reduce.skin import clip, skin_of
from ancf_petsc.reduce.symmetry import MirrorPlane


def remeshed(mesh: Mesh, planes: Sequence[tuple[MirrorPlane, str]], file: Path | None) -> Mesh:
    """Tetrahedra of the part of a body on the side of the normals of planes; the cut by each is the group of its name.

    Facets of the boundary stay where no plane goes through them. Raises CaseError for bodies of bricks or of several materials.
    """
    if mesh.kind != "tetra":
        raise CaseError(
            "a plane of symmetry goes through elements, and new ones are tetrahedra",
            file=file,
            key="mesh.element",
            got=mesh.kind,
            expected="faces of elements on the plane",
            cure="mesh the body with an even number of elements across, or with tetrahedra",
        )
    partly = [
        group.name for group in mesh.groups.values() if 0 < len(group.parts.get(3, ())) < len(mesh.cells)
    ]
    if partly:
        raise CaseError(
            "a plane of symmetry goes through elements, and where new ones belong to groups of volume is not known",
            file=file,
            key="--to",
            got=partly[0],
            expected="faces of elements on the plane",
            cure="mesh the body in two halves",
        )
    _, longest = edge_lengths(mesh.points, mesh.cells, KINDS[mesh.kind])
    skin = skin_of(mesh)
    for plane, name in planes:
        skin = clip(skin, plane, name)
    points, cells = fill(skin.points, skin.facets, float(longest.max()), skin.volume)
    used = np.unique(cells)
    compact = np.zeros(len(points), np.int64)
    compact[used] = np.arange(len(used))
    groups = {
        name: Group(name, np.arange(len(used)), {3: compact[cells]})
        for name, g in mesh.groups.items()
        if 3 in g.parts
    }
    for name, inside in skin.faces.items():
        rows = compact[skin.facets[inside]]
        groups[name] = Group(name, np.unique(rows), {2: rows} if len(rows) else {})
    for name, lines in skin.lines.items():
        rows = compact[lines]
        known = groups.get(name, Group(name, rows[:0, 0]))
        groups[name] = Group(
            name, np.union1d(known.nodes, rows), {**known.parts, **({1: rows} if len(rows) else {})}
        )
    for name, nodes in skin.nodes.items():
        groups[name] = Group(name, np.unique(compact[nodes]), {0: np.unique(compact[nodes])[:, None]})
    for name in mesh.groups:
        groups.setdefault(name, Group(name, np.empty(0, np.int64)))
    return Mesh(
        points=points[used],
        kind="tetra",
        cells=compact[cells],
        groups=groups,
        node_numbers=1 + np.arange(len(used)),
        cell_numbers=1 + np.arange(len(cells)),
        used=np.ones(len(used), bool),
    )
