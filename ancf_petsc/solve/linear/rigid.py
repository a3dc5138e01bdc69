"""Rigid motions of a state, for multigrid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.model.model import Model
from ancf_petsc.parallel.exchange import combined


def rigid_motions(model: Model, positions: NDArray) -> NDArray[np.float64]:
    """Orthonormal rigid motions (k, n, 3) of the unknowns of owned nodal vectors, whose values along the axes are positions (n, 3):
    translations move positions, rotations turn slopes too.

    They vanish where supports hold: what multigrid takes from its coarse levels then leaves driven degrees of freedom alone.
    Motions out of the plane of a plane body, where a component is held everywhere, are left out. Collective.
    """
    own = model.own_positions
    count = combined(model.comm, len(own))
    centre = combined(model.comm, positions[own].sum(axis=0)) / count
    undriven = model.drive[: model.owned] < 0
    free = combined(model.comm, undriven.sum(axis=0)) > 0
    arms = positions / model.size
    arms[own] -= centre / model.size
    modes = np.zeros((6, model.owned, 3))
    for i, axis in enumerate(np.eye(3)):
        modes[i, own] = axis
        modes[3 + i] = np.cross(axis, arms)
        for mode in (modes[i], modes[3 + i]):
            model.frames.to_frames(mode)
    kept = np.concatenate((free, [free[[1, 2]].all(), free[[0, 2]].all(), free[[0, 1]].all()]))
    modes = (modes[kept] * undriven).reshape(int(kept.sum()), -1)
    for _ in range(2):
        gram = combined(model.comm, modes @ modes.T)
        values, vectors = np.linalg.eigh(gram)
        good = values > 1e-14 * values[-1]
        modes = (vectors[:, good] / np.sqrt(values[good])).T @ modes
    return modes.reshape(len(modes), model.owned, 3)
