"""The mesh as its file has it, in slabs: the order of all results, whatever the number of ranks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.mesh.drawing import Drawing, draw_cells
from ancf_petsc.model.model import Model
from ancf_petsc.parallel.root import FromRoot
from ancf_petsc.plan.plan import Plan


@dataclass
class FileOrder:
    """This rank's slabs of the mesh of the results in the file's order; middles of curved edges come after the nodes.

    node_rows (n,): row of each owned position. middles (k, 2): cell and edge whose middle this rank places, middle_rows (k,)
    its row. total_points: nodes and middles.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    node_numbers: NDArray[np.int64]
    cell_numbers: NDArray[np.int64]
    total_nodes: int
    total_points: int
    total_cells: int
    node_rows: NDArray[np.int64]
    middles: NDArray[np.int64]
    middle_rows: NDArray[np.int64]
    kind: str
    groups: dict[str, NDArray[np.int64]]


@dataclass
class _Drawn:
    """On the root rank: what is planned, and how its cells are drawn."""

    plan: Plan
    drawing: Drawing

    def middles(self) -> NDArray[np.int64]:
        """(e, edges) of a drawing that has some."""
        assert self.drawing.middles is not None
        return self.drawing.middles

    def node_numbers(self) -> NDArray[np.int64]:
        """(m,) of all points: new ones for middles of edges."""
        numbers = self.plan.mesh.node_numbers
        more = len(self.drawing.points) - len(self.plan.mesh.points)
        return np.concatenate((numbers, numbers.max() + 1 + np.arange(more)))


def file_order(plan: FromRoot[Plan], model: Model) -> FileOrder:
    """Slabs of the mesh as the file has it, nodes no element uses included. Collective."""
    root = plan.derived(lambda plan: _Drawn(plan, draw_cells(plan.mesh, plan.element)))
    places = np.full((len(model.cells), 0), -1)
    if root.value(lambda drawn: drawn.drawing.middles is not None):
        places = root.rows(lambda drawn: drawn.middles(), model.numbering.file_cells)
        places[~model.numbering.own_cells] = -1
    middles = np.argwhere(places >= 0)
    nodes = plan.rows(lambda plan: plan.space.nodes[plan.space.node_of()], model.numbering.file_nodes)
    return FileOrder(
        points=root.slab(lambda drawn: drawn.drawing.points),
        cells=root.slab(lambda drawn: drawn.drawing.cells),
        node_numbers=root.slab(lambda drawn: drawn.node_numbers()),
        cell_numbers=plan.slab(lambda plan: plan.mesh.cell_numbers),
        total_nodes=plan.value(lambda plan: len(plan.mesh.points)),
        total_points=root.value(lambda drawn: len(drawn.drawing.points)),
        total_cells=plan.value(lambda plan: len(plan.mesh.cells)),
        node_rows=nodes[model.own_positions],
        middles=middles,
        middle_rows=places[middles[:, 0], middles[:, 1]],
        kind=root.value(lambda drawn: drawn.drawing.kind),
        groups=plan.local(lambda plan: {name: group.nodes for name, group in plan.mesh.groups.items()}, {}),
    )
