"""`ancf bench`: times a fixed set of configurations, checks their answers, writes a table and JSON."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

HELP = "time a fixed set of configurations with known answers, beside a yardstick of the machine"
EPILOG = """\
names may be beginnings (accuracy, stroke, scaling) or patterns ("pendulum*"); without any, the table runs.
Larger meshes are made once and kept in ~/.cache/ancf_petsc/meshes. Every configuration runs in processes of
its own, on several ranks under mpiexec; let the machine do nothing else meanwhile."""
COLUMNS = ("benchmark", "median", "at most", "unit", "spread %", "error", "verdict", "what")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("names", metavar="NAME", nargs="*", help="which; --list shows them")
    parser.add_argument("--list", action="store_true", help="list the benchmarks and stop")
    parser.add_argument("--quick", action="store_true", help="small ones only, under two minutes")
    parser.add_argument("--repetitions", type=int, metavar="N", help="how often each is timed")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write everything that was measured")


def execute(arguments: argparse.Namespace) -> int:
    from ancf_petsc.bench.catalog import ROWS, choose
    from ancf_petsc.cli.console import show_table

    _refuse_wrong(arguments)
    if arguments.list:
        listed = [(row.name, "yes" if row.small else "", row.ranks, row.about) for row in ROWS.values()]
        show_table(("benchmark", "quick", "ranks", "what"), listed)
        return 0
    report = _measured(choose(arguments.names, quick=arguments.quick), arguments)
    _show(report)
    wrong = [name for name, result in report["results"].items() if result.get("right") is False]
    return 1 if wrong else 0


def _refuse_wrong(arguments: argparse.Namespace) -> None:
    from ancf_petsc.cli import rank_count
    from ancf_petsc.errors import CaseError

    if arguments.repetitions is not None and arguments.repetitions < 1:
        raise CaseError(key="--repetitions", got=arguments.repetitions, expected="a number from 1")
    if arguments.json and not arguments.json.absolute().parent.is_dir():
        raise CaseError(
            "there is no such folder", key="--json", got=str(arguments.json.parent), cure="make it first"
        )
    if rank_count() > 1:
        raise CaseError("ancf bench starts its ranks itself", cure="run it without mpiexec")


def _measured(rows: Any, arguments: argparse.Namespace) -> dict[str, Any]:
    from ancf_petsc.bench.suite import run_suite

    def tell(row: Any, report: dict[str, Any]) -> None:
        result = report["results"][row.name]
        found = result.get("problem") or f"{result['median']:.4g} {result['unit']}"
        print(f"{row.name}: {found}", flush=True)
        if arguments.json:
            _write(report, arguments.json)

    return run_suite(rows, repetitions=arguments.repetitions, tell=tell)


def _write(report: dict[str, Any], file: Path) -> None:
    import json

    file.write_text(json.dumps(report, indent=1) + "\n")


def _show(report: dict[str, Any]) -> None:
    from ancf_petsc.cli.console import show_facts, show_table

    machine = report["machine"]
    words = f"{machine['processor']}, {machine['cores']} cores, {machine['memory_gb']} GB"
    facts = [
        ("machine", f"{words}, load {machine['load_before']}"),
        ("commit", report["commit"]),
        ("date", report["date"]),
    ]
    for mesh, found in report["yardstick"].items():
        copied = " and ".join(f"{rate:.3g}" for rate in found["copy_gb_s"])
        gathered = " and ".join(f"{time:.3g}" for time in found["gather_scatter_ns"])
        measured = f"copy {copied} GB/s, gather and scatter {gathered} ns/element, on 1 and 2 processes"
        facts.append((f"yardstick {mesh}", measured))
    show_facts(facts)
    show_table(COLUMNS, [_line(name, result) for name, result in report["results"].items()])
    for name, result in report["results"].items():
        if "problem" in result:
            print(f"{name}: {result['problem']}")


def _line(name: str, result: dict[str, Any]) -> list[object]:
    verdict = {True: "met", False: "MISSED", None: ""}[result["met"]]
    if result.get("right") is False:
        verdict = "WRONG"
    spread = result.get("spread")
    shown = None if spread is None else round(100 * spread, 1)
    return [
        name,
        _number(result.get("median")),
        _number(result["target"]),
        result["unit"],
        _number(shown),
        _number(result.get("error"), 2),
        "cannot run" if "problem" in result else verdict,
        result["about"],
    ]


def _number(value: float | None, digits: int = 4) -> str:
    return "" if value is None else f"{value:.{digits}g}"
