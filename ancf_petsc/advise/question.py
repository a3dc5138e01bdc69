"""What advice is asked for: `force@stroke=0.010` within `1%`."""

from __future__ import annotations

import re

from ancf_petsc.errors import CaseError
from ancf_petsc.studies.spec import ABSCISSAS, END, REDUCTIONS, OutputAt, QuantitySpec

KEY = "--quantity"
FORMS = "COLUMN, COLUMN@stroke=VALUE (or time, pseudo_time) or COLUMN@max (min, mean, rms, drift)"


def read_quantity(text: str) -> QuantitySpec:
    """The quantity in `force@stroke=0.010`; a column alone is taken at the end. Raises CaseError."""
    column, _, place = text.rpartition("@") if "@" in text else (text, "", END)
    if not column or not place:
        raise CaseError(key=KEY, got=text, expected=FORMS, cure="such as force@stroke=0.010")
    if place in REDUCTIONS:
        return QuantitySpec(column=column, reduce=place)
    return QuantitySpec(column=column, at=_place(text, place))


def _place(text: str, place: str) -> OutputAt:
    if place == END:
        return OutputAt(END)
    name, _, number = place.partition("=")
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    if name not in ABSCISSAS or not abs(value) < float("inf"):
        raise CaseError(key=KEY, got=text, expected=FORMS, cure="such as force@stroke=0.010")
    return OutputAt(name, value)


def read_target(text: str) -> float:
    """The relative error in `1%` or `0.01`. Raises CaseError."""
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(%?)\s*", text)
    try:
        value = float(found[1]) / (100.0 if found[2] else 1.0) if found else 0.0
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1.0:
        raise CaseError(key="--within", got=text, expected="a part between 0 and 1, such as 1% or 0.01")
    return value
