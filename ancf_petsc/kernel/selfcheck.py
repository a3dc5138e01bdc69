"""Whether machine code does what its source says: each kernel on one cell, compiled and run by Python."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from ancf_petsc.element.element import Element
from ancf_petsc.kernel.samples import Call, common_calls, law_calls
from ancf_petsc.material.models import Law

ROUNDING = {np.float64: 1e-9, np.float32: 1e-4}
"""Of the largest number of an array: machine code adds in another order, and fuses products and sums."""


def wrong_kernels(element: Element, laws: Sequence[Law], **flags: bool) -> list[str]:
    """Names of the kernels whose machine code gives other numbers than Python does. All laws are loaded before any is tried.

    flags: of `warmup.Variant`.
    """
    for law in laws:
        for kernel, arguments in law_calls(element, law, **flags):
            kernel(*arguments)
    wrong = _differing(common_calls(element), common_calls(element))
    for law in laws:
        wrong += _differing(law_calls(element, law, **flags), law_calls(element, law, **flags))
    return wrong


def _differing(compiled: Iterable[Call], interpreted: Iterable[Call]) -> list[str]:
    wrong = []
    for (kernel, arguments), (_, same) in zip(compiled, interpreted, strict=True):
        with np.errstate(all="ignore"):
            answers = kernel(*arguments), getattr(kernel, "py_func", kernel)(*same)
        left, right = list(_numbers((answers[0], arguments))), list(_numbers((answers[1], same)))
        single = any(array.dtype == np.float32 for array in left)
        tolerance = ROUNDING[np.float32 if single else np.float64]
        if not all(_agree(a, b, tolerance) for a, b in zip(left, right, strict=True)):
            wrong.append(getattr(kernel, "py_func", kernel).__qualname__)
    return wrong


def _numbers(item: Any) -> Iterator[np.ndarray]:
    """All arrays and numbers in nested tuples."""
    if isinstance(item, tuple):
        for entry in item:
            yield from _numbers(entry)
    elif item is not None:
        yield np.asarray(item)


def _agree(a: np.ndarray, b: np.ndarray, tolerance: float) -> bool:
    size = np.abs(b[np.isfinite(b)].astype(float)).max(initial=0.0)
    return np.allclose(a, b, rtol=0.0, atol=tolerance * size, equal_nan=True)
