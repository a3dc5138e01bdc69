"""What can go wrong, each with the exit code the command line returns for it.

A message says what, where, what was expected and the cure, in one line.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import Any

SHORT, LONG = 300, 1200
"""Letters of a word of the input that a message repeats, and of a list of what there is."""


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
        where = [shortened(str(part), LONG) for part in (self.file, self.key) if part]
        facts = []
        if self.got is not None:
            facts.append(f"found {shortened(_shown(self.got), SHORT)}")
        if self.expected:
            facts.append(f"expected {shortened(self.expected, LONG)}")
        middle = [part for part in (shortened(self.problem, LONG), ", ".join(facts)) if part]
        line = ": ".join(where + middle)
        return f"{line}; {shortened(self.cure, LONG)}" if self.cure else line

    def __reduce__(self) -> tuple:
        """Errors travel between ranks by pickle, keyword arguments included."""
        return (_rebuild, (type(self), self.problem, self.file, self.key, self.got, self.expected, self.cure))


def _plain(value: Any) -> Any:
    """numpy's numbers and arrays, also in a list or a tuple, as Python's: numpy 2 writes np.float64(0.5)."""
    if type(value) in (list, tuple):
        return type(value)(map(_plain, value))
    return value.tolist() if hasattr(value, "tolist") else value


def _rebuild(kind: type[CaseError], problem, file, key, got, expected, cure) -> CaseError:
    return kind(problem, file=file, key=key, got=got, expected=expected, cure=cure)


class MeshError(CaseError):
    """The mesh cannot be read or cannot be computed with."""


class Stopped(AncfError):
    """What ended a path or a motion early. facts: its kind and what is known of it, for `end` of the summary."""

    exit_code = 3

    def __init__(self, message: str, facts: Mapping[str, Any] | None = None) -> None:
        super().__init__(message)
        self.facts = dict(facts or {})


class NoEquilibrium(Stopped):
    """The load path ends: no further state was found. Everything up to here is saved."""


class MotionStopped(Stopped):
    """The motion cannot be followed further: a step failed or numbers are not finite. What was before is saved."""


class EnvironmentProblem(AncfError):
    """The machine lacks something: a package, a library, a launcher, space on the disk, the right to write."""

    exit_code = 4


class Interrupted(AncfError):
    """The user stopped the run. Everything up to the last step is saved."""

    exit_code = 130


def shortened(text: str, most: int) -> str:
    """A text of `most` letters and what is left out, where it is longer: inputs may hold lines without end."""
    return text if len(text) <= most else f"{text[:most]} ... ({len(text)} letters)"


def _shown(value: object) -> str:
    """repr, also of a whole number with more digits than Python writes and of what is nested too deep."""
    try:
        return repr(_plain(value))
    except (ValueError, RecursionError) as error:
        return f"{type(value).__name__} ({error})"


def did_you_mean(word: str, known: list[str] | tuple[str, ...]) -> str:
    """A cure for a misspelt word: the nearest known one, or the list of all."""
    close = [name for name in known if name.casefold() == word.casefold()] or get_close_matches(
        word, known, n=1
    )
    listing = shortened(", ".join(known), LONG // 2) if known else "none"
    return f"did you mean {close[0]!r}? (there are: {listing})" if close else f"there are: {listing}"


WHAT_HAPPENED = {
    errno.ENOSPC: ("no space is left on the disk", "make room, or choose another folder by --out"),
    errno.EDQUOT: ("the disk quota is used up", "make room, or choose another folder by --out"),
    errno.EFBIG: ("the file would exceed the allowed size", "raise ulimit -f, or write fewer outputs"),
    errno.EACCES: ("no permission to write", "restore the rights, or choose another folder by --out"),
    errno.EPERM: ("no permission to write", "restore the rights, or choose another folder by --out"),
    errno.EROFS: ("the file system is read-only", "choose another folder by --out"),
    errno.ENOENT: ("it has vanished", "do not remove or rename a folder while a run writes into it"),
    errno.ENOTDIR: ("its folder has vanished", "do not remove or rename a folder while a run writes into it"),
    errno.ESTALE: ("it was replaced or removed", "let one run alone write into a folder"),
    errno.EISDIR: ("a folder has its name", "remove that, or choose another folder by --out"),
    errno.EAGAIN: ("another program has it open and locked", "close it there (HDFView, h5py, ...)"),
    errno.EIO: ("the device reports an error", "look at the disk or the network"),
    errno.EMFILE: ("too many files are open", "raise ulimit -n"),
}


def cannot_write(error: Exception, path: str | Path) -> EnvironmentProblem:
    """What an OSError, or one of HDF5's, means for the file or folder that was written: one line."""
    number = error_number(error)
    what, cure = WHAT_HAPPENED.get(number, ("", ""))
    path = Path(path)
    if number == errno.ENOENT and not path.parent.is_dir():
        what = f"the folder {path.parent} has vanished"
    if number == errno.ENOSPC and (free := _free_bytes(path)) is not None:
        what = f"{what} ({free / 1e6:.3g} MB free)"
    what = what or " ".join(str(error).split()) or type(error).__name__
    return EnvironmentProblem(f"{path}: cannot be written: {what}" + (f"; {cure}" if cure else ""))


CHOICE_OF_PATH = (
    errno.EACCES, errno.EEXIST, errno.EINVAL, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG, errno.ENOENT,
    errno.ENOTDIR, errno.EPERM, errno.EROFS,
)  # fmt: skip


@contextmanager
def writing(path: str | Path, key: str = "") -> Iterator[None]:
    """Around what writes `path`: what the system refuses is an EnvironmentProblem.

    key: of the path where the user has just chosen it; a place that cannot be written to is then a CaseError.
    """
    try:
        yield
    except OSError as error:
        if key and error.errno in CHOICE_OF_PATH:
            place = error.filename or path
            what = f"cannot be written: {error.strerror or error}"
            raise CaseError(what, file=place, key=key, cure="choose another place") from error
        raise cannot_write(error, path) from error


def error_number(error: Exception) -> int:
    """The operating system's number of an error; HDF5 has it in its text only. 0 where there is none."""
    if isinstance(error, OSError) and error.errno:
        return error.errno
    found = re.search(r"errno = (\d+)", str(error))
    return int(found[1]) if found else 0


def _free_bytes(path: Path) -> int | None:
    """What an ordinary user may still write beside a file."""
    try:
        disk = os.statvfs(path.parent)
    except (OSError, AttributeError):
        return None
    return disk.f_bavail * disk.f_frsize
