"""The tables that say how a case moves on: [statics], [dynamics], [initial]."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, create_model, model_validator

from ancf_petsc.input.methods import METHODS, Method
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

    control: Annotated[str, one_of(lambda: ("load", "arc_length"), "a control")] = key(
        '"load" or "arc_length"; what leads along the path', "load"
    )
    on_bifurcation: Annotated[str, one_of(lambda: ("report", "stop", "follow"), "an answer")] = key(
        'one of "report", "stop", "follow"; what to do where equilibria lose their stability', "report"
    )

    after_limit: Annotated[str, one_of(lambda: ("stop", "dynamics"), "an answer")] = key(
        'one of "stop", "dynamics"; what to do where the path ends', "stop"
    )

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
        if self.after_limit != "stop" and self.control != "load":
            raise problem(
                "arc_length goes past limits by itself",
                at=["after_limit"],
                got=self.after_limit,
                expected='"stop", or control = "load"',
                cure="drop one",
            )
        _rising(self.times or (), "times")
        _rising(self.strokes or (), "strokes")
        return self


class CriticalMode(Table):
    """damping = { critical = n }: of the n-th mode (from 1) of the unloaded tangent."""

    critical: int = key("a whole number >= 1", ge=1)


def own_keys() -> dict[str, Any]:
    """The keys that are one integrator's own: whole numbers where the default is one."""
    options = [row.option for row in METHODS.values() if row.option]
    return {
        row.name: (type(row.default), key(row.expected, row.default, ge=row.least, le=row.most))
        for row in options
    }


OwnKeys = create_model("OwnKeys", __base__=Table, **own_keys())


class DynamicsSpec(OwnKeys):  # type: ignore[misc, valid-type]
    """[dynamics]: motion over `duration`. A step, or a tolerance where the integrator adapts its step."""

    duration: float = key("a number > 0; in the unit of time", gt=0)
    integrator: Annotated[str, one_of(lambda: METHODS, "an integrator")] = key(
        'an integrator; such as "generalized_alpha"', "generalized_alpha"
    )
    step: float | None = key("a number > 0; in the unit of time", None, gt=0)
    tolerance: float | None = key("a number in (0, 1); relative, such as 1e-7", None, gt=0, lt=1)
    mass: Literal["consistent", "lumped"] = key("a kind of mass matrix", "consistent")
    damping: Annotated[float, Field(ge=0)] | Literal["critical"] | CriticalMode = key(
        'a number >= 0, "critical" or { critical = n }; in 1 / unit of time', 0.0
    )
    outputs: int = key("a whole number >= 1; of equal intervals", 100, ge=1)

    @model_validator(mode="before")
    @classmethod
    def _default_tolerance(cls, data: Any) -> Any:
        row = METHODS.get(str(data.get("integrator"))) if isinstance(data, dict) else None
        if row is None or row.tolerance is None or {"step", "tolerance"} & data.keys():
            return data
        return {"tolerance": row.tolerance, **data}

    @property
    def method(self) -> Method:
        """The integrator's row."""
        return METHODS[self.integrator]

    @property
    def option(self) -> float:
        """The value of the integrator's own key, 0 where it has none."""
        return getattr(self, self.method.option.name) if self.method.option else 0

    @property
    def method_order(self) -> int | None:
        """The order of the integrator's error in the step; None where it is not known."""
        return self.method.order(self.option)

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
        if self.tolerance is not None and not self.method.adaptive:
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
            if row.option and row.option.name in self.model_fields_set and row.name != name:
                raise problem(
                    f"{name} does not read it",
                    at=[row.option.name],
                    got=getattr(self, row.option.name),
                    expected=f'integrator = "{row.name}" with it',
                    cure="drop it or change the integrator",
                )
        return self


class InitialSpec(Table):
    """[initial]: what a motion starts with."""

    velocity: Vector = key("three numbers; such as [1.0, 0.0, 0.0]", (0.0, 0.0, 0.0))
    spin: Vector = key("three numbers; rad / unit of time, about `centre`", (0.0, 0.0, 0.0))
    centre: Literal["mass"] | Vector = key('"mass" or a point [x, y, z]', "mass")
