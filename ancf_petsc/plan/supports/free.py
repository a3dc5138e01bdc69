"""Refusing statics of bodies that supports leave free to move."""

from __future__ import annotations

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.check import connected_pieces
from ancf_petsc.plan.free_motion import free_motions
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.supports.table import SupportTable


def refuse_free_motions(part: Part, table: SupportTable) -> None:
    """Raise CaseError if a connected piece of the body can move without deforming."""
    space = part.space
    pieces, label = connected_pieces(space.cells, len(space.nodes))
    points, driven, nodes = space.points, table.drive >= 0, space.node_of()
    free = free_motions(
        space.reference(), driven, label[nodes], pieces, slopes=space.slots() > 0, normal=part.normal
    )
    if not free:
        return
    piece, names = next(iter(free.items()))
    where = ""
    if pieces > 1:
        centre = ", ".join(f"{c:.6g}" for c in points[label == piece].mean(axis=0))
        where = f" of the piece around ({centre}), {len(free)} of {pieces} pieces,"
    raise CaseError(
        f"the supports{where} leave rigid motions free: {'; '.join(names)}",
        file=part.file,
        key="constraint",
        expected="statics to have none",
        cure="add a [[constraint]] that holds them, or ask for [dynamics]",
    )
