"""The [[chart]] tables of a study file: kinds of charts and their keys."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from ancf_petsc.input.types import Name, Table, key, problem

Kind = Literal["work_precision", "convergence", "map", "values", "curves", "profile"]
Cost = Literal["solve_seconds", "seconds", "dof"]
Scale = Literal["linear", "log"]
Abscissa = Literal["linear", "log", "even"]

NEEDED = {
    "work_precision": ("quantity",),
    "convergence": ("quantity",),
    "map": ("x", "y"),
    "values": ("quantity", "x"),
    "curves": ("y",),
    "profile": (),
}
"""Keys that each kind cannot be drawn without."""
TAKEN = {
    "work_precision": ("cost",),
    "convergence": ("x",),
    "map": ("quantity", "x", "y", "panels", "factor", "predicted"),
    "values": ("x", "panels", "predicted", "x_scale", "y_scale", "relative"),
    "curves": ("x", "y", "panels", "predicted", "relative", "x_scale", "y_scale"),
    "profile": ("within", "cost"),
}
"""Keys that are not taken by every kind."""


def _several(value: object) -> object:
    """One name alone is a list of one."""
    return (value,) if isinstance(value, str) else value


Names = Annotated[tuple[Name, ...], BeforeValidator(_several)]


class PredictedSpec(Table):
    """What theory or a source says, to be drawn beside what was measured."""

    label: Name = key('a text in quotes; such as "Biot, nu = 0.35"')
    value: float | None = key("a number; a line across the chart", None)
    points: tuple[tuple[float, float], ...] | None = key("a list of [x, y]; a curve", None, min_length=2)
    quantity: Name | None = key("a quantity of the study; times factor it is the height at each x", None)
    factor: float = key("a number; of quantity", 1.0)
    power: float = key("a number; the exponent of quantity, such as -1.0", 1.0)
    panel: Any = key("a value of the key `panels`; the panel it belongs to", None)

    @model_validator(mode="after")
    def _check(self) -> PredictedSpec:
        given = [name for name in ("value", "points", "quantity") if getattr(self, name) is not None]
        if len(given) != 1:
            raise problem(
                f"{' and '.join(given) or 'nothing'} given",
                expected="exactly one of value, points, quantity",
                cure='such as { label = "Biot", value = 0.517 }',
            )
        return self


class ChartSpec(Table):
    """One [[chart]]. Keys of the study are written as under [vary]; columns are those of study.csv, or of a run's tables."""

    kind: Kind = key("a kind of chart")
    quantity: Name | None = key("a quantity of the study; a name under [quantity]", None)
    x: Name | None = key('a key of the study or a column; such as "mesh.size"', None)
    y: Names = key('a key of the study, or columns of the runs; such as "dynamics.step"', ())
    lines: Names = key('a key of the study, or several; such as "mesh.element"', ())
    panels: Name | None = key("a key of the study; one panel for each of its values", None)
    only: dict[str, Any] = key('values by key; such as { "mesh.element" = ["3413", "3843"] }', {})
    title: Name | None = key("a text in quotes", None)
    name: Annotated[str, Field(pattern=r"^[\w+=-]+$")] | None = key(
        "a name for files; letters, digits, _ and -", None
    )
    note: str = key("a text in quotes; a line below the chart", "")
    labels: dict[str, str] = key('words in place of values and columns; such as { "3413" = "linear" }', {})
    x_label: Name | None = key("a text in quotes", None)
    y_label: Name | None = key("a text in quotes", None)
    x_scale: Abscissa | None = key('"linear", "log" or "even"; "even" sets values at equal distances', None)
    y_scale: Scale | None = key('"linear" or "log"', None)
    predicted: tuple[PredictedSpec, ...] = key("a list of tables; what was predicted", ())
    cost: Annotated[tuple[Cost, ...], BeforeValidator(_several)] = key(
        'a list out of "solve_seconds", "seconds" (of the whole run), "dof"; such as ["seconds"]',
        ("solve_seconds", "dof"),
        min_length=1,
    )
    factor: float | None = key(
        "a number > 0; of a map, the value of quantity from which energy has grown", None, gt=0
    )
    within: tuple[float, ...] = key(
        "a list of errors; such as [0.05, 0.01]", (0.05, 0.01, 0.001), min_length=1
    )
    relative: bool = key("true to divide each line by its first value", False)

    @model_validator(mode="after")
    def _check(self) -> ChartSpec:
        for name in NEEDED[self.kind]:
            if not getattr(self, name):
                raise problem("missing", at=[name], expected=f"what a chart of kind {self.kind} draws")
        for name in sorted({name for names in TAKEN.values() for name in names} - {"quantity"}):
            if name in self.model_fields_set and name not in TAKEN[self.kind]:
                raise problem(f"a chart of kind {self.kind} does not take it", at=[name], cure="drop it")
        if self.x_scale == "even" and self.kind != "values":
            raise problem(
                at=["x_scale"], got="even", expected='"linear" or "log"', cure='kind = "values" takes it'
            )
        if self.factor is not None and not self.quantity:
            raise problem("missing", at=["quantity"], expected="the quantity that factor is a limit of")
        return self

    @property
    def file_name(self) -> str:
        """Of its files, without suffix."""
        return self.name or "_".join(filter(None, (self.kind, self.quantity)))
