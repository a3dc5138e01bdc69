"""PETSc's options: the one place that reads and writes them.

The options of a case and of the command line have the last word: solvers set their defaults first and call
`setFromOptions` after. An option that no solver asked for is an error: at once where PETSc has none of that name,
else at the end of the run, for many are read during the solution only.
"""

from __future__ import annotations

import ctypes
import logging
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from difflib import get_close_matches
from functools import cache
from pathlib import Path

import numpy as np
import petsc4py
from mpi4py import MPI
from petsc4py import PETSc

from ancf_petsc.errors import CaseError, EnvironmentProblem
from ancf_petsc.launcher import is_general_option

PREFIX = re.compile(
    r"(system_|partition_|modes_|mg_(levels|coarse|fine)_(\d+_)?|sub_|redundant_|telescope_|inner_|npc_"
    r"|fieldsplit_[a-z0-9]+_|st_|smoother_)"
)
NUMBER = re.compile(r"\d+")
_REASONS = PETSc.SNES.ConvergedReason
NOT_FINITE: int = getattr(_REASONS, "DIVERGED_FUNCTION_NANORINF", None) or _REASONS.DIVERGED_FNORM_NAN
"""SNES's reason for a state whose residual is not a number; it has the first name from PETSc 3.25 on."""
READ_LATE = re.compile(r"view|reason|monitor|draw|plot|mat_|test|check")  # during the solution or after it
log = logging.getLogger("ancf")


@contextmanager
def petsc_options(given: Mapping[str, object]) -> Iterator[GivenOptions]:
    """Put options into PETSc's database for the time of one run. Collective.

    PETSc's general options, such as -log_view and -options_left, stay: it reads them at the end of the process.
    Raises EnvironmentProblem where PETSc computes with other numbers than this program.
    """
    if np.dtype(PETSc.ScalarType) != np.float64:
        raise EnvironmentProblem(
            f"{PETSc.__file__}: this PETSc computes with {np.dtype(PETSc.ScalarType)}; one with real numbers of "
            "double precision (float64) is needed: set PETSC_DIR and PETSC_ARCH to such a build, or install another"
        )
    database = PETSc.Options()
    for name, value in given.items():
        database.setValue(name, _text(value))
    if given.get("log_view") is not None and not PETSc.Log.isActive():
        PETSc.Log.begin()
    try:
        yield GivenOptions(given)
    finally:
        for name in given:
            if not is_general_option(name):
                database.delValue(name)


class GivenOptions:
    """The options of a run, and which of them nothing has asked for. PETSc's general options are left out."""

    def __init__(self, given: Mapping[str, object]) -> None:
        self.given = {name: value for name, value in given.items() if not is_general_option(name)}

    def unused(self, comm: MPI.Comm) -> list[str]:
        """Names of the options that no PETSc object of any rank has asked for so far. Collective."""
        used = comm.allgather([name for name in self.given if _used(name)])
        return [name for name in self.given if not any(name in names for names in used)]

    def refuse_unknown(self, comm: MPI.Comm) -> None:
        """Collective, after the solvers are set up: raise CaseError for an unused option whose name PETSc does not know.

        Others may be asked for during the solution, as -snes_converged_reason is; a warning names those of
        which that is not to be expected.
        """
        unused = self.unused(comm)
        unknown = [name for name in unused if not is_known_option(name)]
        if unknown:
            raise self._refusal(unknown, nearest_option(unknown[0]))
        late = [name for name in unused if not READ_LATE.search(name)]
        if late and comm.rank == 0:
            log.warning(
                "petsc.%s: no solver has asked for it so far; if none does, the run ends with an error",
                ", petsc.".join(late),
            )

    def refuse_unused(self, comm: MPI.Comm) -> None:
        """Collective, after the solution: raise CaseError for options nobody asked for."""
        if unused := self.unused(comm):
            known = is_known_option(unused[0])
            raise self._refusal(unused, "take it out" if known else nearest_option(unused[0]))

    def _refusal(self, names: list[str], cure: str) -> CaseError:
        return CaseError(
            "no solver of this run uses it",
            key=f"petsc.{names[0]}",
            got=self.given[names[0]],
            expected="an option of PETSc's SNES, TS, KSP, PC, Mat or MatPartitioning in use here",
            cure=cure + (f" (and {len(names) - 1} more)" if names[1:] else ""),
        )


@contextmanager
def default_options(defaults: Mapping[str, object]) -> Iterator[None]:
    """Options for the time of a `setFromOptions`, for what has no binding; those of case and command line
    stay stronger.
    """
    database = PETSc.Options()
    added = [name for name in defaults if not is_given(name)]
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
        values = ", ".join(f"{name} = {value}" for name, value in given.items())
        raise CaseError(
            f"PETSc refuses an option: {said}", key="petsc", got=values, cure="correct or drop it"
        ) from error


def has_package(name: str) -> bool:
    """Whether PETSc was built with a library."""
    return bool(PETSc.Sys.hasExternalPackage(name))


def direct_package(prefix: str = "") -> str:
    """The package that factors: MUMPS, unless an option with this prefix chooses another. Raises EnvironmentProblem
    where PETSc was built without it.
    """
    if not (has_package("mumps") or is_given(f"{prefix}pc_factor_mat_solver_type")):
        raise EnvironmentProblem(
            f"{PETSc.__file__}: this PETSc was built without MUMPS, which factors small and indefinite tangents: "
            "install one that has it (Debian's, conda-forge's, or PETSC_CONFIGURE_OPTIONS=--download-mumps for PyPI's), "
            "or choose another solver, as in: -- -ksp_type cg -pc_type gamg"
        )
    return "mumps"


def keep_preconditioner(snes: PETSc.SNES) -> None:
    """Let SNES never make its preconditioner anew, unless an option speaks of it: petsc4py has no binding, PETSc's library does,
    and its option refuses to say so from the start.
    """
    if not is_given("snes_lag_preconditioner"):
        library = ctypes.CDLL(PETSc.__file__)
        number = ctypes.c_int64 if np.dtype(PETSc.IntType).itemsize == 8 else ctypes.c_int32
        library.SNESSetLagPreconditioner(ctypes.c_void_p(snes.handle), number(-1))


def free_what_python_dropped(comm: MPI.Comm) -> None:
    """Free PETSc's objects that nothing in Python refers to any more: petsc4py only lists them, as ranks drop them at different
    times. Collective.
    """
    if hasattr(PETSc, "garbage_cleanup"):  # from 3.18 on
        PETSc.garbage_cleanup(comm)


def is_given(name: str) -> bool:
    """Whether the case or the command line says anything about an option. The question is no use of it."""
    return name in PETSc.Options().getAll()


def begins_a_given_option(*prefixes: str) -> bool:
    """Whether the case or the command line gives an option that begins with one of these."""
    return any(name.startswith(prefixes) for name in PETSc.Options().getAll())


def is_known_option(name: str) -> bool:
    """Whether PETSc has an option of this name, whatever object of this program or of PETSc it is meant for."""
    names = option_names()
    if not names:
        return READ_LATE.search(name) is not None
    plain = without_prefix(name)
    return any(word in names for word in (plain, NUMBER.sub("%d", plain), name))


def nearest_option(name: str) -> str:
    """A cure for a misspelt option."""
    plain = without_prefix(name)
    close = get_close_matches(plain, option_names(), n=1, cutoff=0.7)
    if not close:
        return "take it out or correct its name"
    return f"did you mean {name[: len(name) - len(plain)] + close[0]!r}?"


def without_prefix(name: str) -> str:
    """An option's name without the prefixes of objects of this program and of PETSc's nested solvers."""
    name = name.lower()
    while (found := PREFIX.match(name)) and found.end() < len(name):
        name = name[found.end() :]
    return name


@cache
def option_names() -> frozenset[str]:
    """All names of options that PETSc's and SLEPc's libraries hold as text; numbers within them as %d.

    PETSc has no list of its options: each object knows its own when it is set up.
    """
    names: set[str] = set()
    for library in _libraries():
        with suppress(OSError):
            found = re.findall(rb"(?<![\w-])-([A-Za-z][\w%]{2,60})\0", library.read_bytes())
            names |= {word.decode().lower() for word in found}
    return frozenset(names)


def _libraries() -> list[Path]:
    """Files of this process's PETSc and SLEPc."""
    try:
        lines = Path("/proc/self/maps").read_text().splitlines()
        found = {line.split(maxsplit=5)[-1] for line in lines if re.search(r"/lib(petsc|slepc)[^/]*$", line)}
    except OSError:
        settings = petsc4py.get_config()
        places = Path(settings.get("PETSC_DIR", ".")) / settings.get("PETSC_ARCH", "") / "lib"
        found = {str(path) for path in places.glob("libpetsc*")}
    return [Path(name) for name in sorted(found)] or [Path(PETSc.__file__)]


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
