#!/usr/bin/env python3
"""Writes docs/performance.md from docs/benchmarks/*.json. All numbers in it come from there.

ancf bench --json docs/benchmarks/bench.json                            # 5 minutes on two quiet cores
ancf bench iterations scaling --json docs/benchmarks/sweeps.json           # 10 minutes
ancf bench alternatives --json docs/benchmarks/alternatives.json        # 3 minutes
scripts/bench_peers.py --json docs/benchmarks/peers.json
scripts/write_performance.py
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from scaling_model import TWO_LEVEL_RANKS, Model

DOCS = Path(__file__).resolve().parent.parent / "docs"
STORE = DOCS / "benchmarks"
PARTS = ("read", "setup", "solve", "output")
STRONG = {"block_74k": "block_74k_one", "block_480k": "block_480k_one"}
WEAK = {"scaling/weak/37k": "block_74k", "scaling/weak/240k": "block_480k"}
BETTER = 7
MANY = (1, 2, 16, 256, 4096)
Report = dict[str, Any]


def main() -> int:
    bench, sweeps, parts, peers = (load(name) for name in ("bench", "sweeps", "alternatives", "peers"))
    if not bench:
        print(
            "error: docs/benchmarks/bench.json is missing: ancf bench --json docs/benchmarks/bench.json",
            file=sys.stderr,
        )
        return 2
    results = {**bench["results"], **sweeps.get("results", {}), **parts.get("results", {})}
    pieces = [*head(bench), *targets(bench["results"]), *misses(bench["results"])]
    pieces += [
        *side_by_side(peers),
        *solvers(results),
        *alternatives(results),
        *scaling(results),
    ]
    (DOCS / "performance.md").write_text("\n".join(pieces) + "\n")
    print(DOCS / "performance.md")
    return 0


def load(name: str) -> Report:
    """A report that was measured, empty where there is none."""
    file = STORE / f"{name}.json"
    return json.loads(file.read_text()) if file.is_file() else {}


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return [*lines, *("| " + " | ".join(map(written, row)) + " |" for row in rows), ""]


def written(value: object) -> str:
    return "" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)


def where(report: Report) -> str:
    """Machine, versions, commit, date in one line."""
    machine = report["machine"]
    parts = [f"{machine['processor']}, {machine['cores']} cores, {machine['memory_gb']} GB"]
    parts += [f"{name} {number}" for name, number in report.get("versions", {}).items() if name != "machine"]
    made = f"commit {report['commit'] or 'unknown'}, {report['date']}, load before {machine['load_before']}"
    return f"{', '.join(parts)}; {made}"


def head(bench: Report) -> list[str]:
    lines = [
        "# Performance",
        "",
        "Written by `scripts/write_performance.py` from `docs/benchmarks/`; measured by `ancf bench`.",
        "",
    ]
    lines += [
        "Median of repetitions after warming up, spread is half the range. Every run checks its answer.",
        "",
    ]
    lines += [
        f"Machine: {where(bench)}.",
        "",
        "Yardstick of the machine in the same run, on one process and on two at once:",
        "",
    ]
    rows = [
        (mesh, *found["copy_gb_s"], found["copy_gain"], *found["gather_scatter_ns"], found["gather_gain"])
        for mesh, found in bench["yardstick"].items()
    ]
    heads = ("mesh", "copy GB/s, 1", "2", "gain", "gather and scatter ns/element, 1", "2", "gain")
    return lines + table(heads, rows)


def verdict(result: Report) -> str:
    if "problem" in result:
        return "cannot run"
    if result["right"] is False:
        return "**wrong**"
    return {True: "met", False: "**missed**", None: ""}[result["met"]]


def targets(results: Report) -> list[str]:
    """The table of what was wanted and what was measured."""
    rows = []
    for name, result in results.items():
        if result["target"] is None:
            continue
        spread = f"{100 * result['spread']:.0f} %" if "spread" in result else None
        middle, bound = result.get("median"), "at least" if result["unit"] == "times" else "at most"
        rows.append(
            (f"`{name}`", result["about"], middle, f"{bound} {result['target']:.3g}", result["unit"], spread)
            + (result.get("error"), verdict(result))
        )
    heads = ("benchmark", "what", "measured", "wanted", "unit", "spread", "error of the answer", "")
    return ["## Targets", "", *table(heads, rows)]


def misses(results: Report) -> list[str]:
    """What the time of each missed target is spent on."""
    lines = []
    for name, result in results.items():
        if result["target"] is None or result["met"]:
            continue
        said = [result["problem"]] if "problem" in result else spent(result)
        lines.append(f"- `{name}`: {'; '.join(said)}.")
    return ["## Misses", "", *(lines or ["None."]), ""]


def spent(result: Report) -> list[str]:
    """Parts of the time, of the last repetition, and work done."""
    facts = result.get("facts", {})
    seconds = facts.get("seconds", {})
    times = result["median"] / result["target"]
    shown = [f"{part} {last(seconds[part]):.3g} s" for part in seconds if part not in ("import", "total")]
    counts = facts.get("iterations", {})
    work = [f"{counts['newton']} Newton and {counts['linear']} linear iterations"] if counts else []
    far = f"{times:.2f} x of what is wanted"
    gain = (
        [f"copying gains {facts['yardstick_gain']:.2f} in the same run"] if "yardstick_gain" in facts else []
    )
    return [far, *gain, *([", ".join(shown)] if shown else []), *work]


def last(value: float | list[float]) -> float:
    return value[-1] if isinstance(value, list) else value


def side_by_side(peers: Report) -> list[str]:
    """Other programs on the same problems in one run."""
    if not peers:
        return []
    lines = [
        "## Beside other programs",
        "",
        f"`scripts/bench_peers.py`, {peers['ranks']} ranks or threads. {where(peers)}.",
        "",
    ]
    rows = []
    for size, found in peers["results"].items():
        for name, run in found["programs"].items():
            seconds = run.get("median")
            difference = run.get("difference")
            about = run.get("problem") or ", ".join(f"{part} {t:.3g}" for part, t in run["seconds"].items())
            counts = run.get("iterations", {})
            rows.append(
                (f"{size}: {found['elements']}", name, seconds, run.get("ratio"))
                + (counts.get("newton"), counts.get("linear"), difference, about)
            )
    heads = (
        "elements",
        "program",
        "seconds",
        "times ancf_petsc",
        "Newton",
        "linear",
        "difference of force",
        "parts, s",
    )
    lines += table(heads, rows)
    lines += [
        "`helped`: dolfinx with extrapolated starts of steps, and a preconditioner that is kept while it does its work, as here.",
        "",
    ]
    for size, found in peers["results"].items():
        ratio = found["best_peer_ratio"]
        if ratio is not None:
            said = "met" if ratio >= BETTER else "**missed**"
            lines.append(
                f"- {size}: the faster peer takes {ratio:.2f} times as long; wanted {BETTER}: {said}."
            )
    return [*lines, ""]


def sweep(results: Report, name: str) -> dict[tuple[str, ...], Report]:
    """Results whose name begins with `name`, by the rest of it, without those that could not run."""
    found = {
        tuple(full.split("/")[1:]): result for full, result in results.items() if full.startswith(f"{name}/")
    }
    return {rest: result for rest, result in found.items() if "problem" not in result}


def solvers(results: Report) -> list[str]:
    """Iterations of the two solvers for large bodies."""
    found = sweep(results, "iterations")
    pairs = [
        (element, size, run, found.get(("two_level", element, size)))
        for (kind, element, size), run in found.items()
        if kind == "gamg"
    ]
    if not pairs:
        return []
    rows = [
        (element, run["facts"]["dof"], run["median"], last(run["facts"]["seconds"]))
        + (other["median"], last(other["facts"]["seconds"]))
        for element, _, run, other in pairs
        if other
    ]
    heads = ("element", "dof", "multigrid, iterations", "s", "two levels, iterations", "s")
    words = "Conjugate gradients to eight digits with the tangent of a clamped beam bent far; seconds with set-up, one rank."
    return ["## Linear solvers", "", words, "", *table(heads, rows)]


def alternatives(results: Report) -> list[str]:
    """Parts of this program beside what could stand in their place."""
    rows = [
        (
            parts[0],
            f"`{'/'.join(parts[1:])}`",
            result.get("facts", {}).get("dof"),
            result.get("median"),
            result["unit"],
            *effort(result),
            verdict(result),
        )
        for parts, result in sweep(results, "alternatives").items()
    ]
    words = "Parts of this program and what could stand in their place; docs/architecture.md says when."
    heads = ("part", "by", "dof", "measured", "unit", "Newton", "linear", "")
    return ["## Parts and alternatives", "", words, "", *table(heads, rows)] if rows else []


def effort(result: Report) -> tuple[int | None, int | None]:
    """Newton and linear iterations."""
    counts = result.get("facts", {}).get("iterations", {})
    return counts.get("newton"), counts.get("linear")


def scaling(results: Report) -> list[str]:
    """One rank and two, and the model of many."""
    strong = [
        (two, results[one]["median"], results[two]["median"])
        for two, one in STRONG.items()
        if both(results, one, two)
    ]
    weak = [
        (f"{one} / {two}", results[one]["median"], results[two]["median"])
        for one, two in WEAK.items()
        if both(results, one, two)
    ]
    rows = [(name, one, two, one / two, "times faster") for name, one, two in strong]
    rows += [(name, one, two, one / two, "of one rank's speed kept") for name, one, two in weak]
    lines = (
        ["## Scaling", "", *table(("problem", "one rank, s", "two ranks, s", "", ""), rows)] if rows else []
    )
    needed = ("setup_480k", "scaling/exchange", "scaling/messages/16", "block_480k", "scaling/multigrid/480k")
    if not both(results, *needed):
        return lines
    model = Model(results, "block_480k", multigrid=False)
    many = Model(results, "scaling/multigrid/480k", multigrid=True)
    lines += ["### What to expect on more ranks", "", *model_words(model, many)]
    shares = [(f"{model.elements} elements", model.elements, 0), ("240,000 elements a rank", 0, 240_000)]
    for title, fixed, each in shares:
        parts = [
            (model if ranks <= TWO_LEVEL_RANKS else many).parts(fixed or each * ranks, ranks)
            for ranks in MANY
        ]
        rows = [
            (p.ranks, p.serial, p.shared, p.messages, p.sums, p.total, efficiency(parts[0], p)) for p in parts
        ]
        heads = (
            "ranks",
            "root alone, s",
            "shared work, s",
            "messages, s",
            "sums, s",
            "together, s",
            "efficiency",
        )
        lines += [f"{title}:", "", *table(heads, rows)]
    return [*lines, "`scripts/cluster.slurm` starts a run on a cluster."]


def both(results: Report, *names: str) -> bool:
    return all("median" in results.get(name, {}) for name in names)


def efficiency(one: Any, many: Any) -> float:
    """Work done a rank and second, over that of one rank."""
    return (many.elements / many.total / many.ranks) / (one.elements / one.total)


def model_words(model: Model, many: Model) -> list[str]:
    words = f"""\
A model (`scripts/scaling_model.py`), no measurement. Work and linear iterations ({model.iterations}) are
those of `block_480k` on two ranks, {1e6 * model.work:.3g} us an element; beyond {TWO_LEVEL_RANKS} ranks, where
multigrid takes over, those of the same run with multigrid, {many.iterations} iterations and
{1e6 * many.work:.3g} us an element. Reading and tables by the root rank take
{1e6 * model.serial:.3g} us an element; ghosts {model.ghost_factor:.3g} (nodes / rank)^(2/3) and up to
{model.neighbour_limit:.3g} neighbours, fitted to a mesh divided among 2 to 16 ranks. Messages of
{1e6 * model.latency:.3g} us and {model.bandwidth / 1e9:.3g} GB/s and sums of {1e6 * model.sum_time:.3g} us
were timed between two processes of this machine: a cluster's network has its own. Iterations are taken not to
grow. What the root rank does alone is what limits many ranks: it reads the file and makes the tables."""
    return [words, ""]


if __name__ == "__main__":
    sys.exit(main())
