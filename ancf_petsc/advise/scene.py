"""The case that advice computes with: the same scene, followed no farther than the quantity needs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.advise.question import KEY
from ancf_petsc.errors import CaseError, writing
from ancf_petsc.input import toml
from ancf_petsc.input.load import Case, load_case
from ancf_petsc.model.ramp import make_ramp
from ancf_petsc.plan.outputs import output_times
from ancf_petsc.studies.columns import check_quantity, nearest, outputs
from ancf_petsc.studies.spec import END, OutputAt, QuantitySpec

PRESCRIBED = ("constraint", "load")


def working_case(case: Case, asked: QuantitySpec, folder: Path) -> tuple[Case, QuantitySpec, bool]:
    """The case written to folder/case.toml, what is asked of it, and whether its steps are free to be chosen.

    A load path that is followed to one output ends there: ramps are cut to lines up to their values at that output, which for
    elastic bodies is the same state. Raises CaseError where the case has no such column or output.
    """
    data = toml.parse(case.text)
    mesh = data["mesh"]
    if "file" in mesh:
        mesh["file"] = str((case.folder / mesh["file"]).resolve())
    at, free = asked.at, False
    if case.spec.statics is not None and at is not None and case.spec.statics.control == "load":
        end = _pseudo_time(case, asked, at)
        _cut(data, case, end)
        asked, free = QuantitySpec(column=asked.column, at=OutputAt(END)), True
    else:
        _check(asked, case)
    file = folder / "case.toml"
    with writing(folder, "--out"):
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(toml.write(data), encoding="utf-8")
    return load_case(file), asked, free


def _check(asked: QuantitySpec, case: Case) -> None:
    """Raise CaseError, in words of the command line, where the case has no such column or output."""
    try:
        check_quantity("", asked, case.spec, case.folder)
    except CaseError as error:
        raise CaseError(
            error.problem, key=KEY, got=error.got, expected=error.expected, cure=error.cure
        ) from error


def _pseudo_time(case: Case, asked: QuantitySpec, at: OutputAt) -> float:
    """Where on its path a static case reaches what is asked for. Raises CaseError."""
    _check(QuantitySpec(column=asked.column, at=OutputAt(END)), case)
    if at.column == END:
        return 1.0
    if at.column == "pseudo_time" and 0.0 < at.value <= 1.0:
        return at.value
    if at.column == "stroke":
        found = _time_of_stroke(case, at.value)
        if found is not None:
            return found
    _check(asked, case)
    times, points = output_times(case.spec), outputs(case.spec, at.column)
    index = None if points is None else nearest(points, at.value)
    if index is None:
        cure = "drive output.curve.stroke, or ask at a pseudo_time"
        raise CaseError("the path to this stroke is not known", key=KEY, got=at.value, cure=cure)
    return times[index]


def _time_of_stroke(case: Case, stroke: float) -> float | None:
    """The pseudo-time at which the driven group first comes to a stroke, else to that of the other sign; None where to neither."""
    curve = case.spec.output.curve
    if curve is None:
        return None
    axis: Any = curve.stroke.axis
    drivers = [row for row in case.spec.constraint if row.group == curve.stroke.group and row.move.get(axis)]
    if not drivers:
        return None
    ramp, factor = make_ramp(drivers[0].ramp, "linear"), stroke / drivers[0].move[axis]
    factor = float(np.clip(factor, -1.0, 1.0)) if abs(factor) <= 1 + 1e-12 else factor
    return next((s for s in (ramp.first_time(factor), ramp.first_time(-factor)) if s), None)


def _cut(data: dict[str, Any], case: Case, end: float) -> None:
    """Let every ramp end at its value at `end`, on a line."""
    tables = {"constraint": case.spec.constraint, "load": case.spec.load}
    for name in PRESCRIBED:
        for entry, spec in zip(data.get(name, ()), tables[name], strict=True):
            ramp = make_ramp(spec.ramp, "linear")
            if name == "load" or getattr(spec, "move", None):
                entry["ramp"] = [[0.0, ramp.value(0.0)], [1.0, ramp.value(end)]]
    statics = data.setdefault("statics", {})
    for key in ("times", "strokes"):
        statics.pop(key, None)


def steps_of(case: Case) -> int:
    """How many outputs the user's own case has."""
    return len(output_times(case.spec)) if case.spec.statics else 0
