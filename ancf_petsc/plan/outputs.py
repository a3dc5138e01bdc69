"""When a case writes: times of a motion; steps, times or strokes of statics as pseudo-times."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ancf_petsc.errors import CaseError
from ancf_petsc.input.analysis import DynamicsSpec
from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.model.ramp import CLOSE, make_ramp, merged


def output_times(spec: CaseSpec, file: Path | None = None) -> list[float]:
    """Pseudo-times of the outputs of a static case, ascending, the last is 1."""
    statics = spec.statics
    assert statics is not None
    if statics.steps:
        return [k / statics.steps for k in range(1, statics.steps + 1)]
    times = statics.times or _stroke_times(spec, statics.strokes or (), file)
    return merged((*times, 1.0), CLOSE / max(1, len(times)))


def motion_times(spec: DynamicsSpec) -> list[float]:
    """Times of the outputs of a motion, ascending; the start is none of them."""
    return [spec.duration * k / spec.outputs for k in range(1, spec.outputs + 1)]


def output_points(spec: CaseSpec, file: Path | None = None) -> list[float]:
    """Pseudo-times of the outputs of any case, ascending, the last is 1."""
    if spec.dynamics is None:
        return output_times(spec, file)
    return [time / spec.dynamics.duration for time in motion_times(spec.dynamics)]


def _stroke_times(spec: CaseSpec, strokes: tuple[float, ...], file: Path | None) -> list[float]:
    """When the ramp of the driven group first reaches each stroke, in each of the directions it goes to."""
    curve = spec.output.curve
    assert curve is not None
    axis: Any = curve.stroke.axis
    driver = next(c for c in spec.constraint if c.group == curve.stroke.group and axis in c.move)
    amplitude = abs(driver.move[axis])
    ramp = make_ramp(driver.ramp, "linear")
    times = []
    for stroke in strokes:
        factor = stroke / amplitude
        factor = min(factor, 1.0) if factor <= 1 + 1e-12 else factor
        found = [s for s in (ramp.first_time(factor), ramp.first_time(-factor)) if s is not None]
        if not found:
            raise CaseError(
                file=file,
                key="statics.strokes",
                got=stroke,
                expected=f"a stroke that the motion of {driver.group!r} reaches",
                cure=f"it moves by {amplitude:g} at most",
            )
        times += found
    return [s for s in times if s > 0.0]
