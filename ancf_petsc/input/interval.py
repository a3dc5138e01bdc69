"""How often a run saves all it needs to go on: `output.checkpoint`."""

from __future__ import annotations

import re
from typing import NamedTuple

from ancf_petsc.input.types import problem

SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
EXPECTED = '"off", a time such as "10 min" (s, min, h), or steps such as "50 steps"'
PATTERN = re.compile(r"\s*(\d+(?:\.\d*)?)\s*(s|min|h|steps?)\s*")


class Interval(NamedTuple):
    """Of seconds or of steps; the other is 0, both for never."""

    seconds: float = 0.0
    steps: int = 0


def interval_of(text: str) -> Interval:
    """What a text says. Raises PydanticCustomError."""
    if text == "off":
        return Interval()
    found = PATTERN.fullmatch(text)
    number = float(found[1]) if found else 0.0
    if found and found[2] in SECONDS and number > 0.0:
        return Interval(seconds=number * SECONDS[found[2]])
    if found and number >= 1.0 and number == int(number):
        return Interval(steps=int(number))
    raise problem(got=text, expected=EXPECTED, cure='write "10 min", "50 steps" or "off"')


def checked(text: str) -> str:
    """The text, if it is an interval."""
    interval_of(text)
    return text
