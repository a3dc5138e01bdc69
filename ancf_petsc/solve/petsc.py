"""PETSc's options: the one place that reads and writes them.

The options of a case and of the command line have the last word: solvers set their defaults first and call
`setFromOptions` after. An option that no solver asked for is an error.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from petsc4py import PETSc

from ancf_petsc.errors import CaseError


@contextmanager
def petsc_options(given: Mapping[str, object]) -> Iterator[None]:
    """Put options into PETSc's database for the time of one run. Collective."""
    database = PETSc.Options()
    for name, value in given.items():
        database.setValue(name, _text(value))
    try:
        yield
    finally:
        for name in given:
            database.delValue(name)


@contextmanager
def default_options(defaults: Mapping[str, object]) -> Iterator[None]:
    """Options for the time of a `setFromOptions`, for what has no binding; those of case and command line
    stay stronger.
    """
    database = PETSc.Options()
    added = [name for name in defaults if not database.hasName(name)]
    for name in added:
        database.setValue(name, _text(defaults[name]))
    try:
        yield
    finally:
        for name in added:
            database.delValue(name)


@contextmanager
def refuse_wrong_values(given: Mapping[str, object]) -> Iterator[None]:
    """Raise CaseError for options whose values PETSc does not take. Around the making of solvers."""
    try:
        yield
    except PETSc.Error as error:
        if not given:
            raise
        said = str(error).splitlines()[-1].split("] ", 1)[-1]
        names = ", ".join(given)
        raise CaseError(
            f"PETSc refuses an option: {said}", key="petsc", got=names, cure="correct or drop it"
        ) from error


def is_given(name: str) -> bool:
    """Whether the case or the command line says anything about an option."""
    return PETSc.Options().hasName(name)


def begins_a_given_option(*prefixes: str) -> bool:
    """Whether the case or the command line gives an option that begins with one of these."""
    return any(name.startswith(prefixes) for name in PETSc.Options().getAll())


def unused_options(given: Mapping[str, object]) -> list[str]:
    """Names of the options that no PETSc object has asked for so far."""
    return [name for name in given if not _used(name)]


def refuse_unused(given: Mapping[str, object]) -> None:
    """Raise CaseError for options nobody asked for."""
    unused = unused_options(given)
    if unused:
        raise CaseError(
            "no solver of this run uses it",
            key=f"petsc.{unused[0]}",
            got=given[unused[0]],
            expected="an option of PETSc's SNES, TS, KSP, PC or MatPartitioning in use here",
            cure="take it out or correct its name" + (f" (and {len(unused) - 1} more)" if unused[1:] else ""),
        )


def _text(value: object) -> str:
    """As PETSc reads it; a bare option, such as -ksp_monitor, has no value."""
    if isinstance(value, bool):
        return "" if value else "false"
    return "" if value is None else str(value)


def _used(name: str) -> bool:
    """Whether PETSc was asked for the option. petsc4py 3.18 has no binding for it, its library does."""
    if hasattr(PETSc.Options, "used"):
        return bool(PETSc.Options().used(name))
    flag = ctypes.c_int(0)
    library = ctypes.CDLL(PETSc.__file__)
    library.PetscOptionsUsed(None, name.encode(), ctypes.byref(flag))
    return bool(flag.value)
