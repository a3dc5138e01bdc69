"""Rigid motions that supports leave to a body in statics: an error that names them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.check import connected_pieces
from ancf_petsc.mesh.doubts import face_pieces
from ancf_petsc.model.constraint import ConstraintTable
from ancf_petsc.plan.free_motion import free_motions
from ancf_petsc.plan.mechanism import free_joints
from ancf_petsc.plan.space import Space


def refuse_free_motions(
    space: Space, constraints: ConstraintTable, normal: int | None, file: Path | None
) -> None:
    """Raise CaseError if a connected piece of the body, or one that hangs on another by an edge, can move without deforming."""
    pieces, label = connected_pieces(space.cells, len(space.nodes))
    driven, nodes, slopes = constraints.motion >= 0, space.node_of(), space.slots() > 0
    free = free_motions(space.reference(), driven, label[nodes], pieces, slopes=slopes, normal=normal)
    if free:
        piece, names = next(iter(free.items()))
        where = ""
        if pieces > 1:
            where = f" of the piece around {_place(space.points[label == piece])}, {len(free)} of {pieces} pieces,"
        raise CaseError(
            f"the supports{where} leave rigid motions free: {'; '.join(names)}",
            file=file,
            key="constraint",
            expected="statics to have none",
            cure="add a [[constraint]] that holds them, or ask for [dynamics]",
        )
    _refuse_joints(space, driven, slopes, pieces, normal, file)


def _refuse_joints(
    space: Space, driven: NDArray, slopes: NDArray, pieces: int, normal: int | None, file: Path | None
) -> None:
    """The same for pieces that share edges or corners only: hinges and ball joints."""
    parts, of_cell = face_pieces(space.mesh)
    if space.element.cell.dimension == 1 or parts == pieces:
        return
    pairs = np.unique(space.cells.astype(np.int64) * parts + of_cell[:, None])
    node, part = pairs // parts, pairs % parts
    sizes = np.diff(space.first)[node]
    vectors = np.repeat(space.first[node] - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
    belongs = np.stack([vectors, np.repeat(part, sizes)], axis=1)
    found = free_joints(space.reference(), driven, belongs, parts, slopes=slopes, normal=normal)
    if found is None:
        return
    moves, names = found
    raise CaseError(
        f"{parts} pieces of the body are joined by edges or corners only, and the piece around "
        f"{_place(space.points[node[part == moves]])} can move as on a hinge: {'; '.join(names)}",
        file=file,
        key="mesh.file",
        expected="pieces that share faces, or supports that hold each",
        cure="join the pieces in the mesh, add a [[constraint]] that holds the piece, or ask for [dynamics]",
    )


def _place(points: NDArray) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in points.mean(axis=0)) + ")"
