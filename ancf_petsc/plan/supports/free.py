"""Refusing statics of bodies that supports leave free to move, whole or in pieces that share edges or corners only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.check import connected_pieces
from ancf_petsc.mesh.doubts import face_pieces
from ancf_petsc.plan.free_motion import free_motions
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.supports.joints import free_joints
from ancf_petsc.plan.supports.table import SupportTable


def refuse_free_motions(part: Part, table: SupportTable) -> None:
    """Raise CaseError if a connected piece of the body, or one that hangs on another by an edge, can move without deforming."""
    space = part.space
    pieces, label = connected_pieces(space.cells, len(space.nodes))
    driven, nodes, slopes = table.drive >= 0, space.node_of(), space.slots() > 0
    free = free_motions(
        space.reference(),
        driven,
        label[nodes],
        pieces,
        slopes=slopes,
        lacking=part.lacking,
        frames=(table.frame, table.axes),
    )
    if not free:
        _refuse_joints(part, table, pieces)
        return
    piece, names = next(iter(free.items()))
    where = ""
    if pieces > 1:
        where = (
            f" of the piece around {_place(space.points[label == piece])}, {len(free)} of {pieces} pieces,"
        )
    raise CaseError(
        f"the supports{where} leave rigid motions free: {'; '.join(names)}",
        file=part.file,
        key="constraint",
        expected="statics to have none",
        cure="add a [[constraint]] that holds them, or ask for [dynamics]",
    )


def _refuse_joints(part: Part, table: SupportTable, pieces: int) -> None:
    """The same for pieces that share edges or corners only: hinges and ball joints."""
    space = part.space
    if part.element.cell.dimension == 1:
        return
    count, of_cell = face_pieces(space.mesh)
    if count == pieces:
        return
    pairs = np.unique(space.cells.astype(np.int64) * count + of_cell[:, None])
    node, own = pairs // count, pairs % count
    sizes = np.diff(space.first)[node]
    vectors = np.repeat(space.first[node] - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
    belongs = np.stack([vectors, np.repeat(own, sizes)], axis=1)
    found = free_joints(
        space.reference(),
        table.drive >= 0,
        belongs,
        count,
        slopes=space.slots() > 0,
        lacking=part.lacking,
        frames=(table.frame, table.axes),
    )
    if found is None:
        return
    moves, names = found
    raise CaseError(
        f"{count} pieces of the body are joined by edges or corners only, and the piece around "
        f"{_place(space.points[node[own == moves]])} can move as on a hinge: {'; '.join(names)}",
        file=part.file,
        key="mesh.file",
        expected="pieces that share faces, or supports that hold each",
        cure="join the pieces in the mesh, add a [[constraint]] that holds the piece, or ask for [dynamics]",
    )


def _place(points: NDArray) -> str:
    return "(" + ", ".join(f"{c:.6g}" for c in points.mean(axis=0)) + ")"
