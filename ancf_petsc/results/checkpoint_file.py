"""Checkpoints on the disk: two files in a run's folder, written in turn, each whole or refused.

A file: MAGIC, the length of a text in 8 bytes, the text (JSON: what is in it), arrays one after the other, the SHA-256 of all
before. It is written beside, brought to the disk (fsync) and renamed: a power cut leaves the one before. The text's `number`
counts checkpoints of a run. Arrays are 64-bit floats, whole numbers or bytes.
"""

from __future__ import annotations

import errno
import json
import os
import struct
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

NAMES = ("checkpoint_a.bin", "checkpoint_b.bin")
PART = "checkpoint_*.part"
MAGIC = b"ancf checkpoint\n"
FORMAT = 1
DIGEST = 32
BLOCK = 1 << 22
LONGEST_TEXT = 1 << 30
KINDS = {"f8": np.float64, "i8": np.int64, "u1": np.uint8}


class Damaged(Exception):
    """A file that is no whole checkpoint; the text says why."""


@dataclass(frozen=True)
class ArrayPlace:
    """An array within a file: kind as in KINDS, offset in bytes."""

    kind: str
    shape: tuple[int, ...]
    offset: int

    @property
    def size(self) -> int:
        """In bytes."""
        return int(np.prod(self.shape, dtype=np.int64)) * np.dtype(KINDS[self.kind]).itemsize


@dataclass(frozen=True)
class Saved:
    """A whole checkpoint. about: its text but for the arrays' places."""

    path: Path
    number: int
    about: dict[str, Any]
    arrays: tuple[ArrayPlace, ...]

    def rows(self, index: int, start: int = 0, stop: int | None = None) -> NDArray:
        """Rows of an array."""
        place = self.arrays[index]
        stop = place.shape[0] if stop is None else stop
        width = place.size // max(place.shape[0], 1)
        found = np.empty((stop - start, *place.shape[1:]), KINDS[place.kind])
        if found.nbytes:
            with self.path.open("rb") as file:
                file.seek(place.offset + start * width)
                found = np.frombuffer(file.read(found.nbytes), found.dtype).reshape(found.shape)
        return found


class Writing:
    """A checkpoint on its way to the disk, on the root rank: nobody sees it before `finish`. Methods raise OSError."""

    def __init__(
        self, path: Path, number: int, about: Mapping[str, Any], arrays: Sequence[tuple[str, tuple[int, ...]]]
    ) -> None:
        """arrays: kind and shape of each, in the order in which they come."""
        self.path = path
        head = {"format": FORMAT, "number": number, "about": about, "arrays": arrays}
        text = json.dumps(head).encode()
        size = sum(ArrayPlace(kind, tuple(shape), 0).size for kind, shape in arrays)
        handle, name = tempfile.mkstemp(prefix="checkpoint_", suffix=".part", dir=path.parent)
        self._part, self._file, self._digest = Path(name), os.fdopen(handle, "wb"), sha256()
        try:
            with suppress(AttributeError):
                _set_aside(handle, len(MAGIC) + 8 + len(text) + size + DIGEST)
            self._write(MAGIC + struct.pack("<Q", len(text)) + text)
        except BaseException:
            self.drop()
            raise

    def add(self, rows: NDArray) -> None:
        """The next rows."""
        self._write(np.ascontiguousarray(rows).tobytes())

    def finish(self) -> None:
        """Bring it to the disk under its name."""
        try:
            self._file.write(self._digest.digest())
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            os.replace(self._part, self.path)
            sync(self.path.parent)
        except BaseException:
            self.drop()
            raise

    def drop(self) -> None:
        """Give it up."""
        with suppress(OSError):
            self._file.close()
        with suppress(OSError):
            self._part.unlink(missing_ok=True)

    def _write(self, data: bytes) -> None:
        self._digest.update(data)
        self._file.write(data)


def _set_aside(handle: int, size: int) -> None:
    """Have the disk keep the space, so that one that is full says so at once; some file systems cannot."""
    try:
        os.posix_fallocate(handle, 0, size)
    except OSError as error:
        if error.errno not in (errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL):
            raise


def sync(path: Path) -> None:
    """Bring a file, or the names in a folder, to the disk. Raises OSError."""
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def read(path: Path) -> Saved:
    """A checkpoint, after its digest was checked. Raises Damaged, OSError."""
    digest = sha256()
    with path.open("rb") as file:
        rest = os.fstat(file.fileno()).st_size - DIGEST
        if rest < len(MAGIC) + 8 or file.read(len(MAGIC)) != MAGIC:
            raise Damaged("no beginning of a checkpoint")
        (length,) = struct.unpack("<Q", file.read(8))
        start = len(MAGIC) + 8
        if length > min(rest - start, LONGEST_TEXT):
            raise Damaged("cut short")
        file.seek(0)
        left = rest
        while left:
            block = file.read(min(left, BLOCK))
            if not block:
                raise Damaged("cut short")
            digest.update(block)
            left -= len(block)
        if file.read(DIGEST) != digest.digest():
            raise Damaged("its digest does not fit")
        file.seek(start)
        head = json.loads(file.read(length))
    if head["format"] != FORMAT:
        raise Damaged(f"of format {head['format']}, which another version of the program reads")
    places, offset = [], start + length
    for kind, shape in head["arrays"]:
        places.append(ArrayPlace(kind, tuple(shape), offset))
        offset += places[-1].size
    return Saved(path, head["number"], head["about"], tuple(places))


def all_in(folder: Path) -> tuple[list[Saved], dict[Path, str]]:
    """Whole checkpoints in a folder, the newest first, and what is wrong with the others. Raises OSError."""
    found, wrong = [], {}
    for name in NAMES:
        path = Path(folder) / name
        try:
            found.append(read(path))
        except (FileNotFoundError, NotADirectoryError):
            continue
        except Damaged as why:
            wrong[path] = str(why)
    return sorted(found, key=lambda saved: -saved.number), wrong


def next_path(folder: Path, last: Path | None) -> Path:
    """Where the next checkpoint goes: never over the last good one."""
    return Path(folder) / next(name for name in NAMES if last is None or name != last.name)


def sweep(folder: Path) -> None:
    """Remove what an interrupted writing left."""
    for part in Path(folder).glob(PART):
        part.unlink(missing_ok=True)
