"""Running a case from its file to its results."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

from ancf_petsc.analysis.build import Built, build_from
from ancf_petsc.analysis.checkpoint import Checkpoints, History, Resumed
from ancf_petsc.analysis.ending import Ending
from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.host.signals import StopRequest
from ancf_petsc.analysis.host.versions import program_version
from ancf_petsc.analysis.provenance import Provenance, provenance_of
from ancf_petsc.analysis.record import Record
from ancf_petsc.analysis.restart import Found, find
from ancf_petsc.analysis.statics import StaticAnalysis
from ancf_petsc.element.catalog import element
from ancf_petsc.errors import AncfError
from ancf_petsc.input.interval import interval_of
from ancf_petsc.input.load import Case
from ancf_petsc.kernel.warmup import compile_kernels, is_compiled
from ancf_petsc.log import log_file
from ancf_petsc.material import law_named
from ancf_petsc.parallel.exchange import all_meet, on_root
from ancf_petsc.parallel.fields import Places
from ancf_petsc.plan.plan import Plan, make_plan
from ancf_petsc.results.folder import check_folder, claim_folder, reclaim_folder
from ancf_petsc.solve.petsc import free_what_python_dropped, petsc_options, refuse_wrong_values

if TYPE_CHECKING:
    from ancf_petsc.analysis.motion import MotionAnalysis

log = logging.getLogger("ancf")


def run_case(
    case: Case,
    folder: str | Path | None = None,
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    force: bool = False,
    restart: bool = False,
    extend: bool = False,
    imports: float = 0.0,
    watch: Callable[[float], None] = lambda done: None,
) -> Path:
    """Solve a case and leave its results in a folder, which is returned. Collective.

    folder: default results/NAME. force: overwrite a folder that holds something else, such as a run of another
    case. restart: go on from the last checkpoint in the folder, if there is one; extend: though the case asks for a longer
    duration, more outputs, other options of PETSc. imports: seconds spent before. watch: gets the part of the path done, 0 to 1.
    Raises CaseError, NoEquilibrium, MotionStopped, EnvironmentProblem, Interrupted; what was computed before is saved.
    """
    folder = Path(folder) if folder else Path("results") / case.name
    clock = Clock(imports)
    with petsc_options(case.spec.petsc) as given:
        with clock.part("read"):
            plan = on_root(comm, lambda: _read(case))
            about = on_root(comm, lambda: provenance_of(case, comm.size))
        ours = (case.spec.title, about.identity.hash if about else "")
        found = _find(comm, folder, about, extend=extend) if restart else Found()
        if found.is_done:
            return folder
        resumed = Resumed(comm, found.saved) if found.goes_on else None
        on_root(comm, lambda: check_folder(folder, *ours, force=force, kept=resumed is not None))
        with clock.part("setup"), refuse_wrong_values(case.spec.petsc):
            _compile(case, comm)
            built = build_from(case, plan, comm, resumed.owners if resumed else None)
            del plan
            solver = _solver(case, built)
        try:
            if case.spec.petsc:
                with clock.part("setup"), refuse_wrong_values(case.spec.petsc):
                    solver.prepare()
                    given.refuse_unknown(comm)
            with ExitStack() as stack:
                claim = claim_folder if resumed is None else reclaim_folder
                mark = on_root(comm, lambda: claim(folder, *ours, force=force))
                if mark is not None:
                    stack.callback(mark.release)
                mode = "w" if resumed is None else "a"
                on_root(comm, lambda: stack.enter_context(log_file(folder / "log.txt", comm.rank, mode)))
                _solve(case, built, solver, Ending(folder, clock, about, mark), watch, resumed)
            given.refuse_unused(comm)
        finally:
            if comm.size == 1 or _is_of_all_ranks(sys.exc_info()[1]):
                solver.destroy()
                free_what_python_dropped(comm)
    return folder


def _is_of_all_ranks(error: BaseException | None) -> bool:
    """Whether the others end here too: freeing PETSc's objects would wait for them."""
    return error is None or isinstance(error, AncfError)


def _find(comm: MPI.Comm, folder: Path, about: Provenance | None, *, extend: bool) -> Found:
    """What there is to go on from; other ranks than the root know that of it which all need."""

    def work() -> Found:
        assert about is not None
        return find(folder, about, extend=extend)

    found = on_root(comm, work)
    known = comm.bcast(found and Found(found.is_done, found.goes_on))
    return found or known


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
    flags = {
        "mean": dynamics is not None and dynamics.method.conserves,
        "moving": dynamics is not None,
        "axisymmetric": case.spec.is_axisymmetric,
    }
    if comm.rank == 0 and not is_compiled(row, laws, **flags):
        log.info("compiling kernels (%s): once, under a minute", ", ".join(law.name for law in laws))
    on_root(comm, lambda: compile_kernels(row, laws, **flags))


def _solve(
    case: Case,
    built: Built,
    solver: StaticAnalysis | MotionAnalysis,
    ending: Ending,
    watch: Callable[[float], None],
    resumed: Resumed | None,
) -> None:
    """Follow the path or the motion; whatever happens, the summary says how it ended."""
    comm, clock = solver.assembly.comm, ending.clock
    if ending.about is not None:
        ending.about.write_log()
    log.info("%s; solver: %s", describe(case, built), solver.describe())
    log_shares(built)
    with clock.part("output"):
        attributes = ending.about.attributes() if ending.about else None
        goes_on = resumed.take_files_back(ending.folder) if resumed else None
        record = Record(
            ending.folder, case.spec, built, solver.assembly, program_version(), attributes, goes_on
        )
    stop, places = StopRequest(comm), Places(comm, built.model.numbering)
    history = resumed.history() if resumed else History()
    interval = interval_of(case.spec.output.checkpoint)
    saving = Checkpoints(ending.folder, interval, places, stop, clock, ending.about, history)
    run = solver.begin(record, clock, watch, lambda: saving.between_steps(run))
    if resumed is not None:
        with clock.part("setup"):
            run.restore(resumed.state(places))
        clock.add(resumed.about["seconds"])
        log.info("goes on from checkpoint %d, at %s", history.number, run.place)
    failure: AncfError | None = None
    try:
        with stop.watched(), clock.part("solve"):
            run.go()
            if case.spec.dynamics is not None:
                saving.at_end(run)
    except (
        AncfError
    ) as error:  # of all ranks; any other error is of this one alone, and summing up would wait
        if not all_meet(comm):
            raise RuntimeError(f"this rank alone met: {error}") from error
        failure = error
        raise
    finally:
        record.close()
        if failure is not None or sys.exc_info()[0] is None or comm.size == 1:
            facts = {**solver.facts(), **saving.facts()}
            ending.write(case, built, run.totals, record.row, facts, failure)


def log_shares(built: Built) -> None:
    """A line of details: nodal vectors and elements of each rank. Collective."""
    numbering = built.model.numbering
    shares = built.model.comm.gather((built.model.owned, int(numbering.own_cells.sum())))
    if shares and len(shares) > 1:
        words = ", ".join(f"{vectors} and {cells}" for vectors, cells in shares)
        log.debug("nodal vectors and elements of each rank: %s", words)


def describe(case: Case, built: Built) -> str:
    """One line on the body."""
    laws = ", ".join(dict.fromkeys(region.law.title for region in built.model.regions))
    ranks = built.model.comm.size
    return (
        f"{case.spec.title}: {built.order.total_nodes} nodes, {built.order.total_cells} elements "
        f"{case.spec.mesh.element}, {laws}, {ranks} rank{'s' * (ranks > 1)}"
    )
