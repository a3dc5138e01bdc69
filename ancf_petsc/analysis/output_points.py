"""Fields on nodal vectors as fields on the points of the results, in the file's order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.analysis.file_order import FileOrder
from ancf_petsc.kernel.tables import map_functions
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.parallel.exchange import ToSlabs

Floats = NDArray[np.float64]


class OutputPoints:
    """Points of the results: nodes and, where edges are curved, their middles. Calls are collective."""

    def __init__(self, assembly: Assembly, order: FileOrder) -> None:
        self.assembly, self.order = assembly, order
        self._own = assembly.model.own_positions
        self._to_file = ToSlabs(
            assembly.comm, np.concatenate((order.node_rows, order.middle_rows)), order.total_points
        )
        cells, edges = order.middles.T
        row, maps = assembly.model.element, assembly.model.slope_maps
        corners = np.array(row.cell.corners, dtype=float)
        values = row.values(corners[np.array(row.cell.edges)].mean(axis=1))
        self._vectors = assembly.model.cells[cells]
        self._weights = map_functions(values[edges], maps[cells], row)

    def __call__(self, field: Floats) -> Floats:
        """A field (n, 3) on owned nodal vectors, as positions are, on this rank's slab of the points (m, 3)."""
        local = self.assembly.with_ghosts(field, np.empty_like(self.assembly.model.reference))
        middles = np.einsum("pa,pai->pi", self._weights, local[self._vectors])
        return self._slab(np.concatenate((field[self._own], middles)))

    def slopes(self, field: Floats) -> Floats:
        """Slopes dr_i/dX_j (m, 9) of nodal vectors (n, 3), zero where a point is no node with slopes."""
        model, d = self.assembly.model, self.assembly.model.element.cell.dimension
        found = np.zeros((len(self._own) + len(self._weights), 3, 3))
        with_slopes = np.flatnonzero(np.diff(np.append(self._own, model.owned)) > 1)
        for j in range(1, d + 1):
            slope, unit = field[self._own[with_slopes] + j], model.reference[self._own[with_slopes] + j]
            square = np.einsum("ni,ni->n", unit, unit)
            found[with_slopes] += slope[:, :, None] * (unit / square[:, None])[:, None, :]
        return self._slab(found.reshape(len(found), 9))

    def _slab(self, rows: Floats) -> Floats:
        return self._to_file(rows, np.zeros((len(self.order.points), *rows.shape[1:])))
