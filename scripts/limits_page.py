"""Sections of docs/elements.md from docs/benchmarks/element_limits.json, which `element_limits --docs` writes."""

from __future__ import annotations

from typing import Any

FILE = "element_limits.json"


def lines_of(report: dict[str, Any]) -> list[str]:
    """Lines of the sections near nu = 0.5 and on lumped mass."""
    return [*_near_a_half(report["pads"]), "", *_lumped(report["inertia"])]


def _near_a_half(rows: list[dict[str, Any]]) -> list[str]:
    ratios = sorted({row["poisson"] for row in rows})
    found = {(row["element"], row["shape"], row["poisson"]): row["error"] for row in rows}
    worst = {
        code: max(error for (other, _, nu), error in found.items() if other == code and nu <= 0.49)
        for code in ("3413", "3813", "3-10-1-3", "3843", "2412", "2432")
    }
    too_much = ", ".join(f"{100 * worst[code]:.0f}" for code in ("3413", "3813", "2412"))
    percent = {code: f"{100 * worst[code]:.1f} %" for code in ("3-10-1-3", "3843", "2432")}
    lines = [
        "## Near nu = 0.5",
        "",
        "Written by `scripts/element_limits --docs`. Bonded pads (in plane strain: strips) pressed by 1 % of their height, four",
        "cells through it; neo-Hooke. The shape factor is the area pressed over the area free to bulge. How much too large the",
        "force is, in per cent of that of cells half as long of 3-10-1-3 (of 2432 for strips), which are too stiff by one or two",
        "per cent themselves near 0.5.",
        "",
        f"- **3413, 3813 and, in plane strain, 2412 are far too stiff**: at nu = 0.49 the force is too large by up to {too_much} %",
        "  of the right one, at 0.499 by several times. From nu = 0.45 on `ancf run` and `ancf check` warn and name the element to",
        "  take.",
        f"- **Take 3-10-1-3** on the same tetrahedra ({percent['3-10-1-3']} at most up to 0.49), **3843** for bricks",
        f"  ({percent['3843']}), **2432** in the plane ({percent['2432']}).",
        "",
        "| element | shape factor | " + " | ".join(f"nu = {nu:g}" for nu in ratios) + " |",
        "|---|---|" + "---|" * len(ratios),
    ]
    shapes = {code: sorted({shape for other, shape, _ in found if other == code}) for code, _, _ in found}
    for code, several in shapes.items():
        for shape in several:
            errors = " | ".join(f"{100 * found[code, shape, nu]:.3g}" for nu in ratios)
            lines.append(f"| {code} | {shape:g} | {errors} |")
    return lines


def _lumped(inertia: dict[str, list[float]]) -> list[str]:
    lines = [
        "## Lumped mass and rotation",
        "",
        '`mass = "lumped"` keeps mass, centre and linear momentum of a body, and every node of a free one falls at g.',
        "Its moment of inertia, and with it angular momentum and kinetic energy of a spin, is too large by an amount that falls",
        "with the square of the size of cells: by how many per cent, for a cube (a square in the plane, a beam across its axis)",
        "about an axis through its centre. The angular momentum of a free body is conserved as with the consistent mass.",
        "",
        "| element | one cell an edge | 2 | 4 |",
        "|---|---|---|---|",
    ]
    return lines + [
        f"| {code} | " + " | ".join(f"{100 * value:.3g}" for value in values) + " |"
        for code, values in inertia.items()
    ]
