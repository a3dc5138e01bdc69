"""`ancf check`: validates a case, prints what it would solve, and solves nothing."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ancf_petsc.cli.run import add_case_arguments, changes
from ancf_petsc.launcher import quick_if_alone

if TYPE_CHECKING:
    from ancf_petsc.input.load import Case
    from ancf_petsc.plan.plan import Plan

HELP = "check a case and its mesh, solve nothing"
PETSC_OPTIONS = True


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case_arguments(parser)


def execute(arguments: argparse.Namespace) -> int:
    with quick_if_alone():
        from mpi4py import MPI

    from ancf_petsc.input.load import load_case
    from ancf_petsc.parallel.exchange import on_root
    from ancf_petsc.plan.plan import make_plan

    comm = MPI.COMM_WORLD

    def show() -> None:
        case = load_case(arguments.case, changes(arguments), arguments.petsc_options)
        plan = make_plan(case)
        _print_mesh(plan)
        _print_case(case, plan)
        _print_doubts(case, plan)
        print("case is valid")

    on_root(comm, show)
    return 0


def _print_doubts(case: Case, plan: Plan) -> None:
    from ancf_petsc.cli.console import show_facts
    from ancf_petsc.plan.plausible import doubts_of

    show_facts([("looks wrong", doubt) for doubt in doubts_of(case, plan)])


def _print_mesh(plan: Plan) -> None:
    from ancf_petsc.cli.console import show_facts, show_table
    from ancf_petsc.mesh.check import MEASURES, statistics

    mesh = plan.mesh
    found = statistics(mesh)
    worst = f"worst {found.worst_quality:.3f} in element {found.worst_cell}"
    low, high = found.box
    unused = f", {found.unused_nodes} of them in no element" if found.unused_nodes else ""
    quality = ("quality (mean ratio)", f"{worst}, mean {found.mean_quality:.3f}")
    show_facts(
        [
            ("mesh", mesh.source),
            ("nodes", f"{found.nodes}{unused}"),
            ("elements", f"{found.cells} of {plan.element.code}"),
            ("pieces", found.pieces),
            ("box", " x ".join(f"[{a:.6g}, {b:.6g}]" for a, b in zip(low, high, strict=True))),
            (found.measure, found.volume),
            ("edges", f"{found.shortest_edge:.4g} to {found.longest_edge:.4g}"),
            *([quality] if found.dimension > 1 else []),
            *(("note", note) for note in mesh.notes),
        ]
    )
    dimensions = range(1, found.dimension + 1)
    rows = [
        [
            name,
            group.nodes,
            *(group.parts.get(d) for d in dimensions),
            *(group.measures.get(d) for d in dimensions),
        ]
        for name, group in found.groups.items()
    ]
    parts = [*("lines", "faces")[: found.dimension - 1], "elements"]
    show_table(["group", "nodes", *parts, *(MEASURES[d] for d in dimensions)], rows)


def _print_case(case: Case, plan: Plan) -> None:
    import numpy as np

    from ancf_petsc.analysis.host.memory import memory_estimate
    from ancf_petsc.cli.console import show_facts

    spec = case.spec
    dof = plan.element.components * plan.space.vectors
    driven = dof - int((plan.supports.drive < 0).sum())
    facts: list[tuple[str, object]] = [
        ("case", spec.title),
        ("analysis", _analysis(case)),
        ("degrees of freedom", f"{dof}, {driven} of them held or moved"),
        (
            "memory",
            f"about {memory_estimate(len(plan.space.cells), dof) / 1e9:.2g} GB, and 0.25 GB for each further rank",
        ),
    ]
    counts = np.bincount(plan.material, minlength=len(spec.material))
    for material, count in zip(spec.material, counts, strict=True):
        density = f", density {material.density:g}" if material.density else ""
        moduli = f"young {material.young:g}, poisson {material.poisson:g}"
        text = f"{material.law}, {moduli}{density}: {count} elements"
        facts.append(("material", text))
    for constraint in spec.constraint:
        held = list(constraint.fix)
        moved = [f"{axis} by {amount:g}" for axis, amount in constraint.move.items()]
        words = (["holds " + ", ".join(held)] if held else []) + (
            ["moves " + ", ".join(moved)] if moved else []
        )
        words += ["holds slopes in " + ", ".join(constraint.slopes)] if constraint.slopes else []
        nodes = int(plan.members[constraint.group].sum())
        facts.append(("constraint", f"{constraint.group}, {nodes} nodes: {'; '.join(words)}"))
    for load in spec.load:
        facts.append(("load", f"{load.type} {load.describe()}"))
    show_facts(facts)


def _analysis(case: Case) -> str:
    from ancf_petsc.plan.outputs import output_times

    if case.spec.statics:
        return f"statics, {len(output_times(case.spec, case.file))} outputs after the start"
    motion = case.spec.dynamics
    assert motion is not None
    return (
        f"dynamics by {motion.integrator} over {motion.duration:g}, {motion.outputs} outputs after the start"
    )
