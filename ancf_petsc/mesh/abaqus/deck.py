"""An input file of Abaqus as a list of cards: keyword, parameters, data lines.

Keywords and parameters are case-insensitive and may hold blanks; a keyword line that ends with a comma goes on in the next
line; `**` begins a comment; *INCLUDE and INPUT= bring in other files. Source: Abaqus Keywords Reference Guide and
"Input syntax rules" of the Analysis User's Guide.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ancf_petsc.errors import MeshError, did_you_mean
from ancf_petsc.mesh.text import DeckFiles, as_text

STAR = re.compile(r"^[ \t]*\*.*$", re.MULTILINE)
PARAMETER = re.compile(r'\s*([^,="]+?)\s*(?:=\s*("[^"]*"|[^,]*))?\s*(?:,|$)')
DEEPEST = 32
"""Files that include files that include files: no deck has more levels."""


@dataclass(frozen=True)
class Source:
    """One text file of a deck; positions are offsets of its text."""

    path: Path
    text: str

    def line(self, position: int) -> int:
        return self.text.count("\n", 0, position) + 1


@dataclass(frozen=True)
class Piece:
    """A piece of a file that holds data lines."""

    source: Source
    start: int
    stop: int

    @property
    def text(self) -> str:
        return self.source.text[self.start : self.stop]


@dataclass
class KeywordCard:
    """A keyword with its parameters and data.

    name: in capitals without blanks, such as "ENDPART". parameters: name in capitals -> value as it stands, "" without one.
    """

    name: str
    parameters: dict[str, str]
    source: Source
    position: int
    spans: list[Piece] = field(default_factory=list)

    def error(
        self, problem: str, *, line: tuple[Path, int] | None = None, cure: str | None = None, **facts
    ) -> MeshError:
        """An error about this card, or about a data line of it."""
        path, number = line or (self.source.path, self.source.line(self.position))
        return MeshError(
            f"line {number}, *{self.name}: {problem}", file=str(path), key="mesh.file", cure=cure, **facts
        )

    def text(self) -> str:
        """The data lines, comments left out."""
        return "\n".join(span.text.strip("\n") for span in self.spans)

    def lines(self) -> Iterator[tuple[tuple[Path, int], str]]:
        """(file, line number) and text of each data line that is not empty. For short cards and for errors."""
        for span in self.spans:
            first = span.source.line(span.start)
            for offset, text in enumerate(span.text.split("\n")):
                if text.strip():
                    yield (span.source.path, first + offset), text

    def known(self, *names: str, ignored: tuple[str, ...] = ()) -> dict[str, str]:
        """The parameters, all of which must be among the names; abbreviations of three letters at least are completed."""
        found = {}
        every = (*names, *ignored)
        for given, value in self.parameters.items():
            fits = [name for name in every if name == given] or [
                name for name in every if len(given) >= 3 and name.startswith(given)
            ]
            if len(fits) != 1:
                raise self.error(f"the parameter {given} is not read", cure=did_you_mean(given, every))
            found[fits[0]] = value
        return found

    def needed(self, found: dict[str, str], name: str) -> str:
        """The value of a parameter that must be there."""
        if not found.get(name):
            raise self.error(f"the parameter {name}= is missing", cure="write the deck again")
        return found[name]


def read_cards(path: Path, notes: list[str]) -> list[KeywordCard]:
    """All cards of a deck, those of included files in their place. Raises MeshError."""
    return list(_Deck(path, notes).cards())


class _Deck:
    def __init__(self, path: Path, notes: list[str]) -> None:
        self.path = path
        self.notes = notes
        self.files = DeckFiles()

    def cards(self) -> Iterator[KeywordCard]:
        current: KeywordCard | None = None
        for item in self._items(self._load(self.path), ()):
            if isinstance(item, KeywordCard):
                if current:
                    yield current
                current = item
                self._take_input(current)
            elif current:
                current.spans.append(item)
            elif item.text.strip():
                first = item.text.strip().split("\n")[0][:40]
                line = item.source.line(item.start)
                raise MeshError(
                    f"line {line}: data before the first keyword",
                    file=str(item.source.path),
                    key="mesh.file",
                    got=first,
                    expected="an input file of Abaqus or CalculiX, whose keywords begin with *",
                )
        if current:
            yield current

    def _load(self, path: Path) -> Source:
        data = self.files.read(path)
        return Source(path, as_text(data, path, self.notes).replace("\r\n", "\n").replace("\r", "\n"))

    def _items(self, source: Source, above: tuple[Path, ...]) -> Iterator[KeywordCard | Piece]:
        """Cards without data, and spans of data lines, in the order of the deck."""
        text, at = source.text, 0
        for mark in STAR.finditer(text):
            if mark.start() < at:  # a continuation of a keyword line took it
                continue
            if mark.start() > at:
                yield Piece(source, at, mark.start())
            at = min(mark.end() + 1, len(text))
            if mark[0].lstrip().startswith("**"):
                continue
            header = mark[0].strip()
            while header.endswith(",") and at < len(text):
                stop = text.find("\n", at)
                stop = len(text) if stop < 0 else stop
                line, at = text[at:stop].strip(), min(stop + 1, len(text))
                header += "" if line.startswith("**") else line or " "
            card = self._card(header.rstrip(", "), source, mark.start())
            if card.name == "INCLUDE":
                target = self._target(card, card.needed(card.known("INPUT"), "INPUT"))
                yield from self._included(card, target, (*above, source.path))
            else:
                yield card
        if at < len(text):
            yield Piece(source, at, len(text))

    def _card(self, header: str, source: Source, position: int) -> KeywordCard:
        name, _, rest = header.lstrip("*").partition(",")
        card = KeywordCard("".join(name.split()).upper(), {}, source, position)
        at = 0
        while at < len(rest):
            found = PARAMETER.match(rest, at)
            if rest[at] in ", \t":
                at += 1
                continue
            if found is None:
                raise card.error("this keyword line is not understood", got=header[:80], cure="mend the line")
            card.parameters["".join(found[1].split()).upper()] = (found[2] or "").strip()
            at = max(found.end(), at + 1)
        return card

    def _included(
        self, card: KeywordCard, target: Path, above: tuple[Path, ...]
    ) -> Iterator[KeywordCard | Piece]:
        resolved = os.path.realpath(target)
        if resolved in [os.path.realpath(path) for path in above] or len(above) > DEEPEST:
            raise card.error(f"{target} includes itself", cure="take the *INCLUDE out")
        yield from self._items(self._load(target), above)

    def _target(self, card: KeywordCard, value: str) -> Path:
        """The file of INPUT=: beside the file that names it, else beside the deck."""
        name = value.strip().strip('"').strip()
        if "\0" not in name and name:
            for folder in (card.source.path.parent, self.path.parent):
                if os.path.isfile(folder / name):
                    return folder / name
        raise card.error(
            "there is no such file",
            got=name,
            expected=f"a file in {card.source.path.parent}",
            cure="put it there",
        )

    def _take_input(self, card: KeywordCard) -> None:
        """Data lines of INPUT= of nodes, elements and sets."""
        value = card.parameters.get("INPUT")
        if value is None or card.name not in ("NODE", "ELEMENT", "NSET", "ELSET"):
            return
        source, at = self._load(self._target(card, value)), 0
        for mark in STAR.finditer(source.text):
            if not mark[0].lstrip().startswith("**"):
                raise card.error(
                    "the file of INPUT= holds keywords", got=mark[0][:40], expected="data lines only"
                )
            card.spans.append(Piece(source, at, mark.start()))
            at = mark.end()
        card.spans.append(Piece(source, at, len(source.text)))
