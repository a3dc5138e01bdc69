"""Running a case from its file to its results."""

from __future__ import annotations

import logging
import resource
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

from ancf_petsc.analysis.build import Built, build_from
from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.host.signals import StopRequest
from ancf_petsc.analysis.host.versions import program_version, versions
from ancf_petsc.analysis.record import Record
from ancf_petsc.analysis.statics import StaticAnalysis
from ancf_petsc.element.catalog import element
from ancf_petsc.errors import Interrupted
from ancf_petsc.input.load import Case
from ancf_petsc.kernel.warmup import compile_kernels, is_compiled
from ancf_petsc.log import log_file
from ancf_petsc.material import law_named
from ancf_petsc.parallel.exchange import agree, on_root
from ancf_petsc.plan.plan import Plan, make_plan
from ancf_petsc.results.folder import check_folder, claim_folder, write_summary
from ancf_petsc.solve.petsc import petsc_options, refuse_unused, refuse_wrong_values

if TYPE_CHECKING:
    from ancf_petsc.analysis.motion import MotionAnalysis

log = logging.getLogger("ancf")


def run_case(
    case: Case,
    folder: str | Path | None = None,
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    force: bool = False,
    imports: float = 0.0,
    watch: Callable[[float], None] = lambda done: None,
) -> Path:
    """Solve a case and leave its results in a folder, which is returned. Collective.

    folder: default results/NAME. force: overwrite a folder that holds something else. imports: seconds
    spent before. watch: told the part of the path done, 0 to 1. Raises CaseError, NoEquilibrium,
    MotionStopped, Interrupted; what was computed before is saved.
    """
    folder = Path(folder) if folder else Path("results") / case.name
    clock = Clock(imports)
    on_root(comm, lambda: check_folder(folder, case.spec.title, force=force))
    with petsc_options(case.spec.petsc):
        with clock.part("read"):
            plan = on_root(comm, lambda: _read(case))
        with clock.part("setup"), refuse_wrong_values(case.spec.petsc):
            _compile(case, comm)
            built = build_from(case, plan, comm)
            del plan
            solver = _solver(case, built)
        try:
            if case.spec.petsc:
                with clock.part("setup"), refuse_wrong_values(case.spec.petsc):
                    solver.prepare()
                    agree(comm, lambda: refuse_unused(case.spec.petsc))
            on_root(comm, lambda: claim_folder(folder))
            with log_file(folder / "log.txt", comm.rank):
                _solve(case, built, solver, folder, clock, watch)
        finally:
            solver.destroy()
    return folder


def _solver(case: Case, built: Built) -> StaticAnalysis | MotionAnalysis:
    """What solves the case; what motion needs is imported for motion only."""
    if case.spec.dynamics is None:
        return StaticAnalysis(case, built)
    from ancf_petsc.analysis.motion import MotionAnalysis

    return MotionAnalysis(case, built)


def _read(case: Case) -> Plan:
    plan = make_plan(case)
    for note in plan.mesh.notes:
        log.warning("%s", note)
    return plan


def _compile(case: Case, comm: MPI.Comm) -> None:
    """Compile the kernels on the root rank, so that the others load them."""
    laws = [law_named(name) for name in sorted({material.law for material in case.spec.material})]
    row = element(case.spec.mesh.element)
    dynamics = case.spec.dynamics
    moving = dynamics is not None
    mean = dynamics is not None and dynamics.method.conserves
    if comm.rank == 0 and not is_compiled(row, laws, mean=mean, moving=moving):
        log.info("compiling kernels (%s): once, under a minute", ", ".join(law.name for law in laws))
    on_root(comm, lambda: compile_kernels(row, laws, mean=mean, moving=moving))


def _solve(
    case: Case,
    built: Built,
    solver: StaticAnalysis | MotionAnalysis,
    folder: Path,
    clock: Clock,
    watch: Callable[[float], None],
) -> None:
    """Follow the path or the motion; whatever happens, the summary says how it ended."""
    comm = solver.assembly.comm
    log.info("%s; solver: %s", describe(case, built), solver.describe())
    with clock.part("output"):
        record = Record(folder, case.spec, built, solver.assembly, program_version())
    stop = StopRequest(comm)
    run = solver.begin(record, clock, watch, stop.asked)
    status = "stopped"
    try:
        with stop.watched(), clock.part("solve"):
            run.go()
        status = "done"
    except Interrupted:
        status = "interrupted"
        raise
    finally:
        record.close()
        _summarise(case, built, folder, status, clock, run.totals, record.row, solver.facts(), comm)


def describe(case: Case, built: Built) -> str:
    """One line on the body."""
    laws = ", ".join(dict.fromkeys(region.law.title for region in built.model.regions))
    ranks = built.model.comm.size
    return (
        f"{case.spec.title}: {built.order.total_nodes} nodes, {built.order.total_cells} elements "
        f"{case.spec.mesh.element}, {laws}, {ranks} rank{'s' * (ranks > 1)}"
    )


def _summarise(
    case: Case,
    built: Built,
    folder: Path,
    status: str,
    clock: Clock,
    totals: Mapping[str, int],
    final: Mapping[str, float],
    facts: Mapping[str, Any],
    comm: MPI.Comm,
) -> None:
    memory = comm.gather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    dof = built.model.dof
    if comm.rank == 0:
        write_summary(
            folder,
            title=case.spec.title,
            status=status,
            seconds=clock.report(),
            memory_peak_bytes=memory,
            nodes=built.order.total_nodes,
            elements=built.order.total_cells,
            dof=dof,
            ranks=comm.size,
            iterations={"newton": totals["newton_iterations"], "linear": totals["linear_iterations"]},
            final=dict(final),
            versions=versions(),
            note=case.spec.note,
            steps=totals["steps"],
            **facts,
        )
