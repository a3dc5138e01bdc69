"""The measurements: each takes the ranks and a task's arguments and returns samples, error and facts.

samples: one value a repetition, in the unit of the catalogue's row. error: distance from the known answer,
None where there is none for this mesh. Every measurement is collective.
"""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from mpi4py import MPI

from ancf_petsc.analysis.build import build, build_from
from ancf_petsc.analysis.host.versions import versions
from ancf_petsc.analysis.run import run_case
from ancf_petsc.analysis.statics import StaticAnalysis
from ancf_petsc.bench.alternatives import mass_solver, reader
from ancf_petsc.bench.elements import compile_catalogue, points
from ancf_petsc.bench.kernels import residual, tangent
from ancf_petsc.bench.line_search import line_search
from ancf_petsc.bench.meshes import mesh_path
from ancf_petsc.bench.messages import exchange_cost, messages
from ancf_petsc.bench.problems import PROBLEMS, block, block_force_234, reference_tip
from ancf_petsc.bench.solvers import iterations
from ancf_petsc.bench.yardstick import copy_rate, gather_time
from ancf_petsc.input.load import Case, case_from_dict
from ancf_petsc.parallel.exchange import on_root
from ancf_petsc.plan.case_mesh import mesh_of
from ancf_petsc.plan.plan import plan_on
from ancf_petsc.results.reader import open_results
from ancf_petsc.solve.linear import solver as linear_solver

Result = dict[str, Any]
WORK = ("read", "setup", "solve", "output")
EVALUATIONS = {"central_difference": 1, "runge_kutta_4": 4, "runge_kutta_5dp": 6}


def yardstick(comm: MPI.Comm, *, mesh: str, repetitions: int) -> Result:
    """Memory bandwidth in GB/s; gather and scatter in ns an element, on the solver's numbering."""
    on_root(comm, lambda: mesh_path(mesh))
    case = case_from_dict(block(mesh, 0.001, 1), Path.cwd(), "yardstick")
    model = build(case, MPI.COMM_SELF).model
    gathered = gather_time(comm, model.cells, len(model.reference), repetitions)
    return {"samples": copy_rate(comm, repetitions), "facts": {"gather_scatter_ns": gathered}}


def its_versions(comm: MPI.Comm) -> Result:
    """Versions of what computes; asked here, for the process that starts the others never meets MPI."""
    return {"samples": [], "error": None, "facts": versions()}


def run(
    comm: MPI.Comm,
    *,
    problem: dict[str, Any],
    known: dict[str, Any] | None = None,
    parts: tuple[str, ...] = WORK,
    warm_up: dict[str, Any] | None = None,
    repetitions: int,
) -> Result:
    """Whole runs: seconds in `parts` of them. warm_up: a problem to run first, this one by default."""
    case = _case(comm, problem)
    _solved(comm, case if warm_up is None else _case(comm, warm_up))
    samples, result, memory = [], {}, 0.0
    for _ in range(repetitions):
        result = _solved(comm, case)
        samples.append(sum(result["seconds"].get(part, 0.0) for part in parts))
        # Later runs find memory that earlier ones have not given back.
        memory = max(memory, result["memory_bytes_an_element"])
    result["memory_bytes_an_element"] = memory
    return {
        "samples": samples,
        "error": _error(result, known or {}),
        "facts": {name: value for name, value in result.items() if name != "tip"},
    }


def either_solver(comm: MPI.Comm, *, solver: str, **task: Any) -> Result:
    """`run` with one linear solver whatever the size of the body: "direct" or "iterative"."""
    limit = 10**9 if solver == "direct" else 0
    with patch.multiple(linear_solver, DIRECT_LIMIT=limit, CURVED_LIMIT=limit):
        return run(comm, **task)


def explicit(comm: MPI.Comm, *, problem: dict[str, Any], known: dict[str, Any], repetitions: int) -> Result:
    """ns an element and force evaluation of an explicit motion, all that its solution takes included."""
    result = run(comm, problem=problem, known=known, parts=("solve",), repetitions=repetitions)
    facts = result["facts"]
    per_step = EVALUATIONS[problem["integrator"]]
    facts["force_evaluations"] = per_step * facts["steps"]
    count = facts["elements"] * facts["force_evaluations"]
    return result | {"samples": [1e9 * seconds / count for seconds in result["samples"]]}


def set_up(comm: MPI.Comm, *, problem: dict[str, Any], repetitions: int) -> Result:
    """Seconds from the mesh file to the first assembled tangent; reading the file is among the facts."""
    case = _case(comm, problem)
    seconds: dict[str, list[float]] = {name: [] for name in ("read", "tables", "distribute", "assemble")}
    volume = 0.0
    for _ in range(repetitions):
        clock = _Splits(comm, seconds)
        mesh: Any = on_root(comm, lambda: mesh_of(case))
        clock.split("read")
        plan = on_root(comm, partial(plan_on, case, mesh))
        clock.split("tables")
        built = build_from(case, plan, comm)
        clock.split("distribute")
        solver = StaticAnalysis(case, built)
        solver.assembly.tangent(solver.assembly.reference_vector(), solver.newton.matrix)
        clock.split("assemble")
        own = built.model.volumes[built.model.numbering.own_cells].sum()
        volume = comm.allreduce(own)
        solver.destroy()
    samples = [sum(parts) for parts in zip(*seconds.values(), strict=True)]
    return {"samples": samples, "error": abs(volume / (0.05**2 * 0.1) - 1), "facts": {"seconds": seconds}}


class _Splits:
    """A stopwatch for the parts of collective work."""

    def __init__(self, comm: MPI.Comm, seconds: dict[str, list[float]]) -> None:
        self.comm, self.seconds = comm, seconds
        comm.Barrier()
        self.begun = time.perf_counter()

    def split(self, name: str) -> None:
        self.comm.Barrier()
        now = time.perf_counter()
        self.seconds[name].append(now - self.begun)
        self.begun = now


def _case(comm: MPI.Comm, problem: dict[str, Any]) -> Case:
    """The case of {"name": of a problem, and its arguments}; its mesh is made where it is missing."""
    arguments = dict(problem)
    maker: Any = PROBLEMS[arguments.pop("name")]
    return comm.bcast(on_root(comm, lambda: case_from_dict(maker(**arguments), Path.cwd(), "benchmark")))


def _solved(comm: MPI.Comm, case: Case) -> Result:
    """One run in a folder that is thrown away: its summary, and the tip's path where there is one."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(comm.bcast(place)) / "run"
        before = _resident()
        _forget_peak()
        run_case(case, folder, comm=comm)
        more = comm.allreduce(_peak() - before)
        result = comm.bcast(on_root(comm, lambda: _outcome(folder)))
    result["memory_bytes_an_element"] = more / result["elements"]
    result["memory_of_helpers_bytes"] = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
    return result


def _outcome(folder: Path) -> Result:
    results = open_results(folder)
    summary = results.summary
    kept = ("seconds", "nodes", "elements", "dof", "ranks", "iterations", "steps", "memory_peak_bytes")
    found: Result = {name: summary[name] for name in kept if name in summary}
    if "force" in summary["final"]:
        found["force"] = summary["final"]["force"]
    if results.probes:
        found["tip"] = np.stack([results.probes[f"tip.{axis}"] for axis in "xyz"], axis=1)
        found["tip_end"] = found["tip"][-1].tolist()
    return found


def _error(result: Result, known: dict[str, Any]) -> float | None:
    """How far the last run's answer is from the known one: force relative, tip in metres."""
    if "force" in known:
        right = block_force_234() if known["force"] == "pvc_block_234" else known["force"]
        if known.get("elements", result["elements"]) != result["elements"]:
            return None
        return abs(result["force"] / right - 1)
    if known.get("tip") == "pendulum_96":
        return float(np.linalg.norm(result["tip"] - reference_tip(), axis=1).max())
    if "tip_end" in known:
        return float(np.linalg.norm(result["tip"][-1] - known["tip_end"]))
    return None


def _resident() -> int:
    """Bytes of memory this process holds."""
    return _status("VmRSS")


def _peak() -> int:
    """The most bytes this process held since `_forget_peak`."""
    return _status("VmHWM")


def _forget_peak() -> None:
    """Let the peak of memory start anew (Linux)."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _status(name: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name)) * 1024


MEASUREMENTS: dict[str, Callable[..., Result]] = {
    "versions": its_versions,
    "yardstick": yardstick,
    "residual": residual,
    "tangent": tangent,
    "compile_catalogue": compile_catalogue,
    "points": points,
    "set_up": set_up,
    "run": run,
    "either_solver": either_solver,
    "explicit": explicit,
    "iterations": iterations,
    "mass_solver": mass_solver,
    "reader": reader,
    "line_search": line_search,
    "messages": messages,
    "exchange_cost": exchange_cost,
}
