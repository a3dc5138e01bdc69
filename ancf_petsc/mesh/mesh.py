"""What a mesh is to this program: points, the cells of the body, named groups."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """A named set of nodes and the parts it is meshed with.

    nodes: (k,) ascending indices of points, mid-nodes of quadratic parts included.
    parts: dimension (0 point, 1 line, 2 face, 3 volume) -> (m, corners) indices of points, each part
        once. Empty for a group that is only a set of nodes.
    cells: (m,) indices of the cells the name stands for where a material is given to it, if those are not its parts.
    """

    name: str
    nodes: Integers
    parts: dict[int, Integers] = field(default_factory=dict)
    cells: Integers | None = None


@dataclass
class Mesh:
    """A mesh of one kind of cell.

    points: (n, 3) in the unit of length of the case.
    kind: meshio's name of the body's cells: "tetra", "tetra10", "hexahedron", "quad", "line".
    cells: (e, k) indices of points, positively oriented.
    groups: name -> Group, from the file and, once chosen, from the case.
    node_numbers, cell_numbers: (n,), (e,) numbers in the file, ascending. Results use this order.
    used: (n,) whether a cell uses the point.
    boundary: (m, corners) sides of one cell only; `groups.boundary_faces` finds them when first asked.
    notes: what the reader did or noticed, for the log.
    refused: names of the file that cannot be used as groups -> why.
    """

    points: Floats
    kind: str
    cells: Integers
    groups: dict[str, Group]
    node_numbers: Integers
    cell_numbers: Integers
    used: NDArray[np.bool_]
    notes: list[str] = field(default_factory=list)
    source: str = ""
    boundary: Integers | None = field(default=None, repr=False)
    refused: dict[str, str] = field(default_factory=dict)

    @property
    def size(self) -> float:
        """Diagonal of the box around the nodes in use: the length all tolerances refer to."""
        points = self.points[self.used]
        return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
