"""Ramps as tables of a deck, and sums of dead forces that follow several."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.model.ramp import CLOSE, Ramp

Floats = NDArray[np.float64]
SAMPLES = 100
"""Rows of a curved ramp between 0 and 1; outputs are rows as well, so that what is compared follows the ramp itself."""
SAME = 1e-12
"""Shares of two ramps in a force are the same at two nodes when they differ by less than this part of the largest."""


def table(ramp: Ramp, outputs: Iterable[float]) -> Floats:
    """Rows (k, 2) of pseudo-time and factor, straight between which the ramp runs (a curved one nearly)."""
    times = {0.0, 1.0, *ramp.corners()}
    if ramp.kind == "cosine":
        exact = np.array([*times, *outputs])
        samples = np.linspace(0, 1, SAMPLES + 1)
        apart = np.abs(samples[:, None] - exact).min(axis=1) > CLOSE
        times |= {*samples[apart].tolist(), *outputs}
    rows = sorted(times)
    return np.array([(s, ramp.value(s)) for s in rows])


class Amplitudes:
    """Collects the tables a deck needs, each under one name."""

    def __init__(self, outputs: Iterable[float]) -> None:
        self.outputs = tuple(outputs)
        self.tables: dict[str, Floats] = {}

    def name(self, ramp: Ramp) -> str:
        """The name of a ramp's table."""
        return self._enter(table(ramp, self.outputs))

    def name_of_sum(self, ramps: list[Ramp], shares: Floats) -> str:
        """The name of the table of a sum of ramps, each with its share (r,)."""
        tables = [table(ramp, self.outputs) for ramp in ramps]
        times = np.unique(np.concatenate([rows[:, 0] for rows in tables]))
        factors = sum(share * np.interp(times, *rows.T) for share, rows in zip(shares, tables, strict=True))
        return self._enter(np.column_stack((times, factors)))

    def _enter(self, rows: Floats) -> str:
        for name, known in self.tables.items():
            if np.array_equal(known, rows):
                return name
        name = f"RAMP_{len(self.tables) + 1}"
        self.tables[name] = rows
        return name


def grouped(forces: Floats) -> list[tuple[Floats, NDArray[np.int64], NDArray[np.int64], Floats]]:
    """Forces (n, 3, r) on nodes by component and ramp, sorted by the shares of the ramps in them.

    Returns for each sort: shares (r,) whose largest magnitude is 1, nodes (k,), components (k,), magnitudes (k,).
    """
    nodes, components = np.nonzero(forces.any(axis=2))
    rows = forces[nodes, components]
    if not len(rows):
        return []
    places = np.abs(rows).argmax(axis=1)
    magnitudes = rows[np.arange(len(rows)), places]
    shares = np.round(rows / magnitudes[:, None] / SAME) * SAME
    kinds, which = np.unique(shares, axis=0, return_inverse=True)
    which = which.reshape(-1)
    return [
        (kind, nodes[which == k], components[which == k], magnitudes[which == k])
        for k, kind in enumerate(kinds)
    ]
