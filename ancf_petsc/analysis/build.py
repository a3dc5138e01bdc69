"""From the root rank's plan to the model on every rank."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.element.catalog import element
from ancf_petsc.element.element import Element
from ancf_petsc.input.load import Case
from ancf_petsc.input.schema import CaseSpec, ForceSpec, MaterialSpec
from ancf_petsc.kernel.choice import way_of
from ancf_petsc.material import Law, law_named
from ancf_petsc.material.models import plane_stress
from ancf_petsc.mesh.drawing import draw_cells
from ancf_petsc.model.load import Load
from ancf_petsc.model.measures import CurveChoice
from ancf_petsc.model.model import Model, Region, local_rows
from ancf_petsc.model.ramp import make_ramp
from ancf_petsc.parallel.exchange import agree, lookup, on_root, scatter_rows
from ancf_petsc.parallel.numbering import Numbering, distribute, with_vectors
from ancf_petsc.parallel.slabs import slab_bounds
from ancf_petsc.plan.plan import Plan, make_plan


@dataclass
class FileOrder:
    """This rank's slabs of the drawn mesh in the file's order, for results; middles of curved edges come after the nodes.

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


def build_from(case: Case, plan: Plan | None, comm: MPI.Comm) -> Built:
    """Distribute a plan, which the root rank holds. Collective."""
    row = element(case.spec.mesh.element)
    space = plan.space if plan else None
    nodes = distribute(
        comm,
        scatter_rows(comm, space.cells if space else None),
        comm.bcast(len(space.nodes) if space else None),
    )
    numbering = with_vectors(nodes, space.first if space else None, row.node, row.slot)
    rows = _Rows(numbering, comm.bcast(space.vectors if space else None))
    model = Model(
        comm=comm,
        element=row,
        numbering=numbering,
        owned=numbering.owned,
        start=int(numbering.numbers[0]) if numbering.owned else 0,
        ghost_numbers=numbering.numbers[numbering.owned :],
        reference=rows(space.reference() if space else None),
        slots=rows(space.slots() if space else None),
        tables=(),
        regions=[],
        drive=rows(plan.constraints.drive if plan else None),
        drives=comm.bcast(plan.constraints.drives if plan else None),
        size=comm.bcast(plan.mesh.size if plan else None),
        cell_numbers=np.empty(0, np.int64),
    )
    _enter_cells(case, plan, model)
    _enter_groups(plan, rows, model)
    _enter_loads(case, plan, rows, model)
    return Built(
        model=model,
        order=_file_order(plan, rows, model),
        curve=comm.bcast(plan.curve if plan else None),
        notes=comm.bcast(plan.mesh.notes if plan else None),
    )


class _Rows:
    """Rows of the root rank's tables over nodal vectors for those of this rank."""

    def __init__(self, numbering: Numbering, total: int) -> None:
        self.numbering = numbering
        self.total = total

    def __call__(self, table: NDArray | None) -> NDArray:
        return local_rows(self.numbering, table, self.total)

    def columns(self, tables: dict | None) -> dict:
        """The same for a dictionary of tables (v,)."""
        comm = self.numbering.comm
        names = comm.bcast(list(tables) if tables is not None else None)
        if not names:
            return {}
        together = self(np.stack(list(tables.values()), axis=1) if tables is not None else None)
        return {name: np.ascontiguousarray(together[:, k]) for k, name in enumerate(names)}


def _enter_cells(case: Case, plan: Plan | None, model: Model) -> None:
    """Sort this rank's cells by material, own ones first, and make the element tables and regions."""
    comm, numbering, spec = model.comm, model.numbering, case.spec
    both = (
        None if plan is None else np.stack((plan.material.astype(np.int64), plan.mesh.cell_numbers), axis=1)
    )
    attributes = _of_cells(comm, both, numbering)
    order = np.lexsort((np.arange(len(attributes)), ~numbering.own_cells, attributes[:, 0]))
    numbering = numbering.with_cell_order(order)
    model.numbering, model.cell_numbers = numbering, attributes[order, 1]
    material = attributes[order, 0]
    way, section = way_of(model.element), spec.section
    axes = comm.bcast(plan.space.axes if plan else None)
    model.tables = agree(
        comm,
        lambda: way.tables(
            model.element,
            numbering.cells,
            model.reference,
            axes=axes,
            quadrature=spec.mesh.rule,
            thickness=(section.thickness or section.area or 1.0) if section else 1.0,
            numbers=model.cell_numbers,
        ),
    )
    for number, given in enumerate(spec.material):
        first, last = np.searchsorted(material, (number, number + 1))
        law = law_named(given.law)
        model.regions.append(
            Region(
                law=law,
                kernels=way.kernels(law),
                mean_kernels=way.mean_kernels(law) if law.mean_stress else None,
                parameters=_parameters(model.element, law, given, spec),
                density=given.density,
                first=int(first),
                own_last=int(first + numbering.own_cells[first:last].sum()),
                last=int(last),
            )
        )


def _of_cells(comm: MPI.Comm, table: NDArray | None, numbering: Numbering) -> NDArray:
    """Rows of a table over all cells, which the root rank holds, for the cells of this rank. Collective."""
    total = comm.bcast(None if table is None else len(table))
    return lookup(comm, slab_bounds(total, comm.size), scatter_rows(comm, table), numbering.file_cells)


def _parameters(row: Element, law: Law, material: MaterialSpec, spec: CaseSpec) -> NDArray[np.float64]:
    """Of the law in the body's state: in space, in plane strain or stress, in a beam."""
    section = spec.section
    if row.is_beam and section:
        assert section.inertia
        assert section.area
        return material.young * np.array([1.0, section.inertia / section.area])
    parameters = law.parameters(material.young, material.poisson)
    return plane_stress(parameters) if section and section.plane == "stress" else parameters


def _enter_groups(plan: Plan | None, rows: _Rows, model: Model) -> None:
    """Nodes of the groups and weights of the means that this rank owns."""
    n = model.owned
    for name, inside in rows.columns(plan.members if plan else None).items():
        model.groups[name] = np.flatnonzero(inside[:n])
    for name, weights in rows.columns(plan.means if plan else None).items():
        vectors = np.flatnonzero(weights[:n])
        model.means[name] = (vectors, weights[vectors])


def _enter_loads(case: Case, plan: Plan | None, rows: _Rows, model: Model) -> None:
    """Patterns of all loads on owned nodes."""
    shares = rows.columns(plan.shares if plan else None)
    default = "linear" if case.spec.statics else "constant"
    for number, spec in enumerate(case.spec.load):
        ramp = make_ramp(spec.ramp, default)
        if isinstance(spec, ForceSpec):
            pattern = np.outer(shares[number][: model.owned], spec.total)
            model.loads.append(Load(pattern, ramp))
        else:
            pattern = np.outer(nodal_mass(model), spec.acceleration)
            model.loads.append(Load(pattern, ramp, spec.acceleration))


def nodal_mass(model: Model) -> NDArray[np.float64]:
    """∫ rho N_a dV (v,) of the owned nodal vectors."""
    density = np.empty(len(model.cells))
    for region in model.regions:
        density[region.first : region.last] = region.density or 0.0
    tables = model.element.tables("mass")
    means = model.turned(tables.weights @ tables.values / tables.weights.sum())
    share = (density * model.volumes)[:, None] * means
    sums = np.bincount(model.cells.ravel(), share.ravel(), minlength=len(model.reference))
    return sums[: model.owned].astype(float)


def _file_order(plan: Plan | None, rows: _Rows, model: Model) -> FileOrder:
    """Slabs of the mesh as the file has it, nodes no element uses included."""
    comm, mesh = model.comm, plan.mesh if plan else None
    drawing = draw_cells(mesh, plan.element) if mesh and plan else None
    groups = {name: group.nodes for name, group in mesh.groups.items()} if mesh else {}
    places = np.full((len(model.cells), 0), -1)
    if comm.bcast(drawing is not None and drawing.middles is not None):
        places = _of_cells(comm, drawing.middles if drawing else None, model.numbering)
        places[~model.numbering.own_cells] = -1
    middles = np.argwhere(places >= 0)
    nodes = plan.space.nodes[plan.space.node_of()] if plan else None
    numbers = None
    if mesh and drawing:
        more = len(drawing.points) - len(mesh.points)
        numbers = np.concatenate((mesh.node_numbers, mesh.node_numbers.max() + 1 + np.arange(more)))
    return FileOrder(
        points=scatter_rows(comm, drawing.points if drawing else None),
        cells=scatter_rows(comm, drawing.cells if drawing else None),
        node_numbers=scatter_rows(comm, numbers),
        cell_numbers=scatter_rows(comm, mesh.cell_numbers if mesh else None),
        total_nodes=comm.bcast(len(mesh.points) if mesh else None),
        total_points=comm.bcast(len(drawing.points) if drawing else None),
        total_cells=comm.bcast(len(mesh.cells) if mesh else None),
        node_rows=rows(nodes)[model.own_positions],
        middles=middles,
        middle_rows=places[middles[:, 0], middles[:, 1]],
        kind=comm.bcast(drawing.kind if drawing else None),
        groups=groups,
    )
