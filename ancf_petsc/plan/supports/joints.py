"""Rigid motions of pieces that share only edges or corners with each other: hinges and ball joints of the mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.plan.free_motion import directions, motion_names

MOST_PIECES = 200
"""More are not looked at: the matrix of their motions is full."""
NULL = 1e-12
"""Eigenvalues below this times the largest are zero."""


def free_joints(
    vectors: NDArray,
    driven: NDArray,
    belongs: NDArray,
    pieces: int,
    *,
    slopes: NDArray,
    lacking: NDArray | None = None,
    frames: tuple[NDArray, NDArray] | None = None,
) -> tuple[int, list[str]] | None:
    """The piece that can move most though joints and supports hold it, and the names of its motions; None where none can.

    vectors (v, 3) undeformed positions and slopes, driven (v, 3) bool, slopes (v,) bool which are slopes.
    belongs (m, 2): vector and piece, each pair once; a vector of several pieces joins them: it moves with all.
    lacking (6,), frames: as `free_motions` has them.
    """
    if pieces > MOST_PIECES:
        return None
    order = np.lexsort((belongs[:, 1], belongs[:, 0]))
    vector, piece = belongs[order].T
    at = ~slopes[vector]
    count = np.maximum(np.bincount(piece[at], minlength=pieces), 1)
    centre = (
        np.stack([np.bincount(piece[at], vectors[vector[at], i], pieces) for i in range(3)], 1)
        / count[:, None]
    )
    arm = np.where(at[:, None], vectors[vector] - centre[piece], 0.0)
    size = np.maximum(np.sqrt(np.bincount(piece, (arm**2).sum(axis=1), pieces) / count), 1e-300)
    turning = vectors[vector] / np.maximum(np.linalg.norm(vectors[vector], axis=1), 1e-300)[:, None]
    modes = _modes(np.where(at[:, None], arm / size[piece][:, None], turning), at)
    first = np.append(True, vector[1:] != vector[:-1])
    gram = np.zeros((6 * pieces, 6 * pieces))
    _add_supports(gram, modes[first], (driven, vector[first], frames), piece[first])
    _add_joints(gram, modes, piece, first)
    if lacking is not None:
        rows = (6 * np.arange(pieces)[:, None] + np.flatnonzero(lacking)).ravel()
        gram[rows, rows] += 1.0
    values, motions = np.linalg.eigh(gram)
    null = motions[:, values <= NULL * max(values[-1], 1e-300)].reshape(pieces, 6, -1)
    if not null.shape[2]:
        return None
    moves = int(np.linalg.norm(null, axis=(1, 2)).argmax())
    basis, singular, _ = np.linalg.svd(null[moves], full_matrices=False)
    return moves, motion_names(basis[:, singular > 1e-6], centre[moves], float(size[moves]))


def _modes(arm: NDArray, at: NDArray) -> NDArray:
    """(m, 3, 6) displacement of vectors by the translations and rotations of their piece; slopes only turn."""
    modes = np.zeros((len(arm), 3, 6))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        modes[at, i, i] = 1.0
        modes[:, i, 3 + j], modes[:, i, 3 + k] = arm[:, k], -arm[:, j]
    return modes


def _add_supports(gram: NDArray, modes: NDArray, supports: tuple, piece: NDArray) -> None:
    """A driven component does not move. supports: driven (v, 3), the vectors (m,) of modes (m, 3, 6), frames."""
    driven, vectors, frames = supports
    rows, component = np.nonzero(driven[vectors])
    held = np.einsum("mi,mij->mj", directions(frames, vectors[rows], component), modes[rows])
    blocks = np.zeros((len(gram) // 6, 6, 6))
    np.add.at(blocks, piece[rows], held[:, :, None] * held[:, None, :])
    for number, block in enumerate(blocks):
        gram[6 * number : 6 * number + 6, 6 * number : 6 * number + 6] += block


def _add_joints(gram: NDArray, modes: NDArray, piece: NDArray, first: NDArray) -> None:
    """A vector moves alike with the first of its pieces and with each other one."""
    owner = np.flatnonzero(first)[np.cumsum(first) - 1]
    joints = np.flatnonzero(~first)
    blocks: dict[tuple[int, int], NDArray] = {}
    for a, b in {(int(piece[owner[row]]), int(piece[row])) for row in joints}:
        rows = joints[(piece[owner[joints]] == a) & (piece[joints] == b)]
        relative = np.concatenate([modes[owner[rows]], -modes[rows]], axis=2).reshape(-1, 12)
        blocks[a, b] = relative.T @ relative
    for (a, b), block in blocks.items():
        rows = np.concatenate([6 * a + np.arange(6), 6 * b + np.arange(6)])
        gram[np.ix_(rows, rows)] += block
