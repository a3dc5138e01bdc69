"""Contiguous slabs: rank p holds rows bounds[p] to bounds[p + 1] of a global table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def slab_bounds(rows: int, ranks: int) -> NDArray[np.int64]:
    """Bounds (ranks + 1,) of slabs whose sizes differ by one at most."""
    return (np.arange(ranks + 1, dtype=np.int64) * rows) // ranks
