"""From the root rank's blueprint to the model on every rank."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ancf_petsc.case.blueprint import Blueprint, draw
from ancf_petsc.case.load import Case
from ancf_petsc.case.schema import ForceSpec
from ancf_petsc.kernel.tet3413 import geometry, make_kernels
from ancf_petsc.material import law_named
from ancf_petsc.parallel.exchange import lookup, on_root, scatter_rows
from ancf_petsc.parallel.numbering import Numbering, distribute
from ancf_petsc.parallel.slabs import slab_bounds
from ancf_petsc.system.load import Load
from ancf_petsc.system.measures import CurveChoice
from ancf_petsc.system.model import Model, Region, local_rows
from ancf_petsc.system.ramp import make_ramp


@dataclass
class FileOrder:
    """This rank's slabs of the mesh in the file's order, for results. nodes: index of each node in use."""

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    node_numbers: NDArray[np.int64]
    cell_numbers: NDArray[np.int64]
    total_nodes: int
    total_cells: int
    node_rows: NDArray[np.int64]
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
    blueprint = on_root(comm, lambda: draw(case))
    return build_from(case, blueprint, comm)


def build_from(case: Case, blueprint: Blueprint | None, comm: MPI.Comm) -> Built:
    """Distribute a blueprint, which the root rank holds. Collective."""
    plan = blueprint
    total = comm.bcast(len(plan.nodes) if plan else None)
    numbering = distribute(comm, scatter_rows(comm, plan.cells if plan else None), total)
    rows = _Rows(numbering, total)
    size = comm.bcast(plan.mesh.size if plan else None)
    model = Model(
        comm=comm,
        numbering=numbering,
        owned=numbering.owned,
        start=int(numbering.numbers[0]) if numbering.owned else 0,
        ghost_numbers=numbering.numbers[numbering.owned :],
        reference=rows(plan.points if plan else None),
        tables=(),
        regions=[],
        motion=rows(plan.constraints.motion if plan else None),
        motions=comm.bcast(plan.constraints.motions if plan else None),
        size=size,
        cell_numbers=np.empty(0, np.int64),
    )
    _enter_cells(case, plan, model)
    _enter_groups(plan, rows, model)
    _enter_loads(case, plan, rows, model)
    return Built(
        model=model,
        order=_file_order(plan, rows, comm),
        curve=comm.bcast(plan.curve if plan else None),
        notes=comm.bcast(plan.mesh.notes if plan else None),
    )


class _Rows:
    """Rows of the root rank's tables over nodes for the local nodes of this rank."""

    def __init__(self, numbering: Numbering, total: int) -> None:
        self.numbering = numbering
        self.total = total

    def __call__(self, table: NDArray | None) -> NDArray:
        return local_rows(self.numbering, table, self.total)

    def columns(self, tables: dict | None) -> dict:
        """The same for a dictionary of tables (n,)."""
        comm = self.numbering.comm
        names = comm.bcast(list(tables) if tables is not None else None)
        if not names:
            return {}
        together = self(np.stack(list(tables.values()), axis=1) if tables is not None else None)
        return {name: np.ascontiguousarray(together[:, k]) for k, name in enumerate(names)}


def _enter_cells(case: Case, plan: Blueprint | None, model: Model) -> None:
    """Sort this rank's cells by material, own ones first, and make the element tables and regions."""
    comm, numbering = model.comm, model.numbering
    total = comm.bcast(len(plan.cells) if plan else None)
    bounds = slab_bounds(total, comm.size)
    both = (
        None if plan is None else np.stack((plan.material.astype(np.int64), plan.mesh.cell_numbers), axis=1)
    )
    attributes = lookup(comm, bounds, scatter_rows(comm, both), numbering.file_cells)
    order = np.lexsort((np.arange(len(attributes)), ~numbering.own_cells, attributes[:, 0]))
    numbering = numbering.with_cell_order(order)
    model.numbering, model.cell_numbers = numbering, attributes[order, 1]
    material = attributes[order, 0]
    gradients, volumes = np.empty((len(order), 3, 3)), np.empty(len(order))
    geometry(model.reference, numbering.cells, gradients, volumes)
    model.tables = (numbering.cells, gradients, volumes)
    for number, spec in enumerate(case.spec.material):
        first, last = np.searchsorted(material, (number, number + 1))
        law = law_named(spec.law)
        model.regions.append(
            Region(
                law=law,
                kernels=make_kernels(law),
                parameters=law.parameters(spec.young, spec.poisson),
                density=spec.density,
                first=int(first),
                own_last=int(first + numbering.own_cells[first:last].sum()),
                last=int(last),
            )
        )


def _enter_groups(plan: Blueprint | None, rows: _Rows, model: Model) -> None:
    """Nodes of the groups and weights of the means that this rank owns."""
    n = model.owned
    for name, inside in rows.columns(plan.members if plan else None).items():
        model.groups[name] = np.flatnonzero(inside[:n])
    for name, weights in rows.columns(plan.means if plan else None).items():
        vectors = np.flatnonzero(weights[:n])
        model.means[name] = (vectors, weights[vectors])


def _enter_loads(case: Case, plan: Blueprint | None, rows: _Rows, model: Model) -> None:
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
    """∫ rho N_a dV (n,) of the owned nodes: a quarter of the mass of each cell of element 3413."""
    density = np.empty(len(model.cells))
    for region in model.regions:
        density[region.first : region.last] = region.density or 0.0
    corners = model.cells.shape[1]
    share = np.repeat(density * model.volumes / corners, corners)
    return np.bincount(model.cells.ravel(), share, minlength=len(model.reference))[: model.owned]


def _file_order(plan: Blueprint | None, rows: _Rows, comm: MPI.Comm) -> FileOrder:
    """Slabs of the mesh as the file has it, nodes no element uses included."""
    mesh = plan.mesh if plan else None
    groups = {name: group.nodes for name, group in mesh.groups.items()} if mesh else {}
    return FileOrder(
        points=scatter_rows(comm, mesh.points if mesh else None),
        cells=scatter_rows(comm, mesh.cells if mesh else None),
        node_numbers=scatter_rows(comm, mesh.node_numbers if mesh else None),
        cell_numbers=scatter_rows(comm, mesh.cell_numbers if mesh else None),
        total_nodes=comm.bcast(len(mesh.points) if mesh else None),
        total_cells=comm.bcast(len(mesh.cells) if mesh else None),
        node_rows=rows(plan.nodes if plan else None)[: rows.numbering.owned],
        kind=comm.bcast(mesh.kind if mesh else None),
        groups=groups,
    )
