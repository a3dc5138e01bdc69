"""What can go wrong, each with the exit code the command line returns for it.

A message says what, where, what was expected and the cure, in one line.
"""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path


class AncfError(Exception):
    """Base of all errors a user can meet. `exit_code` is what the command line returns."""

    exit_code = 1


class CaseError(AncfError):
    """The input is wrong: case file, mesh or command line.

    The message is one line: file: key: problem: found ..., expected ...; cure.
    """

    exit_code = 2

    def __init__(
        self,
        problem: str = "",
        *,
        file: str | Path | None = None,
        key: str | None = None,
        got: object = None,
        expected: str | None = None,
        cure: str | None = None,
    ) -> None:
        self.problem = problem
        self.file = file
        self.key = key
        self.got = got
        self.expected = expected
        self.cure = cure
        super().__init__(problem, file, key, got, expected, cure)

    def __str__(self) -> str:
        where = [str(part) for part in (self.file, self.key) if part]
        facts = []
        if self.got is not None:
            facts.append(f"found {self.got!r}")
        if self.expected:
            facts.append(f"expected {self.expected}")
        middle = [part for part in (self.problem, ", ".join(facts)) if part]
        line = ": ".join(where + middle)
        return f"{line}; {self.cure}" if self.cure else line

    def __reduce__(self) -> tuple:
        """Errors travel between ranks by pickle, keyword arguments included."""
        return (_rebuild, (type(self), self.problem, self.file, self.key, self.got, self.expected, self.cure))


def _rebuild(kind: type[CaseError], problem, file, key, got, expected, cure) -> CaseError:
    return kind(problem, file=file, key=key, got=got, expected=expected, cure=cure)


class MeshError(CaseError):
    """The mesh cannot be read or cannot be computed with."""


class NoEquilibrium(AncfError):
    """The load path ends: no further state was found. Everything up to here is saved."""

    exit_code = 3


class MotionStopped(AncfError):
    """The motion cannot be followed further: a step failed or numbers are not finite. What was before is saved."""

    exit_code = 3


class EnvironmentProblem(AncfError):
    """The machine lacks something: a package, a library, a launcher."""

    exit_code = 4


class Interrupted(AncfError):
    """The user stopped the run. Everything up to the last step is saved."""

    exit_code = 130


def did_you_mean(word: str, known: list[str] | tuple[str, ...]) -> str:
    """A cure for a misspelt word: the nearest known one, or the list of all."""
    close = get_close_matches(word, known, n=1)
    listing = ", ".join(known) if known else "none"
    return f"did you mean {close[0]!r}? (there are: {listing})" if close else f"there are: {listing}"
