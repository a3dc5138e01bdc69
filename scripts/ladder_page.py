"""docs/elements.md and its pictures from docs/benchmarks/element_ladder_*.json, which `element_ladder --docs` writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import limits_page
import matplotlib as mpl

mpl.use("Agg")
import numpy as np
from matplotlib import pyplot as plt

DOCS = Path(__file__).resolve().parent.parent / "docs"
PICTURES = {"cantilever": "element_ladder.png", "block": "element_ladder_block.png"}
TITLES = {
    "cantilever": "Cantilever: displacement of the end",
    "block": "PVC block, neo-Hooke, 10 mm: force",
}
WITHIN = {"cantilever": 0.2, "block": 1.0}  # per cent
QUICK = 20.0  # seconds
NOT_CONVERGING = "3413"
Row = dict[str, Any]
Report = dict[str, Any]


def extrapolated(rows: list[Row], what: str) -> tuple[float, float]:
    """Limit and order of the finest three rows: errors that fall with a power of the size of cells."""
    values, sizes = ([row[key] for row in rows[-3:]] for key in (what, "size"))
    powers = np.linspace(0.2, 8.0, 7801)
    coarse, middle, fine = (np.array(size) ** powers for size in sizes)
    wanted = (values[0] - values[1]) / (values[1] - values[2])
    best = int(np.argmin(abs(np.log((coarse - middle) / (middle - fine)) - np.log(max(wanted, 1e-9)))))
    step = (values[1] - values[2]) / (middle[best] - fine[best])
    return float(values[2] - step * fine[best]), float(powers[best])


def fitted(rows: list[Row]) -> float:
    """Limit of the rows by least squares, errors falling with one power of the size of cells."""
    sizes, values = (np.array([row[key] for row in rows]) for key in ("size", "answer"))
    found = []
    for power in np.linspace(0.5, 5.0, 451):
        terms = np.column_stack((np.ones(len(rows)), sizes**power))
        (limit, factor), *_ = np.linalg.lstsq(terms, values, rcond=None)
        found.append((float(np.linalg.norm(terms @ (limit, factor) - values)), float(limit)))
    return min(found)[1]


def limits_of(rows: list[Row]) -> dict[str, float]:
    """Limits that several choices of graded meshes of 3-10-1-3 are fitted to."""
    rungs = [row for row in rows if row["element"] == "3-10-1-3" and row["ladder"] == "graded"]
    return {
        "finest three": fitted(rungs[-3:]),
        "finest four": fitted(rungs[-4:]),
        "three before the finest": fitted(rungs[-4:-1]),
        "four before the finest": fitted(rungs[-5:-1]),
    }


def best_limit(rows: list[Row]) -> dict[str, float]:
    """The limit of the finest four meshes, and how far from it the other choices lie."""
    found = limits_of(rows)
    answer = found["finest four"]
    return {"answer": answer, "uncertain": max(abs(answer - other) for other in found.values())}


def error(row: Row, report: Report) -> float:
    """Per cent of the limit."""
    return 100 * abs(row["answer"] / report["limits"]["answer"] - 1)


def ladders(report: Report) -> dict[tuple[str, str], list[Row]]:
    found: dict[tuple[str, str], list[Row]] = {}
    for row in report["rows"]:
        found.setdefault((row["element"], row["ladder"]), []).append(row)
    return found


def draw(problem: str, report: Report, path: Path) -> None:
    """Error against degrees of freedom and against seconds; graded meshes are stars."""
    figure, axes = plt.subplots(1, 2, figsize=(11, 5), sharey=True)
    codes = list(dict.fromkeys(row["element"] for row in report["rows"]))
    colours = dict(zip(codes, plt.get_cmap("tab10").colors, strict=False))  # type: ignore[attr-defined]
    joined = problem == "block"
    for (code, ladder), rows in ladders(report).items():
        style = "*" + "-" * joined if ladder == "graded" else "o--" if joined else "o-"
        label = f"{code}, graded" if joined and ladder == "graded" else code if ladder == "uniform" else None
        for ax, key in zip(axes, ("dof", "seconds"), strict=True):
            at, errors = [r[key] for r in rows], [error(r, report) for r in rows]
            ax.loglog(at, errors, style, color=colours[code], label=label, ms=11 if ladder == "graded" else 5)
    for ax, words in zip(axes, ("degrees of freedom", "seconds, one core"), strict=True):
        ax.axhline(WITHIN[problem], color="k", lw=0.8, ls=":")
        ax.set_xlabel(words)
        ax.grid(which="both", alpha=0.25)
    where, level = ("axes fraction", "data"), WITHIN[problem]
    axes[1].annotate(
        f"{level:g} %", (0.01, level), xycoords=where, va="bottom"
    )  # the legend covers the other
    axes[1].axvline(QUICK, color="k", lw=0.8, ls=":")
    axes[0].set_ylabel("error, %")
    axes[0].plot([], [], "*", color="grey", ms=11, label="graded meshes")
    axes[0].legend(fontsize=9, loc="lower left")
    figure.suptitle(TITLES[problem])
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return [*lines, *("| " + " | ".join(row) + " |" for row in rows), ""]


def lines_of(problem: str, report: Report) -> list[str]:
    """The tables: every mesh, the limits of the ladders, the first mesh that is near enough."""
    heads = ("element", "mesh", "degrees of freedom", "answer", "error, %", "seconds", "Newton")
    every = [
        (
            row["element"],
            f"{row['mesh']}{', graded' if row['ladder'] == 'graded' else ''}",
            f"{row['dof']:,}",
            f"{row['answer']:.7g}",
            f"{error(row, report):.3g}",
            f"{row['seconds']:.3g}",
            str(row["newton"]),
        )
        for row in report["rows"]
    ]
    return [*_first(problem, report), *_limits(problem, report), *table(heads, every)]


def _first(problem: str, report: Report) -> list[str]:
    """The first mesh of each ladder within the error that is asked for."""
    near, rows = WITHIN[problem], []
    for (code, ladder), rungs in ladders(report).items():
        found = next((row for row in rungs if error(row, report) <= near), None)
        if found is None:
            last = rungs[-1]
            words = (
                f"no: {error(last, report):.2g} % with {last['mesh']}",
                f"{last['dof']:,}",
                f"{last['seconds']:.3g}",
                "",
            )
        else:
            quick = "yes" if found["seconds"] <= QUICK else "no"
            words = (found["mesh"], f"{found['dof']:,}", f"{found['seconds']:.3g}", quick)
        rows.append((code, ladder, *words))
    heads = (
        "element",
        "ladder",
        f"first mesh within {near:g} %",
        "degrees of freedom",
        "seconds",
        f"under {QUICK:g} s",
    )
    return table(heads, rows)


def _limits(problem: str, report: Report) -> list[str]:
    """What the finest three rungs of each ladder extrapolate to."""
    limits, rows = report["limits"], []
    for (code, ladder), rungs in ladders(report).items():
        if len(rungs) < 3 or (problem == "block") != (ladder == "graded"):
            continue
        answer, order = extrapolated(rungs, "answer")
        words = [code, f"{answer:.6g}", f"{abs(answer / limits['answer'] - 1):.1e}", f"{order:.2f}"]
        if "energy" in limits:
            energy, _ = extrapolated(rungs, "energy")
            words += [f"{energy:.6g}", f"{abs(energy / limits['energy'] - 1):.1e}"]
        rows.append(tuple(words))
    energy_heads = ("energy extrapolated, J", "from the limit") if "energy" in limits else ()
    return table(("element", "extrapolated", "from the limit", "order", *energy_heads), rows)


def write_page() -> Path:
    """docs/elements.md from what was measured; a problem that was not is left out."""
    pieces = [
        "# Which element",
        "",
        "Written by `scripts/element_ladder cantilever --docs` and `scripts/element_ladder block --docs`.",
        "",
    ]
    for problem, words in (("cantilever", cantilever_words), ("block", block_words)):
        file = DOCS / "benchmarks" / f"element_ladder_{problem}.json"
        if not file.is_file():
            continue
        report = json.loads(file.read_text())
        draw(problem, report, DOCS / "pictures" / PICTURES[problem])
        pieces += [f"## {TITLES[problem].partition(':')[0].partition(',')[0]}", "", *words(report), ""]
        pieces += [
            f"![{TITLES[problem]}, error against degrees of freedom and seconds](pictures/{PICTURES[problem]})",
            "",
        ]
        pieces += [_machine(report), "", *lines_of(problem, report)]
    limits = DOCS / "benchmarks" / limits_page.FILE
    if limits.is_file():
        pieces += ["", *limits_page.lines_of(json.loads(limits.read_text()))]
    page = DOCS / "elements.md"
    page.write_text("\n".join(pieces).rstrip() + "\n")
    return page


def _machine(report: Report) -> str:
    made = report["machine"]
    return (
        f"{made['processor']}, one core of {made['cores']}, load before {made['load_before']}; commit {report['commit']}, "
        f"{report['date']}. Seconds are those of whole runs, kernels compiled."
    )


def _row(report: Report, code: str, ladder: str, at: int) -> Row:
    return ladders(report)[code, ladder][at]


def _told(row: Row, report: Report) -> str:
    return f"{error(row, report):.2g} % with {row['dof']:,} degrees of freedom in {row['seconds']:.2g} s"


def cantilever_words(report: Report) -> list[str]:
    """What a user needs to know, with the numbers that were measured."""
    limits = report["limits"]
    locked, brick = _row(report, "3413", "uniform", -1), _row(report, "3813", "uniform", -1)
    graded, few = _row(report, "3843", "graded", -1), _row(report, "3843", "graded", 0)
    quadratic = _row(report, "3-10-1-3", "graded", -1)
    return [
        f"The beam of `cases/cantilever`; the limit is {limits['answer']:.5f} m and {limits['energy']:.4f} J of strain energy.",
        "",
        "- **Take 3843 where parallelepipeds fit, else 3443+4 or 3-10-1-3.** The extrapolated ladders are in the second table.",
        f"- **Locking.** 3413 is still off by {_told(locked, report)}; its results are too far from convergence to extrapolate;"
        f" 3813 is off by {_told(brick, report)}.",
        f"- **Grading** towards the clamp: 3843 is off by {_told(few, report)}, and by {_told(graded, report)}."
        f" Quadratic tetrahedra dislike the long cells of these meshes: 3-10-1-3 is off by {_told(quadratic, report)}.",
        "- Stars in the picture are graded meshes; the dotted lines are 0.2 % and 20 s.",
    ]


def block_words(report: Report) -> list[str]:
    """What the ladders of the block say, and how much of it hangs on the limit."""
    limits, last = report["limits"], ("3-10-1-3", "3443", "3413")
    told = "; ".join(f"{code} is off by {_told(_row(report, code, 'graded', -1), report)}" for code in last)
    even = _row(report, "3-10-1-3", "uniform", -1)
    heads = ("limit fitted to", "N", "3-10-1-3 within 1 % from", "3443 within 1 % from")
    rows = []
    for name, limit in limits_of(report["rows"]).items():
        other = {**report, "limits": {"answer": limit}}
        rows.append((name, f"{limit:.1f}", *(_reached(code, other) for code in ("3-10-1-3", "3443"))))
    return [
        "One polyhedron for all meshes and elements. Along the ladder edges shorten in the volume, with the square of that at",
        "the bonded rims and with its third power at the root of the groove, where the stress is singular. A mesh is named by",
        "its edges in the volume, at the rims and at the root.",
        "",
        f"- **Take {_preferred(report)}.**",
        f"- **The limit is known to {100 * limits['uncertain'] / abs(limits['answer']):.1g} % only**: errors below are from"
        f" {limits['answer']:.6g} N, and which elements are within 1 % depends on the limit chosen, as the first table shows.",
        f"- On the finest graded meshes {told}.",
        f"- With edges of one length 3-10-1-3 is off by {_told(even, report)}.",
        "",
        *table(heads, rows),
    ]


def _preferred(report: Report) -> str:
    """Which element is softer, that is nearer to any limit below both, for less: it needs no limit to be known."""
    quadratic, slopes = (ladders(report)[code, "graded"] for code in ("3-10-1-3", "3443"))
    finest = slopes[-1]
    equal = next((row for row in quadratic if row["answer"] >= finest["answer"]), None)
    if equal is None:
        return f"3443: 3-10-1-3 does not come as near as its {finest['answer']:.6g} N"

    def price(row: Row) -> str:
        return f"{row['answer']:.6g} N for {row['dof']:,} degrees of freedom and {row['seconds']:.3g} s"

    words = f"3-10-1-3 gives {price(equal)}, 3443 {price(finest)}; forces fall towards the limit"
    return f"{'3-10-1-3' if equal['seconds'] < finest['seconds'] else '3443'}, whatever the limit: {words}"


def _reached(code: str, report: Report) -> str:
    """Degrees of freedom and seconds of the first graded mesh that is near enough."""
    near = WITHIN["block"]
    row = next((row for row in ladders(report)[code, "graded"] if error(row, report) <= near), None)
    if row is None:
        return "none of these"
    return f"{row['dof']:,} degrees of freedom, {row['seconds']:.0f} s"
