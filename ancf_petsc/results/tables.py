"""CSV tables that grow by a whole line at a time and give every number back exactly."""

from __future__ import annotations

import csv
import errno
import io
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.errors import CaseError


class CsvTable:
    """Writer of a CSV file; every row is on disk when `append` returns."""

    def __init__(self, path: Path, columns: Sequence[str], *, goes_on: bool = False) -> None:
        """goes_on: with the rows that the file has. Raises OSError."""
        self.path = Path(path)
        self.columns = tuple(columns)
        if len(set(self.columns)) != len(self.columns):
            raise ValueError(f"{self.path}: a column is named twice: {self.columns}")
        self._file = io.FileIO(self.path, "r+" if goes_on else "w")  # unbuffered: one line, one write
        if goes_on:
            self._file.seek(0, io.SEEK_END)
        else:
            self._write(self.columns)

    def append(self, row: Mapping[str, float] | Sequence[float]) -> None:
        """One row: values by column name, or in the order of the columns."""
        if isinstance(row, Mapping):
            if row.keys() != set(self.columns):
                raise ValueError(
                    f"{self.path}: columns {sorted(row.keys() ^ set(self.columns))} do not match"
                )
            row = [row[name] for name in self.columns]
        if len(row) != len(self.columns):
            raise ValueError(f"{self.path}: {len(row)} values for {len(self.columns)} columns")
        self._write([_exact(value) for value in row])

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, words: Sequence[str]) -> None:
        line = io.StringIO()
        csv.writer(line, lineterminator="\n").writerow(words)
        write_whole(self._file, line.getvalue().encode())


def write_whole(file: io.FileIO, text: bytes, end: bytes = b"") -> None:
    """Write at the file's place, all of it or nothing: a file without space is as before, its last bytes `end`.

    Raises OSError; a disk that runs full takes a part without a word first.
    """
    place = file.tell()
    try:
        rest = memoryview(text)
        while rest:
            written = file.write(rest)
            if not written:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            rest = rest[written:]
    except OSError:
        with suppress(OSError):
            file.seek(place)
            file.write(end)
            file.truncate()
        raise


def _exact(value: float) -> str:
    """Whole numbers as they are; others by the digits, 17 at most, that give them back exactly."""
    if isinstance(value, int | np.integer):
        return str(int(value))
    return repr(float(value))


def file_text(path: Path) -> str:
    """The text of a file. Raises OSError, also for pipes and devices, which might never end; UnicodeDecodeError."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise OSError(errno.EINVAL, "not an ordinary file", str(path))
    return Path(path).read_text(encoding="utf-8")


def read_table(path: Path) -> dict[str, NDArray[np.float64]]:
    """Columns (rows,) by name, in the file's order. A last line cut short by a crash is left out."""
    try:
        text = file_text(path)
    except OSError as error:
        raise CaseError(f"cannot be read: {error.strerror}", file=path) from error
    except UnicodeDecodeError as error:
        raise CaseError(
            f"not a table: byte {error.start} is not UTF-8", file=path, cure="run again"
        ) from error
    lines = io.StringIO(text[: text.rfind("\n") + 1], newline="")
    names = next(csv.reader(lines), [])  # quoted ones may hold line breaks
    body = lines.read()
    if not body:
        return {name: np.empty(0) for name in names}
    try:
        values = np.loadtxt(io.StringIO(body), delimiter=",", ndmin=2)
    except ValueError as error:
        raise CaseError(f"no table of numbers: {error}", file=path) from error
    if values.shape[1] != len(names):
        raise CaseError(
            file=path, got=f"{values.shape[1]} columns", expected=f"{len(names)}, as in its first line"
        )
    return dict(zip(names, values.T.copy(), strict=True))
