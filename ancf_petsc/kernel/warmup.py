"""Compiling all kernels of a law ahead of a run, on one cell, with the types a run has."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.element.element import Element
from ancf_petsc.jit import CACHE_FOLDER, digest
from ancf_petsc.kernel.choice import kernel_set
from ancf_petsc.kernel.samples import Call, common_calls, law_calls
from ancf_petsc.material.models import LAWS, Law


class Variant(NamedTuple):
    """Which kernels, the flags of this module: those between two states too (mean), the loops over steps of motions (moving), of
    a body of revolution."""

    mean: bool = False
    moving: bool = False
    axisymmetric: bool = False


def is_compiled(element: Element, laws: Sequence[Law], **flags: bool) -> bool:
    """Whether the machine code of the element with all these laws is in the cache. flags: of `Variant`."""
    return all(_mark(element, law, Variant(**flags)).exists() for law in laws)


def compile_kernels(element: Element, laws: Sequence[Law], **flags: bool) -> None:
    """Compile the kernels of an element for each law, or load them from the cache. flags: of `Variant`."""
    _make(common_calls(element))
    for law in laws:
        _make(law_calls(element, law, **flags))
        _mark(element, law, Variant(**flags)).touch()


def compiled_sets() -> Iterator[tuple[Element, list[Law], dict[str, bool]]]:
    """What the cache holds: an element of each kind, the laws, the flags of `Variant` of kernels that are there."""
    representatives = {
        kernel_set(element, axisymmetric=axisymmetric): (element, axisymmetric)
        for element in reversed(ELEMENTS.values())
        for axisymmetric in ((False, True) if element.is_plane else (False,))
    }
    for (element, axisymmetric), mean, moving in product(
        representatives.values(), (False, True), (False, True)
    ):
        flags = {"mean": mean, "moving": moving, "axisymmetric": axisymmetric}
        laws = [law for law in LAWS.values() if is_compiled(element, [law], **flags)]
        if laws:
            yield element, laws, flags


def clear_cache() -> None:
    """Remove all machine code of this version of the program."""
    for entry in CACHE_FOLDER.iterdir():
        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()


def _make(calls: Iterable[Call]) -> None:
    for kernel, arguments in calls:
        kernel(*arguments)


def _mark(element: Element, law: Law, variant: Variant) -> Path:
    """The file that says: compiled. Elements of one kernel set share their machine code."""
    kernels = kernel_set(element, axisymmetric=variant.axisymmetric).name
    more = f"{'.mean' * variant.mean}{'.motion' * variant.moving}"
    return CACHE_FOLDER / f"{kernels}.{law.name}-{digest(law.tangent)}{more}.compiled"
