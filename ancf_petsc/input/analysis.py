"""The tables that say how a case moves on: [statics], [dynamics], [initial]."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ancf_petsc.input.methods import METHODS
from ancf_petsc.input.types import Table, Vector, key, one_of, problem


def _rising(values: tuple[float, ...], name: str) -> None:
    if any(a >= b for a, b in zip(values, values[1:], strict=False)):
        raise problem(at=[name], got=values, expected="numbers that rise", cure="sort them, each once")


class StaticsSpec(Table):
    """[statics]: pseudo-time s from 0 to 1. At most one of steps, times, strokes."""

    steps: int | None = key("a whole number >= 1; outputs at s = k/steps", None, ge=1)
    times: tuple[Annotated[float, Field(gt=0, le=1)], ...] | None = key(
        "a rising list of numbers in (0, 1]; such as [0.1, 1.0]", None, min_length=1
    )
    strokes: tuple[Annotated[float, Field(gt=0)], ...] | None = key(
        "a rising list of numbers > 0; magnitudes of output.curve.stroke", None, min_length=1
    )
    tolerance: float = key("a number in (0, 1); relative, such as 1e-10", 1e-10, gt=0, lt=1)
    smallest_step: float = key("a number in (0, 1]; of pseudo-time, such as 1e-4", 1e-4, gt=0, le=1)

    @model_validator(mode="before")
    @classmethod
    def _default_steps(cls, data: Any) -> Any:
        choices = ("steps", "times", "strokes")
        return (
            {"steps": 25, **data} if isinstance(data, dict) and not any(c in data for c in choices) else data
        )

    @model_validator(mode="after")
    def _check(self) -> StaticsSpec:
        given = [name for name in ("steps", "times", "strokes") if getattr(self, name) is not None]
        if len(given) > 1:
            raise problem(
                f"{' and '.join(given)} given",
                at=[given[1]],
                expected="one of steps, times, strokes",
                cure="drop one",
            )
        _rising(self.times or (), "times")
        _rising(self.strokes or (), "strokes")
        return self


class CriticalMode(Table):
    """damping = { critical = n }: of the n-th mode (from 1) of the unloaded tangent."""

    critical: int = key("a whole number >= 1", ge=1)


class DynamicsSpec(Table):
    """[dynamics]: motion over `duration`. A step, or a tolerance where the integrator adapts its step."""

    duration: float = key("a number > 0; in the unit of time", gt=0)
    integrator: Annotated[str, one_of(METHODS, "an integrator")] = key(
        'an integrator; such as "generalized_alpha"', "generalized_alpha"
    )
    step: float | None = key("a number > 0; in the unit of time", None, gt=0)
    tolerance: float | None = key("a number in (0, 1); relative, such as 1e-7", None, gt=0, lt=1)
    spectral_radius: float = key("a number in [0, 1]; such as 0.8", 0.8, ge=0, le=1)
    theta: float = key("a number in [0.5, 1]; 0.5 is the trapezoidal rule", 0.5, ge=0.5, le=1)
    order: int = key("1 or 2; orders above 2 are unstable for undamped structures", 2, ge=1, le=2)
    mass: Literal["consistent", "lumped"] = key("a kind of mass matrix", "consistent")
    damping: Annotated[float, Field(ge=0)] | Literal["critical"] | CriticalMode = key(
        'a number >= 0, "critical" or { critical = n }; in 1 / unit of time', 0.0
    )
    outputs: int = key("a whole number >= 1; of equal intervals", 100, ge=1)

    @model_validator(mode="before")
    @classmethod
    def _default_tolerance(cls, data: Any) -> Any:
        asks = isinstance(data, dict) and data.get("integrator") == "runge_kutta_5dp"
        return {"tolerance": 1e-7, **data} if asks and not {"step", "tolerance"} & data.keys() else data

    @model_validator(mode="after")
    def _check(self) -> DynamicsSpec:
        name = self.integrator
        if self.step is not None and self.tolerance is not None:
            raise problem(
                "step and tolerance given",
                at=["tolerance"],
                got=self.tolerance,
                expected="one of them",
                cure="drop one",
            )
        if self.tolerance is not None and not METHODS[name].adaptive:
            adaptive = ", ".join(row.name for row in METHODS.values() if row.adaptive)
            raise problem(
                at=["tolerance"],
                got=self.tolerance,
                expected=f"a step: {name} does not adapt it",
                cure=f"write step = ...; these adapt: {adaptive}",
            )
        if self.step is None and self.tolerance is None:
            raise problem("missing", at=["step"], expected=f"a step for {name}", cure="such as step = 1e-3")
        for row in METHODS.values():
            if row.option in self.model_fields_set and row.name != name:
                raise problem(
                    f"{name} does not read it",
                    at=[row.option],
                    got=getattr(self, row.option),
                    expected=f'integrator = "{row.name}" with it',
                    cure="drop it or change the integrator",
                )
        return self


class InitialSpec(Table):
    """[initial]: what a motion starts with."""

    velocity: Vector = key("three numbers; such as [1.0, 0.0, 0.0]", (0.0, 0.0, 0.0))
    spin: Vector = key("three numbers; rad / unit of time, about `centre`", (0.0, 0.0, 0.0))
    centre: Literal["mass"] | Vector = key('"mass" or a point [x, y, z]', "mass")
