"""Nodes an element has and its mesh lacks: middles of edges and centres of faces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ancf_petsc.element.element import Element
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Group, Integers, Mesh
from ancf_petsc.mesh.parts import row_keys, rows_in, unique_rows

MOVED = 1e-12
"""Mid-nodes closer to the middle of their edge than this times the mesh size stay where they are."""

SHOWN = 8
"""Groups named in a note."""


def complete(mesh: Mesh, element: Element) -> None:
    """Give every cell all nodes of the element, corners first, and enter new nodes into the groups.

    Nodes the mesh has are moved to the mean of their corners. `mesh.kind` is the kind of the corners afterwards.
    """
    cells = mesh.cells
    mesh.kind = KINDS[mesh.kind].linear or mesh.kind
    if cells.shape[1] > KINDS[mesh.kind].nodes:
        straighten(mesh, [node.corners for node in element.nodes if len(node.corners) > 1])
        _complete_groups(mesh, element)
        return
    by_corners: dict[int, list[tuple[int, ...]]] = {}
    for node in element.nodes:
        by_corners.setdefault(len(node.corners), []).append(node.corners)
    for size, places in sorted(by_corners.items()):
        if size > 1:
            _add_nodes(mesh, cells, np.array(places))


def straighten(mesh: Mesh, corners: Sequence[tuple[int, ...]]) -> None:
    """Move nodes onto the middle of their edge: those after the corners of cells, whose edges have
    these corners."""
    largest, count = 0.0, 0
    first = KINDS[KINDS[mesh.kind].linear or mesh.kind].nodes
    for place, around in enumerate(corners, start=first):
        nodes = mesh.cells[:, place]
        middle = mesh.points[mesh.cells[:, around]].mean(axis=1)
        off = np.linalg.norm(mesh.points[nodes] - middle, axis=1)
        moved = off > MOVED * mesh.size
        largest, count = max(largest, off.max()), count + len(np.unique(nodes[moved]))
        mesh.points[nodes[moved]] = middle[moved]
    if count:
        mesh.notes.append(
            f"{count} mid-nodes lay off the middle of their edge, by up to {largest:.3g}: moved onto it"
        )


def _complete_groups(mesh: Mesh, element: Element) -> None:
    """Enter the mid-nodes that the mesh has into groups of linear parts, and into sets of corners alone."""
    corner = np.zeros(len(mesh.points), bool)
    corner[mesh.cells[:, : KINDS[mesh.kind].nodes]] = True
    groups = {
        name: group
        for name, group in mesh.groups.items()
        if (group.parts or len(group.nodes) > 1) and (group.parts or corner[group.nodes].all())
    }
    by_corners: dict[int, list[int]] = {}
    for place, node in enumerate(element.nodes):
        by_corners.setdefault(len(node.corners), []).append(place)
    for size, places in by_corners.items():
        if size == 1:
            continue
        nodes = mesh.cells[:, places].ravel()
        around = np.array([element.nodes[place].corners for place in places])
        corners = mesh.cells[:, around].reshape(-1, size)
        for name in groups:
            mesh.groups[name] = _with_new_nodes(mesh, mesh.groups[name], corners, nodes)
    more = {name: len(mesh.groups[name].nodes) - len(group.nodes) for name, group in groups.items()}
    completed = [f"{name} by {count}" for name, count in more.items() if count]
    if completed:
        listing = ", ".join(completed[:SHOWN])
        others = f" and {len(completed) - SHOWN} groups more" if len(completed) > SHOWN else ""
        mesh.notes.append(
            f"groups that lack the nodes between their corners are completed: {listing} nodes{others}"
        )


def _add_nodes(mesh: Mesh, cells: Integers, places: Integers) -> None:
    """A node at the mean of every edge or face: places (k, corners) of each cell."""
    every = cells[:, places].reshape(-1, places.shape[1])
    _, first, which = np.unique(row_keys(every, len(mesh.points)), return_index=True, return_inverse=True)
    corners = every[first]
    old, highest = len(mesh.points), mesh.node_numbers.max()
    new = old + np.arange(len(corners))
    groups = {name: _with_new_nodes(mesh, group, corners, new) for name, group in mesh.groups.items()}
    mesh.points = np.concatenate((mesh.points, mesh.points[corners].mean(axis=1)))
    mesh.node_numbers = np.concatenate((mesh.node_numbers, highest + 1 + np.arange(len(corners))))
    mesh.used = np.concatenate((mesh.used, np.ones(len(corners), bool)))
    mesh.cells = np.hstack((mesh.cells, new[which].reshape(len(cells), -1)))
    mesh.groups = groups
    what = {2: "middles of edges"}.get(places.shape[1], "centres of faces")
    mesh.notes.append(
        f"{len(corners)} nodes added at {what}, numbered from {highest + 1}: the mesh file lacks them and the element needs them"
    )


def _with_new_nodes(mesh: Mesh, group: Group, corners: Integers, new: Integers) -> Group:
    """A group with the new nodes (m,) whose corners (m, k) are those of one of its parts, or all in a set of nodes."""
    inside = np.zeros(len(mesh.points), bool)
    inside[group.nodes] = True
    candidates = np.flatnonzero(inside[corners].all(axis=1))
    if group.parts:
        wanted = [
            rows
            for dimension, parts in group.parts.items()
            if len(rows := _faces_of(parts, dimension, corners.shape[1]))
        ]
        bound = len(mesh.points)
        known = (
            unique_rows(np.concatenate(wanted), bound)
            if wanted
            else np.empty((0, corners.shape[1]), np.int64)
        )
        candidates = candidates[rows_in(corners[candidates], known, bound) >= 0]
    return replace(group, nodes=np.union1d(group.nodes, new[candidates]))


def _faces_of(parts: Integers, dimension: int, corners: int) -> Integers:
    """Edges or faces (m, corners) of parts of a dimension."""
    kind = next(
        k for k in KINDS.values() if (k.dimension, k.nodes) == (dimension, parts.shape[1]) and not k.linear
    )
    if kind.nodes == corners:
        return parts
    places = {2: kind.edges}.get(corners, kind.sides if dimension == 3 else ())
    return parts[:, np.array(places)].reshape(-1, corners) if places else parts[:0, :0]
