"""Rigid motions that the supports leave free, piece by piece of the mesh, in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES


def free_motions(
    vectors: NDArray,
    driven: NDArray,
    piece: NDArray,
    pieces: int,
    *,
    slopes: NDArray | None = None,
    lacking: NDArray[np.bool_] | None = None,
    frames: tuple[NDArray, NDArray] | None = None,
) -> dict[int, list[str]]:
    """Names of the free rigid motions of each piece that has some.

    vectors (v, 3) undeformed positions and slopes, driven (v, 3) bool, piece (v,) label of each, -1 for those of no cell, slopes
    (v,) bool which are slopes, default none. A motion is free if it moves no driven degree of freedom: the null space of the
    6 x 6 Gram matrix of the motions at the driven degrees of freedom. Rotations are scaled by the size of the piece, slopes to
    length 1. lacking (6,): motions that are no rigid ones of the body, translations before rotations, such as those out of a plane.
    frames: index (v,) into axes (k, 3, 3), whose columns are the directions of a vector's degrees of freedom; -1: the axes.
    """
    slopes = np.zeros(len(vectors), bool) if slopes is None else slopes
    found = {}
    others = np.zeros(6) if lacking is None else lacking.astype(float)
    for label, gram, centre, size in _gram_matrices(vectors, driven, piece, pieces, slopes, frames):
        values, vectors = np.linalg.eigh(gram + np.diag(others))
        null = vectors[:, values <= 1e-12 * max(np.trace(gram), others.sum(), 1e-300)]
        if null.shape[1]:
            found[label] = motion_names(null, centre, size)
    return found


def directions(frames: tuple[NDArray, NDArray] | None, rows: NDArray, component: NDArray) -> NDArray:
    """Unit vectors (m, 3) along which components (m,) of nodal vectors (m,) are degrees of freedom."""
    found = np.eye(3)[component]
    if frames is not None and len(frames[1]):
        framed = frames[0][rows] >= 0
        found[framed] = frames[1][frames[0][rows[framed]], :, component[framed]]
    return found


def _gram_matrices(vectors, driven, piece, pieces, slopes, frames):
    """Label, Gram matrix, centre and size of each piece."""
    used = piece >= 0
    at = used & ~slopes
    count = np.bincount(piece[at], minlength=pieces)
    centre = np.stack([np.bincount(piece[at], vectors[at, i], pieces) for i in range(3)], 1) / count[:, None]
    arm = np.zeros_like(vectors)
    arm[at] = vectors[at] - centre[piece[at]]
    size = np.sqrt(np.bincount(piece[at], (arm[at] ** 2).sum(axis=1), pieces) / count)
    turning = used & slopes
    lengths = np.linalg.norm(vectors[turning], axis=1)
    arm[turning] = vectors[turning] * (size[piece[turning]] / lengths)[:, None]
    grams = np.zeros((pieces, 6, 6))
    for i in range(3):
        rows = np.flatnonzero(driven[:, i] & used)
        along = directions(frames, rows, np.full(len(rows), i))
        scaled = arm[rows] / size[piece[rows], None]
        modes = np.hstack((along * ~slopes[rows, None], np.cross(scaled, along)))
        np.add.at(grams, piece[rows], modes[:, :, None] * modes[:, None, :])
    return [(label, grams[label], centre[label], size[label]) for label in range(pieces)]


def motion_names(null: NDArray, centre: NDArray, size: float) -> list[str]:
    """Translations first, then rotations with a point of their axis. null (6, k)."""
    _, singular, basis = np.linalg.svd(null[3:])
    rank = int((singular > 1e-6).sum())
    translations = null[:3] @ basis[rank:].T
    names = [f"translation along {d}" for d in _directions(translations)]
    if rank == 3:
        return [*names, *(f"rotation about {axis}" for axis in AXES)]
    for mode in (null @ basis[:rank].T).T:
        axis = mode[3:] / np.linalg.norm(mode[3:])
        point = centre + np.cross(axis, mode[:3]) * size / np.linalg.norm(mode[3:])
        place = ", ".join(f"{c:.6g}" for c in np.where(np.abs(point) < 1e-9 * size, 0.0, point))
        names.append(f"rotation about the axis along {_direction(axis)} through ({place})")
    return names


def _directions(vectors: NDArray) -> list[str]:
    """Words for the space spanned by unit columns (3, k): the axes where they span it."""
    if vectors.shape[1] == 0:
        return []
    inside = [axis for i, axis in enumerate(AXES) if abs(np.linalg.norm(vectors[i]) - 1.0) < 1e-6]
    if len(inside) == vectors.shape[1]:
        return inside
    return [_direction(column) for column in vectors.T]


def _direction(vector: NDArray) -> str:
    largest = int(np.argmax(np.abs(vector)))
    if abs(abs(vector[largest]) - 1.0) < 1e-6:
        return AXES[largest]
    vector = vector * np.sign(vector[largest])
    return "(" + ", ".join(f"{c:.3f}" for c in vector) + ")"
