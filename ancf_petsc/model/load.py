"""Dead loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.model.ramp import Ramp


@dataclass(frozen=True)
class Load:
    """pattern (v, 3): force on each owned nodal vector at full load; it follows the ramp.

    acceleration: of a gravity load, None for other forces.
    """

    pattern: NDArray[np.float64]
    ramp: Ramp
    acceleration: tuple[float, float, float] | None = None
