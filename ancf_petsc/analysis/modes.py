"""The first modes of a case's body: a table of frequencies, and the shapes as steps of a result."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.analysis.build import Built, build_from
from ancf_petsc.analysis.damping import RIGID, static_answer
from ancf_petsc.analysis.host.versions import program_version
from ancf_petsc.analysis.output_points import OutputPoints
from ancf_petsc.analysis.provenance import provenance_of
from ancf_petsc.errors import CaseError, writing
from ancf_petsc.input.load import Case
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.mass import Mass
from ancf_petsc.parallel.exchange import on_root
from ancf_petsc.plan.plan import make_plan
from ancf_petsc.results.folder import check_folder, claim_folder
from ancf_petsc.results.store import ResultStore
from ancf_petsc.results.tables import CsvTable
from ancf_petsc.solve.events import place_of
from ancf_petsc.solve.modes import Modes, modes_at
from ancf_petsc.solve.petsc import petsc_options

LARGEST_SHOWN = 0.1  # of the size of the body: the largest displacement of a shape
COLUMNS = ("mode", "frequency", "period", "omega", "critical_damping", "growth_rate")
log = logging.getLogger("ancf")


def find_modes(
    case: Case, folder: Path, count: int, *, loaded: bool, force: bool, comm: MPI.Comm = MPI.COMM_WORLD
) -> NDArray[np.float64]:
    """Rows (m, 6) of COLUMNS, written to modes.csv; shapes to results.h5 and .xdmf. Collective. Raises
    CaseError.

    loaded: of the body at rest under its loads, else of the undeformed one.
    """
    title = f"{case.spec.title}: modes"
    _need_density(case)
    with petsc_options(case.spec.petsc) as given:
        plan = on_root(comm, lambda: make_plan(case))
        about = on_root(comm, lambda: provenance_of(case, comm.size))
        ours = (title, f"{about.identity.hash} modes {count} {loaded}" if about else "")
        on_root(comm, lambda: check_folder(folder, *ours, force=force))
        built = build_from(case, plan, comm)
        assembly = Assembly(built.model)
        lumped = case.spec.dynamics is not None and case.spec.dynamics.mass == "lumped"
        mass = Mass(assembly, lumped=lumped)
        x = static_answer(case, assembly) if loaded else assembly.reference_vector()
        modes = modes_at(assembly, mass, x, count)
        given.refuse_unused(comm)
    mark = on_root(comm, lambda: claim_folder(folder, *ours, force=force))
    try:
        facts = {**about.attributes(), "hash": ours[1], "contents": "modes"} if about else None
        return _write(case, folder, title, facts, assembly, built, modes, x)
    finally:
        if mark is not None:
            mark.release()


def _write(
    case: Case,
    folder: Path,
    title: str,
    facts: dict[str, str] | None,
    assembly: Assembly,
    built: Built,
    modes: Modes,
    x: PETSc.Vec,
) -> NDArray[np.float64]:
    """The table and the shapes about the state x; the rows. Collective."""
    comm = assembly.comm
    rows = _rows(modes)
    _warn_of_unstable(assembly, modes, rows[:, 5])
    on_root(comm, lambda: _write_table(folder / "modes.csv", rows))
    store = ResultStore(
        folder, comm, title, case.spec.units, note=case.spec.note, version=program_version(), facts=facts
    )
    order = built.order
    store.write_mesh(
        order.points, order.kind, order.cells, order.node_numbers, order.cell_numbers, order.groups
    )
    points = OutputPoints(assembly, order)
    before = assembly.along_axes(x.array_r.reshape(-1, 3)) - built.model.reference[: built.model.owned]
    for row, shape in zip(rows, map(assembly.along_axes, modes.shapes), strict=True):
        largest = comm.allreduce(float(np.abs(shape[built.model.own_positions]).max(initial=0.0)), MPI.MAX)
        shown = before + LARGEST_SHOWN * built.model.size / largest * shape
        fields = {"displacement": points(shown)}
        store.write_step(row[0], fields, {}, {"frequency": row[1], "growth_rate": row[5]})
    store.close()
    return rows


def _write_table(path: Path, rows: NDArray[np.float64]) -> None:
    with writing(path), CsvTable(path, COLUMNS) as table:
        for row in rows:
            table.append(row)


def _rows(modes: Modes) -> NDArray[np.float64]:
    frequency = modes.frequencies
    with np.errstate(divide="ignore"):
        period = 1.0 / frequency
    numbers = np.arange(1, len(frequency) + 1)
    growth = np.sqrt(np.maximum(-modes.omega_squared, 0.0))
    growth[modes.omega_squared > -RIGID * modes.scale] = 0.0
    return np.stack(
        (numbers, frequency, period, 2 * np.pi * frequency, 4 * np.pi * frequency, growth), axis=1
    )


def _warn_of_unstable(assembly: Assembly, modes: Modes, growth: NDArray) -> None:
    """Name the modes that grow (m,) instead of vibrating: the state is no stable rest."""
    for number in np.flatnonzero(growth):
        places = place_of(assembly, modes.shapes[number])
        place, along = (", ".join(f"{c:.4g}" for c in vector) for vector in places)
        log.warning(
            "mode %d does not vibrate: the state is unstable, it grows as exp(%.6g t); it moves most at (%s) along (%s)",
            number + 1,
            growth[number],
            place,
            along,
        )


def _need_density(case: Case) -> None:
    for number, material in enumerate(case.spec.material):
        if material.density is None:
            raise CaseError(
                "missing",
                file=case.file,
                key=f"material.{material.group or number}.density",
                expected="a number > 0: vibrations need mass",
                cure="such as density = 1350.0",
            )
