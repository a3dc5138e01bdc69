"""docs/verification.md from docs/verification/*.json."""

from __future__ import annotations

import json
from itertools import groupby
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent.parent / "docs"
CHECKS, MUTATIONS = DOCS / "verification" / "checks.json", DOCS / "verification" / "mutations.json"
PLATFORMS, FUZZ = DOCS / "verification" / "platforms.json", DOCS / "verification" / "fuzz.json"
KILLS, LEAKS = DOCS / "verification" / "kills.json", DOCS / "verification" / "leaks.json"
PAGE = DOCS / "verification.md"
HEAD = """# Verification

*Made by `scripts/verify` from `docs/verification/`; do not edit.* `scripts/verify` computes every number under *found* again and
ends with exit code 1 if an error is beyond its bound. `scripts/test_debian` and `scripts/test_current_petsc` make the table of
platforms, `scripts/soak_kills` and `scripts/soak_leaks` those of kills and leaks, `scripts/fuzz` that of damaged inputs,
`scripts/mutate` the last one.
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


def platforms_part(rows: list[dict[str, Any]]) -> list[str]:
    """How the suite ended on each PETSc and MPI it was last run on."""
    lines = ["## Where the test suite ran", ""]
    lines += [
        "| PETSc, SLEPc | MPI | system, Python | numpy, h5py | PETSc has | date | passed | failed | skipped |"
    ]
    lines += ["|---|---|---|---|---|---|---|---|---|"]
    for row in rows:
        parallel = " with MPI" if row["h5py_with_mpi"] else " without MPI"
        words = (
            f"{row['petsc']}, {row['slepc']}",
            row["mpi"],
            f"{row['system']}, {row['python']}",
            f"{row['numpy']}, {row['h5py']}{parallel}",
            ", ".join(row["packages"]),
            row["date"],
            str(row["passed"]),
            f"**{row['failed']}**: {', '.join(row['failures'])}" if row["failed"] else "0",
            str(row["skipped"]),
        )
        lines.append("| " + " | ".join(cell(word) for word in words) + " |")
    return [*lines, ""]


def kills_part(rows: list[dict[str, Any]]) -> list[str]:
    """Runs that were killed, and what was lost."""
    lines = [
        "## Kills and power cuts",
        "",
        "`scripts/soak_kills` kills runs at random moments, on several ranks one of them or all, cuts files at random lengths as a "
        "power cut may, and lets each go on until it ends. Differences are those from the uninterrupted run on one rank: of all "
        "fields, over the largest number of each; no step is missing and none is there twice.",
        "",
        "| what | ranks | kills survived | power cuts | runs | equal to the last bit | largest difference |",
        "|---|---|---|---|---|---|---|",
    ]
    names = ("what", "ranks", "kills", "power_cuts", "runs", "equal_to_the_bit")
    for row in rows:
        words = (*(str(row[name]) for name in names), brief(row["largest_difference"]))
        lines.append("| " + " | ".join(map(cell, words)) + " |")
    return [*lines, ""]


def leaks_part(rows: list[dict[str, Any]]) -> list[str]:
    """What grew over many steps and runs."""
    lines = [
        "## Memory and handles",
        "",
        "`scripts/soak_leaks`: growth from the first quarter of the work to its end.",
        "",
        "| what | done | resident memory, MB | open files and threads |",
        "|---|---|---|---|",
    ]
    for row in rows:
        words = (row["what"], str(row["done"]), brief(row["memory_growth_mb"]), str(row["handles_growth"]))
        lines.append("| " + " | ".join(map(cell, words)) + " |")
    return [*lines, ""]


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
    several = ((PLATFORMS, platforms_part), (KILLS, kills_part), (LEAKS, leaks_part), (FUZZ, fuzz_part))
    for file, part in (*several, (MUTATIONS, mutations_part)):
        if file.is_file():
            lines += part(json.loads(file.read_text()))
    PAGE.write_text("\n".join(lines).rstrip("\n") + "\n", encoding="utf-8")
    return PAGE
