"""Bulk data as cards: name, fields, first line.

A line is in free format (fields between commas), in small fields of 8 columns or, with `*` behind the name, in large fields
of 16. A line whose first field is empty or begins with `+` or `*` goes on with the card before it, marked or not.
Source: MSC Nastran Quick Reference Guide, "Format of Bulk Data Entries".
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.text import DeckFiles, as_text

DEEPEST = 32
MOST_LISTED = 10_000_000
"""Numbers that THRU may stand for in a card."""
LARGEST = 1e100
"""Larger coordinates have no volumes that are finite."""
EXPONENT = re.compile(r"(?<=[\d.])([+-]\d)")
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?", re.ASCII)
WHOLE = re.compile(r"[+-]?[0-9]{1,15}")
INCLUDE = re.compile(r"\s*INCLUDE\s*['\"]?\s*([^'\"]*)", re.IGNORECASE)


@dataclass(frozen=True)
class Line:
    """A line of a file, without its comment."""

    text: str
    number: int
    path: Path

    def error(self, problem: str, **facts) -> MeshError:
        return MeshError(f"line {self.number}: {problem}", file=str(self.path), key="mesh.file", **facts)


@dataclass
class Card:
    """name in capitals; fields as text, without blanks around; those of continuation lines follow, 8 a line."""

    name: str
    fields: list[str]
    line: Line

    def field(self, number: int) -> str:
        return self.fields[number] if number < len(self.fields) else ""

    def error(self, problem: str, **facts) -> MeshError:
        return self.line.error(f"{self.name}: {problem}", **facts)


class BulkData(NamedTuple):
    """What is known while a deck is read. folder: of its main file; notes, comments: gathered from all of its files."""

    folder: Path
    notes: list[str]
    comments: list[str]
    files: DeckFiles


def read_bulk(path: Path, notes: list[str]) -> tuple[list[Card], list[str]]:
    """Cards of the bulk data, and the comments of the file. Raises MeshError with file and line."""
    comments: list[str] = []
    deck = BulkData(path.parent, notes, comments, DeckFiles())
    lines = list(_bulk(list(_lines(path, deck, (os.path.realpath(path),)))))
    return list(_cards(lines)), comments


def _lines(path: Path, deck: BulkData, above: tuple[str, ...]) -> Iterator[Line]:
    """The lines of a file and of those it includes, comments and empty lines left out."""
    data = deck.files.read(path)
    pending: Line | None = None
    for number, raw in enumerate(as_text(data, path, deck.notes).splitlines(), 1):
        text, mark, comment = raw.partition("$")
        if mark:
            deck.comments.append(comment)
        if not text.strip():
            continue
        line = Line(text.rstrip(), number, path)
        if pending:  # a file name that goes on over several lines
            line, pending = Line(pending.text + text.strip(), pending.number, path), None
        if INCLUDE.match(line.text) and "=" not in line.text:
            if line.text.count("'") == 1 or line.text.count('"') == 1:
                pending = line
                continue
            yield from _included(line, deck, above)
        else:
            yield line
    if pending:
        raise pending.error("INCLUDE: the name of the file has no end", cure="close the quotes")


def _included(line: Line, deck: BulkData, above: tuple[str, ...]) -> Iterator[Line]:
    found = INCLUDE.match(line.text)
    name = found[1].strip() if found else ""
    for folder in (line.path.parent, deck.folder):
        target = folder / name
        if name and "\0" not in name and os.path.isfile(target):
            if os.path.realpath(target) in above or len(above) > DEEPEST:
                raise line.error(f"INCLUDE: {name} includes itself", cure="take the INCLUDE out")
            yield from _lines(target, deck, (*above, os.path.realpath(target)))
            return
    raise line.error(
        "INCLUDE: there is no such file",
        got=name,
        expected=f"a file in {line.path.parent}",
        cure="put it there",
    )


def _bulk(lines: list[Line]) -> list[Line]:
    """The lines between BEGIN BULK and ENDDATA; a file without BEGIN BULK is bulk data alone."""
    words = [line.text.upper().split() for line in lines]
    begins = [i for i, word in enumerate(words) if word[0] == "BEGIN"]
    start = begins[0] + 1 if begins else next((i + 1 for i, word in enumerate(words) if word[0] == "CEND"), 0)
    ends = [i for i, word in enumerate(words) if i >= start and word[0].startswith("ENDDATA")]
    stop = ends[0] if ends else len(lines)
    if len(begins) > 1 and begins[1] < stop:
        raise lines[begins[1]].error(
            "a second BEGIN, as of superelements, is not read", cure="write one model"
        )
    return lines[start:stop]


def _cards(lines: Iterable[Line]) -> Iterator[Card]:
    card: Card | None = None
    marker = ""
    for line in lines:
        fields, following, wide = _split(line)
        head = fields[0]
        if not head or head[0] in "+*":
            if card is None:
                raise line.error(
                    "a continuation without a card before it", got=line.text[:40], cure="mend the deck"
                )
            mark = head.lstrip("+*")
            if mark and marker and mark != marker:
                raise line.error(
                    f"continuation {head} follows one that expects +{marker}", cure="write the deck in order"
                )
            _fill(card, wide=wide)
            card.fields += fields[1:]
        else:
            if card:
                yield card
            name = head.rstrip("*").upper()
            if not name[0].isalpha():
                raise line.error(
                    "not bulk data of Nastran", got=line.text[:40], expected="the name of a card"
                )
            card = Card(name, [name, *fields[1:]], line)
        marker = following.lstrip("+*").strip()
    if card:
        yield card


def _fill(card: Card, *, wide: bool) -> None:
    """Empty fields, so that a continuation begins where its line does: every 4 of large fields, every 8 of small ones."""
    width = 4 if wide else 8
    card.fields += [""] * (-(len(card.fields) - 1) % width)


def _split(line: Line) -> tuple[list[str], str, bool]:
    """First field and data fields, the marker of the continuation, whether the fields are large."""
    text = line.text
    if "," in text:
        fields = [field.strip() for field in text.split(",")]
        wide = fields[0].endswith("*") or fields[0].startswith("*")
        most = 4 if wide else 8
        if len(fields) > most + 2:
            raise line.error(
                f"{len(fields) - 1} fields", expected=f"at most {most} and a marker", cure="break the line"
            )
        marker = fields[most + 1] if len(fields) > most + 1 else ""
        data = fields[1 : most + 1]
        if data and data[-1].startswith("+"):
            marker, data[-1] = data[-1], ""
    else:
        text = text.expandtabs(8)
        head = text[:8].strip()
        wide = head.endswith("*") or head.startswith("*")
        fields = [head]
        step = 16 if wide else 8
        data = [text[at : at + step].strip() for at in range(8, 72, step)]
        marker = text[72:80].strip()
    for field in data:
        if field.startswith(("=", "*(")):
            raise line.error("replicated fields are not read", got=field, cure="write every card in full")
    while data and not data[-1]:
        data.pop()
    return [fields[0], *data], marker, wide


def numbers(cards: list[Card], field: int, default: str = "0") -> Floats:
    """The number in a field of every card (n,); Nastran's 1.5-3 is 1.5e-3."""
    words = [card.field(field).upper().replace("D", "E") or default for card in cards]
    words = [word if NUMBER.fullmatch(word) else EXPONENT.sub(r"E\1", word) for word in words]
    for card, word in zip(cards, words, strict=True):
        if not NUMBER.fullmatch(word):
            raise card.error(
                f"field {field + 1} is not a number", got=card.field(field), cure="mend the card"
            )
    return np.array(words, dtype=float) if words else np.empty(0)


def integers(cards: list[Card], field: int, default: str = "0") -> Integers:
    """The whole number in a field of every card (n,)."""
    words = [card.field(field) or default for card in cards]
    for card, word in zip(cards, words, strict=True):
        if not WHOLE.fullmatch(word):
            raise card.error(f"field {field + 1} is not a whole number", got=word, cure="mend the card")
    return np.array([int(word) for word in words], dtype=np.int64)


def listed(card: Card, start: int) -> Integers:
    """Numbers from a field on, with THRU and BY (k,)."""
    words = [word.upper() for word in card.fields[start:] if word]
    found: list[Integers] = []
    at = made = 0
    while at < len(words):
        first = _whole(card, words[at])
        if at + 2 < len(words) and words[at + 1] == "THRU":
            last, step, used = _whole(card, words[at + 2]), 1, 3
            if at + 4 < len(words) and words[at + 3] == "BY":
                step, used = _whole(card, words[at + 4]), 5
            if last < first or step < 1:
                raise card.error("THRU", got=" ".join(words[at : at + used]), expected="first THRU last")
            made += (last - first) // step + 1
            if made > MOST_LISTED:
                raise card.error(
                    "THRU",
                    got=" ".join(words[at : at + used]),
                    expected=f"at most {MOST_LISTED} numbers in a card",
                )
            found.append(np.arange(first, last + 1, step))
            at += used
        else:
            found.append(np.array([first]))
            at += 1
    return np.unique(np.concatenate(found)) if found else np.empty(0, dtype=np.int64)


def _whole(card: Card, word: str) -> int:
    if not (word.isdecimal() and word.isascii() and len(word) < 16):
        raise card.error("a list of numbers", got=word, expected="whole numbers, THRU and BY")
    return int(word)
