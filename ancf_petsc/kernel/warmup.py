"""Compiling all kernels of a law ahead of a run, on one cell, with the types a run has."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.element.element import Element
from ancf_petsc.jit import CACHE_FOLDER, digest
from ancf_petsc.kernel.choice import kernel_set
from ancf_petsc.kernel.samples import Call, common_calls, law_calls
from ancf_petsc.material.models import LAWS, Law


def is_compiled(element: Element, laws: Sequence[Law], *, mean: bool = False, moving: bool = False) -> bool:
    """Whether the machine code of the element with all these laws is in the cache."""
    return all(_mark(element, law, mean=mean, moving=moving).exists() for law in laws)


def compile_kernels(
    element: Element, laws: Sequence[Law], *, mean: bool = False, moving: bool = False
) -> None:
    """Compile the kernels of an element for each law, or load them from the cache.

    mean: those between two states too, for the energy-momentum step. moving: the loops over steps of motions.
    """
    _make(common_calls(element))
    for law in laws:
        _make(law_calls(element, law, mean=mean, moving=moving))
        _mark(element, law, mean=mean, moving=moving).touch()


def compiled_sets() -> Iterator[tuple[Element, list[Law], bool, bool]]:
    """What the cache holds: an element of each kind, the laws, whether kernels between two states and of motions are there."""
    representatives = {kernel_set(element): element for element in reversed(ELEMENTS.values())}
    for element in representatives.values():
        for mean in (False, True):
            for moving in (False, True):
                laws = [law for law in LAWS.values() if is_compiled(element, [law], mean=mean, moving=moving)]
                if laws:
                    yield element, laws, mean, moving


def clear_cache() -> None:
    """Remove all machine code of this version of the program."""
    for entry in CACHE_FOLDER.iterdir():
        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()


def _make(calls: Iterable[Call]) -> None:
    for kernel, arguments in calls:
        kernel(*arguments)


def _mark(element: Element, law: Law, *, mean: bool, moving: bool) -> Path:
    """The file that says: compiled. Elements of one kernel set share their machine code."""
    name = f"{kernel_set(element).name}.{law.name}-{digest(law.tangent)}{'.mean' * mean}{'.motion' * moving}.compiled"
    return CACHE_FOLDER / name
