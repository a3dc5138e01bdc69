"""The command `ancf`: one module a verb, imported when it is used.

A verb's module has HELP (one line), add_arguments(parser) and execute(arguments), which returns the exit
code. What follows `--` on the command line is in `arguments.petsc_options`, for verbs that have
PETSC_OPTIONS = True.
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from ancf_petsc.errors import AncfError, CaseError, EnvironmentProblem, Interrupted, did_you_mean

PLAIN_MESSAGES = ("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")
"""Else numba has a code for terminals written at the end of every process that mpiexec started, also into files."""

VERBS = {
    "run": ("ancf_petsc.cli.run", "solve a case"),
    "check": ("ancf_petsc.cli.check", "check a case and its mesh, solve nothing"),
    "plot": ("ancf_petsc.cli.plot", "draw the curves of runs"),
    "view": ("ancf_petsc.cli.view", "look at a run, or at a case before it runs"),
    "study": ("ancf_petsc.cli.study", "run a case with keys varied, tabulate errors and costs"),
    "advise": ("ancf_petsc.cli.advise", "find the cheapest element, mesh and step within an error"),
    "info": ("ancf_petsc.cli.info", "versions, elements, self-check"),
    "modes": ("ancf_petsc.cli.modes", "natural frequencies and shapes of a case's body"),
    "mesh": ("ancf_petsc.cli.mesh", "make one of the project's meshes at a size"),
    "export": ("ancf_petsc.cli.export", "write a case as the input of another program, CalculiX"),
    "reduce": ("ancf_petsc.cli.reduce", "write a smaller case that gives the same answer"),
    "new": ("ancf_petsc.cli.new", "write a commented case to start from"),
    "bench": ("ancf_petsc.cli.bench", "time configurations with known answers"),
}
ABOUT = "Large-deformation solids in absolute nodal coordinates, in parallel, on PETSc."
EPILOG = """\
exit codes: 0 done; 2 wrong input; 3 no equilibrium further on; 4 wrong environment, full disk; 130 interrupted
in parallel: mpiexec -n 4 ancf run CASE; PETSc options follow --, as in: ancf run CASE -- -ksp_type cg
ANCF_TRACEBACK=1 shows where an error comes from; ancf VERB --help has the options of a verb"""
RANK = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK")
SIZE = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")
BROKEN_PIPE = 141
NO_SIGNALS = "-no_signal_handler"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code."""
    words = list(sys.argv[1:] if argv is None else argv)
    _keep_petsc_from_signals()
    os.environ.setdefault(*PLAIN_MESSAGES)
    try:
        with _without_warnings_of_arithmetic():
            code = _command(words)
        sys.stdout.flush()
    except SystemExit as leave:
        return leave.code if isinstance(leave.code, int) else int(leave.code is not None)
    except AncfError as error:
        _end_others_unless_they_know(error)
        return _print_error(error)
    except ImportError as error:
        from ancf_petsc.cli.packages import import_problem

        if (problem := import_problem(error, words[0])) is None:
            raise
        return _print_error(problem)
    except KeyboardInterrupt:
        _abort_others(Interrupted.exit_code)
        return _print_error(Interrupted("interrupted"))
    except BrokenPipeError:
        _abort_others(BROKEN_PIPE)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except OSError as error:
        problem = EnvironmentProblem(f"the system refuses: {error}")
        if rank_count() > 1:  # of this rank alone, for all one knows
            print(f"error: rank {rank()}: {problem}", file=sys.stderr, flush=True)
            _abort_others(problem.exit_code)
        return _print_error(problem)
    except Exception:
        if rank_count() == 1:
            raise
        sys.excepthook(*sys.exc_info())
        print(f"error: rank {rank()}: {sys.exc_info()[1]!r}", file=sys.stderr, flush=True)
        _abort_others(1)
        return 1
    return code


def _keep_petsc_from_signals() -> None:
    """PETSc, when it starts, would end the process on SIGPIPE: a reader that leaves (`| head`) must not end a run."""
    given = os.environ.get("PETSC_OPTIONS", "")
    if NO_SIGNALS not in given:
        os.environ["PETSC_OPTIONS"] = f"{given} {NO_SIGNALS}".strip()


@contextmanager
def _without_warnings_of_arithmetic() -> Iterator[None]:
    """Keep numpy's lines on overflow and the like from the terminal: numbers that are not finite are errors of ours."""
    with warnings.catch_warnings():
        if os.environ.get("ANCF_TRACEBACK", "") in ("", "0"):
            words = "(overflow|underflow|invalid value|divide by zero) encountered"
            warnings.filterwarnings("ignore", words, RuntimeWarning)
        yield


def rank() -> int:
    """This process's number among those that a launcher started, 0 alone; mpi4py stays unimported."""
    return _number(RANK, 0)


def rank_count() -> int:
    """How many processes a launcher started."""
    return _number(SIZE, 1)


def _number(names: Sequence[str], default: int) -> int:
    value = next((os.environ[name] for name in names if name in os.environ), "")
    return int(value) if value.isdecimal() else default


class Parser(argparse.ArgumentParser):
    """An argument parser whose mistakes are CaseErrors of one line, silent on other ranks than the root."""

    def error(self, message: str) -> NoReturn:
        raise CaseError(message, file=self.prog, cure=f"see {self.prog} --help")

    def _print_message(self, message: str, file: Any = None) -> None:
        if rank() == 0:
            super()._print_message(message, file)


def _command(words: list[str]) -> int:
    if broken := next((word for word in words if "\0" in word), None):
        raise CaseError("a NUL character", file="ancf", got=broken, expected="words and paths without one")
    top = _top_parser()
    chosen = top.parse_args(words[:1])
    if chosen.verb is None:
        top.print_help()
        return 0
    if chosen.verb not in VERBS:
        raise _unknown_verb(chosen.verb)
    verb = import_module(VERBS[chosen.verb][0])
    parser = Parser(
        prog=f"ancf {chosen.verb}",
        description=verb.HELP,
        epilog=getattr(verb, "EPILOG", None),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verb.add_arguments(parser)
    own, options = _split(words[1:])
    arguments = parser.parse_args(own)
    if options and not getattr(verb, "PETSC_OPTIONS", False):
        parser.error(f"{chosen.verb} takes no PETSc options: found {' '.join(options)}")
    arguments.petsc_options = options
    return int(verb.execute(arguments))


def _split(words: list[str]) -> tuple[list[str], list[str]]:
    """The words before and after the first `--`."""
    place = words.index("--") if "--" in words else len(words)
    return words[:place], words[place + 1 :]


def _top_parser() -> Parser:
    verbs = "\n".join(f"  {name:<8}{line}" for name, (_, line) in VERBS.items())
    parser = Parser(
        prog="ancf",
        usage="ancf VERB ...",
        description=f"{ABOUT}\n\nverbs:\n{verbs}",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and leave")
    parser.add_argument("verb", nargs="?", help=argparse.SUPPRESS)
    return parser


class _Version(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        from importlib.metadata import PackageNotFoundError, version

        try:
            number = version("ancf_petsc")
        except PackageNotFoundError:
            number = "(not installed)"
        if rank() == 0:
            print(f"ancf_petsc {number}")
        parser.exit()


def _unknown_verb(word: str) -> CaseError:
    case = word.endswith(".toml") or (Path(word) / "case.toml").is_file()
    cure = f"did you mean: ancf run {shlex.quote(word)}" if case else did_you_mean(word, tuple(VERBS))
    return CaseError("unknown verb", file="ancf", got=word, cure=cure)


def _print_error(error: AncfError) -> int:
    """One line on stderr by the root rank; the exit code.

    A rank that never met MPI leaves with 0: failing first, it would make the launcher end the root unheard.
    """
    if rank() == 0:
        if os.environ.get("ANCF_TRACEBACK", "") not in ("", "0"):
            sys.excepthook(type(error), error, error.__traceback__)
        line = " ".join(str(error).splitlines()) or type(error).__name__
        with suppress(BrokenPipeError):
            print(f"error: {line}", file=sys.stderr, flush=True)
        return error.exit_code
    return error.exit_code if _mpi() else 0


def _mpi() -> Any:
    """mpi4py.MPI if this process has started MPI."""
    return sys.modules.get("mpi4py.MPI")


def _end_others_unless_they_know(error: AncfError) -> None:
    """Errors of this program are raised on all ranks. One that is raised on this rank alone leaves the others waiting for it."""
    mpi = _mpi()
    if rank_count() == 1 or mpi is None:
        return
    from ancf_petsc.parallel.exchange import all_meet

    if not all_meet(mpi.COMM_WORLD):
        print(f"error: rank {rank()}, alone: {error}", file=sys.stderr, flush=True)
        _abort_others(error.exit_code)


def _abort_others(code: int) -> None:
    """End all ranks, for they would wait for this one."""
    if rank_count() > 1 and (mpi := _mpi()) is not None:
        sys.stdout.flush()
        sys.stderr.flush()
        mpi.COMM_WORLD.Abort(code)
