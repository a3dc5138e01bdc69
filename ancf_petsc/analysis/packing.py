"""A tree of state as JSON and arrays: what `state()` of the parts of a run gives, for a checkpoint's file, and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.parallel.fields import Field

FIELD, ARRAY, OF = "$field", "$array", "$of"
KINDS = {"f": "f8", "i": "i8", "u": "u1"}


class Packing:
    """Takes the fields and arrays out of trees, in the order in which they come, which is the same on all ranks."""

    def __init__(self) -> None:
        self.fields: list[Field] = []
        self.arrays: list[NDArray] = []

    def plain(self, value: Any) -> Any:
        """The tree in JSON's own types; numbers come back exactly. Raises TypeError."""
        if isinstance(value, Field):
            self.fields.append(value)
            return {FIELD: len(self.fields) - 1, OF: value.of}
        if isinstance(value, np.ndarray):
            self.arrays.append(value)
            return {ARRAY: len(self.arrays) - 1}
        if isinstance(value, dict):
            return {str(name): self.plain(item) for name, item in value.items()}
        if isinstance(value, list | tuple):
            return [self.plain(item) for item in value]
        if isinstance(value, np.generic):
            value = value.item()
        if not isinstance(value, str | int | float | bool | None):
            raise TypeError(f"{type(value).__name__} cannot be part of a checkpoint")
        return value


def kind_of(array: NDArray) -> str:
    """As `results/checkpoint_file` has it."""
    return KINDS[array.dtype.kind]


def unpacked(plain: Any, field: Callable[[int, str], NDArray], array: Callable[[int], NDArray]) -> Any:
    """The tree again: field(index, of) and array(index) give what was taken out, asked for in the order of the tree."""
    if isinstance(plain, list):
        return [unpacked(item, field, array) for item in plain]
    if not isinstance(plain, dict):
        return plain
    if FIELD in plain:
        return field(plain[FIELD], plain[OF])
    if ARRAY in plain:
        return array(plain[ARRAY])
    return {name: unpacked(item, field, array) for name, item in plain.items()}
