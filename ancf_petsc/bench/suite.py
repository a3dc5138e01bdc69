"""Running benchmarks one after the other, each in processes of its own, and judging them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from ancf_petsc.bench.machine import commit, machine, now
from ancf_petsc.bench.meshes import PROJECT
from ancf_petsc.bench.row import CUBE_74K, CUBE_480K, Row
from ancf_petsc.launcher import environment, on_ranks

LONGEST = 3600.0
Result = dict[str, Any]


def run_suite(
    rows: Sequence[Row], *, repetitions: int | None = None, tell: Callable[[Row, dict[str, Any]], None]
) -> dict[str, Any]:
    """Measure the yardstick and all rows. tell: called with a row and the report so far when it is done."""
    report: dict[str, Any] = {"date": now(), "commit": commit(), "machine": machine()}
    report["versions"] = launch("versions", {})["facts"]
    report["yardstick"] = yardstick(rows)
    results: dict[str, Result] = {}
    report["results"] = results
    for row in rows:
        found = _derived(row, results, report["yardstick"]) if row.of else _measured(row, repetitions)
        results[row.name] = judged(row, found)
        tell(row, report)
    return report


def yardstick(rows: Iterable[Row]) -> dict[str, Any]:
    """Copying and gathering on one process and on two at once, over the meshes of the rows that need it."""
    large = any("480k" in row.name for row in rows)
    found: dict[str, Any] = {}
    for mesh in (CUBE_74K, CUBE_480K) if large else (CUBE_74K,):
        results = [
            launch("yardstick", {"mesh": mesh, "repetitions": 5}, ranks=processes) for processes in (1, 2)
        ]
        gathers = [median(result["facts"]["gather_scatter_ns"]) for result in results]
        copies = [median(result["samples"]) for result in results]
        found[mesh] = {"copy_gb_s": copies, "gather_scatter_ns": gathers}
        found[mesh] |= {"copy_gain": copies[1] / copies[0], "gather_gain": gathers[0] / gathers[1]}
    return found


def launch(measure: str, task: dict[str, Any], *, ranks: int = 1) -> Result:
    """One measurement in processes of its own."""
    with tempfile.TemporaryDirectory() as place:
        asked, answered = Path(place) / "task.json", Path(place) / "result.json"
        asked.write_text(json.dumps({"measure": measure, **task}))
        module = ["-m", "ancf_petsc.bench.worker", str(asked), str(answered)]
        command = on_ranks(ranks, [sys.executable, *module])
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, env=environment(), timeout=LONGEST, check=False
            )
        except subprocess.TimeoutExpired:
            return {"problem": f"no answer within {LONGEST:.0f} s"}
        if not answered.is_file():
            lines = [line for line in done.stderr.splitlines() if "Error" in line]
            return {"problem": lines[-1] if lines else f"exit code {done.returncode}"}
        return json.loads(answered.read_text())


def _measured(row: Row, repetitions: int | None) -> Result:
    count = repetitions or row.repetitions
    if row.measure == "start":
        return _started(**row.task, repetitions=count)
    return launch(row.measure, {**row.task, "repetitions": count}, ranks=row.ranks)


def _started(words: Sequence[str], until: str, repetitions: int) -> Result:
    """Seconds from the command until it prints `until`; one start before warms the caches."""
    samples = []
    with tempfile.TemporaryDirectory() as place:
        for number in range(repetitions + 1):
            out = ["--out", f"{place}/{number}"] if words[0] == "run" else []
            command = [sys.executable, "-m", "ancf_petsc", *words, *out]
            begun = time.perf_counter()
            with subprocess.Popen(
                command, stdout=subprocess.PIPE, text=True, cwd=PROJECT, env=environment()
            ) as process:
                assert process.stdout is not None
                spoke = any(until in line for line in process.stdout)
                samples.append(time.perf_counter() - begun)
                process.terminate()
            if not spoke:
                return {"problem": f"ancf {' '.join(words)} did not print {until!r}"}
    return {"samples": samples[1:], "error": None, "facts": {}}


def _derived(row: Row, results: dict[str, Result], measured: dict[str, Any]) -> Result:
    """A value among another row's facts, or how many times faster it is than a third."""
    of = results[row.of]
    other = results.get(row.gain, of)
    if "problem" in of or "problem" in other:
        return {"problem": of.get("problem") or other["problem"]}
    if row.part:
        return {"samples": [of["facts"][row.part]], "error": of["error"], "facts": {}}
    gain = measured[CUBE_480K if "480k" in row.name else CUBE_74K]["copy_gain"]
    return {
        "samples": [other["median"] / of["median"]],
        "error": of["error"],
        "facts": {"yardstick_gain": gain},
    }


def judged(row: Row, result: Result) -> Result:
    """The result with median, spread (half the range over it), whether it is right and met its target.

    An answer that is wrong meets no target; one that nobody knows is no error.
    """
    known = {"about": row.about, "unit": row.unit, "ranks": row.ranks, "target": row.target, **result}
    if "problem" in result:
        return known | {"met": False if row.target is not None else None}
    samples = result["samples"]
    middle = median(samples)
    error, allowed = result["error"], row.allowed
    right = None if error is None or allowed is None else error <= allowed
    met = None
    if known["target"] is not None:
        fast = middle >= known["target"] if row.more else middle <= known["target"]
        met = fast and right is not False
    spread = (max(samples) - min(samples)) / 2 / middle if middle else 0.0
    return known | {"median": middle, "spread": spread, "allowed": allowed, "right": right, "met": met}
