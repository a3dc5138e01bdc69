"""Text of mesh files in whatever encoding they have."""

from __future__ import annotations

import codecs
import os
from pathlib import Path

from ancf_petsc.errors import MeshError

MOST_FILES = 10_000
MOST_TIMES, SPARE = 4, 64 * 2**20
"""How often the bytes of a deck may be read, on the average, and bytes beyond that."""

LATIN = "names are not UTF-8: read as Latin-1, as in {!r}"


def as_text(data: bytes, path: Path, notes: list[str]) -> str:
    """The text of a file: UTF-8, else Latin-1, in which every byte is a letter of its own; then a note says so.

    Raises MeshError for what is no text.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return _utf16(data, path)
    if b"\0" in data:
        raise MeshError(
            "not a text file: it holds zero bytes",
            file=str(path),
            key="mesh.file",
            cure="write the mesh again as text",
        )
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        text = data.decode("latin-1")
        note_latin(text, error.start, notes)
        return text


def _utf16(data: bytes, path: Path) -> str:
    try:
        return data.decode("utf-16")
    except UnicodeDecodeError:
        raise MeshError(
            "neither UTF-8 nor UTF-16 text",
            file=str(path),
            key="mesh.file",
            cure="write the mesh again as text",
        ) from None


def note_latin(text: str, at: int, notes: list[str]) -> None:
    """Say once that a text is not UTF-8, with the line it is first seen in."""
    start = max(text.rfind("\n", 0, at), text.rfind("\r", 0, at)) + 1
    notes.append(LATIN.format(text[start:].splitlines()[0].strip()[:60]))


def decoded(data: bytes, notes: list[str]) -> str:
    """Names of a file, all in one encoding, so that different ones stay different."""
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        text = data.decode("latin-1")
        note_latin(text, error.start, notes)
        return text


class DeckFiles:
    """Reads the files of a deck. Files that include each other over and over would never come to an end."""

    def __init__(self) -> None:
        self._sizes: dict[str, int] = {}
        self._count = self._taken = self._different = 0

    def read(self, path: Path) -> bytes:
        """The bytes of a file. Raises MeshError where it cannot be read, and where too much was included."""
        try:
            data = path.read_bytes()
        except OSError as error:
            raise MeshError(
                f"cannot be read ({error.strerror or error})",
                file=str(path),
                key="mesh.file",
                cure="mend the deck",
            ) from None
        name = os.path.realpath(path)
        self._different += len(data) - self._sizes.get(name, 0)
        self._sizes[name] = len(data)
        self._count, self._taken = self._count + 1, self._taken + len(data)
        if self._count > MOST_FILES or self._taken > SPARE + MOST_TIMES * self._different:
            raise MeshError(
                f"the deck includes {self._count} files, {len(self._sizes)} different ones",
                file=str(path),
                key="mesh.file",
                expected=f"at most {MOST_FILES}, and none over and over",
                cure="mend the deck",
            )
        return data
