"""Counting what became of inputs."""

from __future__ import annotations

from collections import Counter
from typing import Any

SHARES = {
    "case": 4000, "msh_text": 2400, "msh_binary": 1800, "inp": 2000, "bdf": 1800, "exodus": 1400, "vtu": 1600, "vtk": 1200,
    "xdmf": 1600, "med": 800, "medit": 700, "other": 1200, "results": 500,
}  # fmt: skip
"""Inputs of each kind out of their sum."""


def outcome(answer: dict[str, Any]) -> str:
    if answer["wrong"]:
        return "finding"
    return {0: "accepted", 2: "refused", 3: "ended early"}.get(answer["code"], str(answer["code"]))


def tally(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts by kind and outcome, by damage and outcome, what second readers say."""
    kinds: dict[str, Any] = {}
    for kind in SHARES:
        own = [row for row in rows if row["kind"] == kind]
        if own:
            seconds = [row["second"].partition(":")[0] for row in own if row["second"]]
            kinds[kind] = {
                "inputs": len(own),
                **Counter(row["outcome"] for row in own),
                "second": dict(sorted(Counter(seconds).items())),
                "longest_seconds": max(row["seconds"] for row in own),
                "most_memory_bytes": max(row["grown"] for row in own),
            }
    meshes = [row for row in rows if row["kind"] not in ("results", "case")]
    damages = Counter(name for row in meshes for name in row["damage"])
    return {
        "inputs": len(rows),
        "findings": sum(row["outcome"] == "finding" for row in rows),
        "kinds": kinds,
        "damages": dict(sorted(damages.items())),
    }


def shown(table: dict[str, Any]) -> str:
    lines = [f"{table['inputs']} inputs, {table['findings']} findings"]
    for kind, row in table["kinds"].items():
        counts = ", ".join(
            f"{value} {key}"
            for key, value in row.items()
            if key in ("accepted", "refused", "ended early", "finding")
        )
        most = f"{row['longest_seconds']:.1f} s, {row['most_memory_bytes'] / 2**20:.0f} MiB"
        lines.append(
            f"{kind:<11}{row['inputs']:>6}: {counts}; second reader: {row['second']}; at most {most}"
        )
    return "\n".join(lines)
