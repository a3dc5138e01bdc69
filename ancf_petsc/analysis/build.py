"""From a case to the model on every rank."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.analysis.file_order import FileOrder, file_order
from ancf_petsc.element.catalog import element
from ancf_petsc.input.load import Case
from ancf_petsc.kernel.choice import kernel_set
from ancf_petsc.model.body import Body
from ancf_petsc.model.frames import Frames
from ancf_petsc.model.load import Load
from ancf_petsc.model.model import Model
from ancf_petsc.parallel.exchange import agree, on_root
from ancf_petsc.parallel.numbering import Numbering, distribute, with_vectors
from ancf_petsc.parallel.root import FromRoot
from ancf_petsc.plan.curve import CurveChoice
from ancf_petsc.plan.loads import KINDS
from ancf_petsc.plan.materials import regions
from ancf_petsc.plan.plan import Plan, make_plan
from ancf_petsc.plan.ramps import Ramps
from ancf_petsc.plan.space import nearby_origin


@dataclass
class Built:
    """A model ready to be solved, and what the tables and files need."""

    model: Model
    order: FileOrder
    curve: CurveChoice | None
    notes: list[str]


def build(case: Case, comm: MPI.Comm) -> Built:
    """Read, check, distribute. Collective; an error on the root rank is raised on all."""
    plan = on_root(comm, lambda: make_plan(case))
    return build_from(case, plan, comm)


def build_from(
    case: Case, plan: Plan | None, comm: MPI.Comm, owners: Callable[[Plan], NDArray] | None = None
) -> Built:
    """Distribute a plan, which the root rank holds. owners: gives the rank of each node, where they are known. Collective."""
    root = FromRoot(comm, plan)
    body = _make_body(case, root, owners)
    rows = _Rows(root, body)
    frames = _frames(root, rows)
    model = Model(
        **vars(body),
        drive=rows(lambda plan: plan.supports.drive),
        frames=frames,
        drives=root.value(lambda plan: plan.supports.drives),
        loads=_loads(case, body, rows, frames),
        groups={
            name: np.flatnonzero(inside) for name, inside in rows.owned(lambda plan: plan.members).items()
        },
        means={name: _where_not_zero(all_) for name, all_ in rows.owned(lambda plan: plan.means).items()},
    )
    return Built(
        model=model,
        order=file_order(root, model),
        curve=root.value(lambda plan: plan.curve),
        notes=root.value(lambda plan: plan.mesh.notes),
    )


def _make_body(case: Case, root: FromRoot[Plan], owners: Callable[[Plan], NDArray] | None) -> Body:
    """Nodes and cells of this rank, its cells sorted by material, own ones first."""
    comm, spec, row = root.comm, case.spec, element(case.spec.mesh.element)
    nodes = distribute(
        comm,
        root.slab(lambda plan: plan.space.cells),
        root.value(lambda plan: len(plan.space.nodes)),
        None if owners is None else root.slab(owners),
    )
    first = root.rows(
        lambda plan: np.stack((plan.space.first[:-1], np.diff(plan.space.first)), axis=1), nodes.file_nodes
    )
    numbering = with_vectors(nodes, first, row.node, row.slot)
    numbering, material, cell_numbers = _sort_cells(root, numbering)
    slots = root.rows(lambda plan: plan.space.slots(), numbering.file_nodes)
    revolution = root.value(lambda plan: plan.revolution)
    origin = root.value(lambda plan: nearby_origin(plan.space.points, plan.mesh.size))
    if revolution is not None:
        origin[revolution.radial] = 0.0  # radii are positions
    reference = root.rows(lambda plan: plan.space.reference(), numbering.file_nodes)
    reference[slots == 0] -= origin
    axes, section = root.value(lambda plan: plan.space.axes), spec.section
    tables = agree(
        comm,
        lambda: kernel_set(row, axisymmetric=revolution is not None).cells(
            row,
            numbering.cells,
            reference,
            axes=axes,
            quadrature=spec.mesh.rule,
            thickness=(section.thickness or section.area or 1.0) if section else 1.0,
            numbers=cell_numbers,
            **({"revolution": revolution} if revolution else {}),
        ),
    )
    return Body(
        comm=comm,
        element=row,
        numbering=numbering,
        origin=origin,
        reference=reference,
        slots=slots,
        tables=tables,
        regions=regions(spec, row, material, numbering.own_cells),
        size=root.value(lambda plan: plan.mesh.size),
        cell_numbers=cell_numbers,
        lumped=spec.dynamics is not None and spec.dynamics.mass == "lumped",
        revolution=revolution,
    )


def _sort_cells(root: FromRoot[Plan], numbering: Numbering) -> tuple[Numbering, NDArray, NDArray]:
    """The cells sorted by material, own ones first, with their materials and numbers in the mesh file (e,)."""
    both = root.rows(
        lambda plan: np.stack((plan.material.astype(np.int64), plan.mesh.cell_numbers), axis=1),
        numbering.file_cells,
    )
    order = np.lexsort((np.arange(len(both)), ~numbering.own_cells, both[:, 0]))
    return numbering.with_cell_order(order), both[order, 0], both[order, 1]


class _Rows:
    """Rows of the plan's tables over nodal vectors for those of this rank. Calls are collective."""

    def __init__(self, root: FromRoot[Plan], body: Body) -> None:
        self.root, self.body = root, body

    def __call__(self, of: Callable[[Plan], NDArray]) -> NDArray:
        """(v, ...) of a table."""
        return self.root.rows(of, self.body.numbering.file_nodes)

    def owned(self, of: Callable[[Plan], dict]) -> dict:
        """The same for a dictionary of tables (v,), of owned nodal vectors (n,)."""
        names = self.root.value(lambda plan: list(of(plan)))
        if not names:
            return {}
        together = self(lambda plan: np.stack(list(of(plan).values()), axis=1))[: self.body.owned]
        return {name: np.ascontiguousarray(together[:, k]) for k, name in enumerate(names)}


def _frames(root: FromRoot[Plan], rows: _Rows) -> Frames:
    """Those of this rank's nodal vectors. Collective."""
    axes = root.value(lambda plan: plan.supports.axes)
    if not len(axes):
        return Frames(np.empty(0, np.int64), axes)
    frame = rows(lambda plan: plan.supports.frame)
    vectors = np.flatnonzero(frame >= 0)
    return Frames(vectors, axes[frame[vectors]])


def _loads(case: Case, body: Body, rows: _Rows, frames: Frames) -> list[Load]:
    """This rank's share of all loads, with components of unknowns."""
    entered = rows.owned(lambda plan: plan.loads)
    ramps = Ramps(case.spec, case.file)
    loads = [
        KINDS[spec.type].share(spec, body, entered.get(number), ramps.of_load(spec.ramp))
        for number, spec in enumerate(case.spec.load)
    ]
    for load in loads:
        frames.to_frames(load.pattern)
    return loads


def _where_not_zero(weights: NDArray) -> tuple[NDArray, NDArray]:
    places = np.flatnonzero(weights)
    return places, weights[places]
