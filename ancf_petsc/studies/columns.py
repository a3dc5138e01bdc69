"""Which columns and outputs the tables of a case's run will have: wrong questions are refused before anything runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.model.ramp import Ramp, make_ramp
from ancf_petsc.plan.outputs import motion_times, output_times
from ancf_petsc.studies.spec import OutputAt, QuantitySpec

SAME = 1e-9
"""Points of a path closer than this part of the largest are one."""
COUNTED = ("newton_iterations", "linear_iterations", "steps")
MOTION = ("kinetic_energy", "potential_energy", "dissipated_energy", "energy_drift", "rejected_steps")


def columns_of(spec: CaseSpec) -> tuple[str, ...]:
    """Names of the columns of curve.csv and probes.csv of a run."""
    names = ["time" if spec.dynamics else "pseudo_time"]
    if spec.output.curve:
        names += ["stroke", "force", "force_stress_area"]
    names += ["strain_energy", "external_work", "min_det_F", *COUNTED]
    if spec.statics and spec.statics.after_limit == "dynamics":
        names += ["dissipated_energy", "jumps"]
    if spec.dynamics:
        names += MOTION
        names += [f"{what}.{axis}" for what in ("momentum", "angular_momentum") for axis in AXES]
    groups = dict.fromkeys(row.group for row in spec.constraint)
    names += [f"{group}.r{axis}" for group in groups for axis in AXES]
    names += [f"{probe.name}.{how}{axis}" for probe in spec.probe for how in ("", "u") for axis in AXES]
    return tuple(names)


def check_quantity(name: str, asked: QuantitySpec, spec: CaseSpec, file: Path) -> None:
    """Raise CaseError where a run of the case will have no such column, or no output at the place asked for."""
    if asked.column is None:
        return
    known = columns_of(spec)
    if asked.column not in known:
        raise CaseError(
            "no such column",
            file=file,
            key=f"quantity.{name}.column",
            got=asked.column,
            expected="a column of curve.csv or probes.csv of this case",
            cure=did_you_mean(asked.column, known),
        )
    if asked.at is None or asked.at.column == "end":
        return
    points = outputs(spec, asked.at.column)
    if points is not None and nearest(points, asked.at.value) is None:
        raise CaseError(
            "no output there",
            file=file,
            key=f"quantity.{name}.at",
            got={asked.at.column: asked.at.value},
            expected=f"an output, for nothing is made up between them: {shown(asked.at.column, points)}",
            cure=how_to_ask(spec, asked.at),
        )


def outputs(spec: CaseSpec, column: str) -> list[float] | None:
    """Values of a column of time or stroke at the outputs, None where only the run can tell."""
    if spec.dynamics is not None:
        return motion_times(spec.dynamics) if column == "time" else _strokes(spec, None, column)
    if column == "time":
        return []
    times = output_times(spec)
    return times if column == "pseudo_time" else _strokes(spec, times, column)


def _strokes(spec: CaseSpec, times: Sequence[float] | None, column: str) -> list[float] | None:
    """Strokes at pseudo-times (all those of a motion for None) of a group that is driven."""
    curve = spec.output.curve
    if column != "stroke" or curve is None:
        return []
    if times is None:
        assert spec.dynamics is not None
        times = [time / spec.dynamics.duration for time in motion_times(spec.dynamics)]
    driver = _driver(spec)
    if driver is None:
        return None
    move, ramp = driver
    return [move * ramp.value(s) for s in times]


def _driver(spec: CaseSpec) -> tuple[float, Ramp] | None:
    """Move and ramp of the group whose stroke is recorded; None where nothing drives it, or only the run can tell how far."""
    curve = spec.output.curve
    if curve is None or spec.statics is not None and spec.statics.control == "arc_length":
        return None
    axis: Any = curve.stroke.axis
    drivers = [row for row in spec.constraint if row.group == curve.stroke.group and row.move.get(axis)]
    return (drivers[0].move[axis], make_ramp(drivers[0].ramp, "linear")) if drivers else None


def nearest(points: Sequence[float], wanted: float) -> int | None:
    """Index of the first of the points that is the wanted one, else of the first that is it but for its sign, None for none."""
    slack = SAME * max((abs(point) for point in (*points, wanted)), default=0.0)
    found = (
        index
        for size in (float, abs)
        for index, point in enumerate(points)
        if abs(size(point) - size(wanted)) <= slack
    )
    return next(found, None)


def shown(column: str, points: Sequence[float]) -> str:
    """The outputs there are, in a few words."""
    if not points:
        return f"the case has no {column}"
    words = [f"{abs(point):.6g}" for point in points]
    if len(words) > 8:
        words = [*words[:4], "...", *words[-2:]]
    return f"its outputs have {column} {', '.join(words)}"


def how_to_ask(spec: CaseSpec, at: OutputAt) -> str:
    """What makes the case write an output there."""
    if spec.dynamics is not None:
        return "choose dynamics.outputs and dynamics.duration so that an interval ends there"
    name = "strokes" if at.column == "stroke" else "times"
    if at.column == "time":
        return "a path of statics has pseudo_time, or stroke"
    reach = _reach(spec, at.column)
    if reach is not None and abs(at.value) > reach:
        return f"the path ends at a {at.column} of {reach:g}: ask for one up to there, or make the case go on to it"
    return f"ask for it by [statics] {name} = [{at.value:g}] in place of steps"


def _reach(spec: CaseSpec, column: str) -> float | None:
    """The largest pseudo-time, or stroke of a driven group, on a static path; None where only the run can tell."""
    if column == "pseudo_time":
        return 1.0
    driver = _driver(spec)
    if driver is None:
        return None
    move, ramp = driver
    return abs(move) * max((abs(factor) for _, factor in ramp.table), default=1.0)
