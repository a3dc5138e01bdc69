"""What the tables say of a state: reactions, strokes, mean stresses, energies, probes. All functions are collective."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import combined


def reaction(assembly: Assembly, out_of_balance: NDArray, group: str) -> NDArray[np.float64]:
    """Sum (3,) over the group's nodes of Q - Q_e: what the support exerts on the body."""
    own = assembly.along_axes(out_of_balance)[assembly.model.groups[group]].sum(axis=0)
    return combined(assembly.comm, own)


def mean_position(assembly: Assembly, x: PETSc.Vec, name: str) -> tuple[NDArray, NDArray]:
    """Weighted mean position (3,) of a group's nodes, in the file's coordinates, and its displacement (3,)."""
    vectors, weights = assembly.model.means[name]
    now = weights @ assembly.along_axes(x.array_r.reshape(-1, 3))[vectors]
    before = weights @ assembly.model.reference[vectors]
    now, before = combined(assembly.comm, np.stack((now, before)))
    return now + assembly.model.origin, now - before


def mean_stress(assembly: Assembly, cauchy: NDArray, group: str, axis: int) -> float:
    """Cauchy stress (axis, axis), averaged to nodes by undeformed volume, mean over the group's nodes.

    Around a body of revolution a node stands for a ring, and counts as its undeformed radius.
    """
    model = assembly.model
    a = model.cells.shape[1]
    weight = np.repeat(model.volumes, a)
    stress = np.repeat(model.volumes * cauchy[:, 4 * axis], a)
    n = len(model.reference)
    volumes = np.bincount(model.cells.ravel(), weight, minlength=n)
    sums = np.bincount(model.cells.ravel(), stress, minlength=n)
    nodes = model.groups[group]
    counts = np.ones(len(nodes))
    if model.revolution is not None:  # whose radii have the file's origin
        counts = model.reference[nodes, model.revolution.radial]
    own = np.array([counts @ (sums[nodes] / volumes[nodes]), counts.sum()])
    total, count = combined(assembly.comm, own)
    return total / count if count else 0.0


def conjugates(assembly: Assembly, x: PETSc.Vec, out_of_balance: NDArray) -> tuple[NDArray, NDArray]:
    """What the work hangs on: the reaction of each drive (m,) and the displacement each load sees (l,)."""
    model = assembly.model
    values = out_of_balance.ravel()[assembly.driven]
    reactions = np.bincount(assembly.driven_by, values, minlength=len(model.drives))
    displacement = x.array_r.reshape(-1, 3) - assembly.start
    seen = np.array([float((load.pattern * displacement).sum()) for load in model.loads])
    both = combined(assembly.comm, np.concatenate((reactions, seen)))
    return both[: len(model.drives)], both[len(model.drives) :]


def von_mises(cauchy: NDArray) -> NDArray[np.float64]:
    """Von Mises stress (e,) from Cauchy stress (e, 9)."""
    xx, xy, xz, _, yy, yz, _, _, zz = cauchy.T
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(normal / 2 + 3 * (xy**2 + yz**2 + xz**2))
