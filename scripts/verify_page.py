"""docs/verification.md from docs/verification/checks.json, mutations.json and fuzz.json."""

from __future__ import annotations

import json
from itertools import groupby
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent.parent / "docs"
CHECKS, MUTATIONS = DOCS / "verification" / "checks.json", DOCS / "verification" / "mutations.json"
FUZZ = DOCS / "verification" / "fuzz.json"
PAGE = DOCS / "verification.md"
HEAD = """# Verification

*Made by `scripts/verify` from `docs/verification/`; do not edit.* `scripts/verify` computes every number under *found* again and
ends with exit code 1 if an error is beyond its bound. `scripts/fuzz` makes the table of damaged inputs, `scripts/mutate` that of
wrong changes.
"""


def number(value: float | None) -> str:
    """Ten digits at most; errors are written by `brief`."""
    return "" if value is None else f"{value:.10g}"


def brief(value: float | None) -> str:
    return "" if value is None else f"{value:.2g}"


def cell(text: str) -> str:
    """Text that does not break a table."""
    return text.replace("|", "\\|").replace("\n", " ")


def checks_part(data: dict[str, Any]) -> list[str]:
    """A heading a section, a table a check."""
    lines = [f"Computed by ancf_petsc {data['version']}, {data['versions']}.", ""]
    rows = sum(len(check["rows"]) for check in data["checks"])
    failed = [row for check in data["checks"] for row in check["rows"] if not row["holds"]]
    lines += [f"{rows - len(failed)} of {rows} numbers are within their bounds.", ""]
    for section, checks in groupby(data["checks"], key=lambda check: check["section"]):
        lines += [f"## {section}", ""]
        for check in checks:
            lines += [f"**{check['name'].replace('_', ' ').capitalize()}**. Source: {check['source']}.", ""]
            lines += ["| what | found | reference | error | bound | note |", "|---|---|---|---|---|---|"]
            for row in check["rows"]:
                unit = f" {row['unit']}" if row["unit"] else ""
                reference = f"{number(row['reference'])}{unit}" if row["reference"] is not None else ""
                found = number(row["found"]) if row["reference"] is not None else brief(row["found"])
                error = brief(row["error"]) if row["reference"] is not None else ""
                note = row["note"] if row["holds"] else f"**beyond its bound** {row['note']}"
                words = (row["what"], f"{found}{unit}", reference, error, brief(row["bound"]), note)
                lines.append("| " + " | ".join(cell(word) for word in words) + " |")
            lines.append("")
    return lines


def mutations_part(rows: list[dict[str, Any]]) -> list[str]:
    """Wrong changes: survivors first, then which test caught each."""
    survivors = [row for row in rows if not row["caught_by"]]
    caught = len(rows) - len(survivors)
    lines = [
        "## Wrong changes that the tests see",
        "",
        f"`scripts/mutate` applies {len(rows)} wrong changes to the source, one at a time, and runs the tests: {caught} are caught "
        f"({100 * caught / max(len(rows), 1):.0f} %).",
        "",
    ]
    if survivors:
        lines += [
            "Those that no test tried catches:",
            "",
            "| change | file | what it breaks | why it survives |",
        ]
        lines += ["|---|---|---|---|"]
        for row in survivors:
            words = (row["name"], f"`{row['file']}`", row["breaks"], row["why"])
            lines.append("| " + " | ".join(cell(word) for word in words) + " |")
        lines.append("")
    lines += ["| change | file | what it breaks | caught by |", "|---|---|---|---|"]
    for row in rows:
        if row["caught_by"]:
            test = row["caught_by"].removeprefix("tests/")
            words = (row["name"], f"`{row['file']}`", row["breaks"], f"`{test}`")
            lines.append("| " + " | ".join(cell(word) for word in words) + " |")
    return [*lines, ""]


WHAT = {
    "case": "case files: other keys, types, values, nesting, text",
    "msh_text": "Gmsh, text: 1, 2.2, 4.1",
    "msh_binary": "Gmsh, binary: 2.2, 4.1",
    "inp": "Abaqus and CalculiX",
    "bdf": "Nastran",
    "exodus": "Exodus: netCDF 3 and HDF5",
    "vtu": "VTU: text, plain, zlib, LZMA",
    "vtk": "VTK: text and binary, old and new",
    "xdmf": "XDMF: HDF5, XML, raw numbers",
    "med": "MED",
    "medit": "Medit: text and binary",
    "other": "CGNS, UGRID, AVS, TetGen, H5M, ...",
    "results": "folders of runs: plot, view, run --again, run into them",
}


def fuzz_part(data: dict[str, Any]) -> list[str]:
    """Damaged inputs: what became of those of each kind."""
    lines = [
        "## Damaged inputs",
        "",
        f"`scripts/fuzz` made {data['inputs']} inputs of valid ones (seed {data['seed']}): cut off, bytes and numbers changed, "
        "counts raised, lines and cards of other places, entities, links, bombs, devices in the place of files. "
        f"{data['findings']} of them ended otherwise than accepted or refused in one line with exit code 2, wrote or read where "
        "they must not, or were accepted with other cells than a second reader finds.",
        "",
        "| input | tried | accepted | refused | second reader: the same cells | does not read it | longest | most memory |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind, row in data["kinds"].items():
        second = row["second"]
        refused = sum(count for what, count in second.items() if what.startswith("second reader"))
        readers = (second.get("same", 0), refused) if second.get("same") else ("", "")
        accepted = row.get("accepted", 0) + row.get("ended early", 0)
        most = f"{row['longest_seconds']:.1f} s", f"{row['most_memory_bytes'] / 2**20:.0f} MiB"
        words = (WHAT[kind], row["inputs"], accepted, row.get("refused", 0), *readers, *most)
        lines.append("| " + " | ".join(cell(str(word)) for word in words) + " |")
    return [*lines, ""]


def write_page() -> Path:
    """Write the page from what is there."""
    lines = [HEAD]
    if CHECKS.is_file():
        lines += checks_part(json.loads(CHECKS.read_text()))
    if FUZZ.is_file():
        lines += fuzz_part(json.loads(FUZZ.read_text()))
    if MUTATIONS.is_file():
        lines += mutations_part(json.loads(MUTATIONS.read_text()))
    PAGE.write_text("\n".join(lines).rstrip("\n") + "\n", encoding="utf-8")
    return PAGE
