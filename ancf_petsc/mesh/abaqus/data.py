"""Numbers and names on the data lines of a card."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.abaqus.deck import KeywordCard
from ancf_petsc.mesh.mesh import Floats, Integers

QUOTED = re.compile(r'(?:"[^"]*"|[^,"\n])+')
FORTRAN = str.maketrans("dD", "EE")
NUMERIC = str.maketrans("", "", "0123456789eE+-.,\n")
LARGEST = 1e100
"""Larger coordinates have no volumes that are finite."""
LARGEST_NUMBER = 2**53
"""Numbers of nodes and elements are read as floating point: up to here exactly."""


class Label(NamedTuple):
    """A name of a set. Names are equal when their keys are: blanks and case count within quotes only."""

    key: str
    shown: str


def label(word: str) -> Label:
    word = word.strip()
    if len(word) >= 2 and word[0] == word[-1] == '"' and '"' not in word[1:-1]:
        return Label(word[1:-1], word[1:-1])
    word = "".join(word.replace('"', "").split())
    return Label(word.upper(), word)


class DataRows(NamedTuple):
    """Numbers of data lines. flat: all of them, an empty field being 0; counts: fields of each line."""

    flat: Floats
    counts: Integers


def table(card: KeywordCard) -> DataRows:
    """The numbers of all data lines that hold some. Raises MeshError with the line that holds anything else."""
    text = re.sub(r"[ \t\f\v]+", "", card.text()).translate(FORTRAN)
    text = re.sub(r",?\n+", "\n", text + "\n").strip("\n")
    if not text:
        return DataRows(np.empty(0), np.empty(0, dtype=np.int64))
    if text.translate(NUMERIC):
        raise _not_numbers(card)
    codes = np.frombuffer(text.encode("ascii"), dtype=np.uint8)
    ends = np.append(np.flatnonzero(codes == ord("\n")), len(codes))
    commas = np.searchsorted(np.flatnonzero(codes == ord(",")), ends)
    counts = np.diff(commas, prepend=0) + 1
    joined = text.replace("\n", ",")
    if ",," in joined or joined.startswith(","):
        joined = ",".join(field or "0" for field in joined.split(","))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            flat = np.fromstring(joined, sep=",")
        except (DeprecationWarning, ValueError):
            raise _not_numbers(card) from None
    if len(flat) != counts.sum() or not (np.abs(flat) < LARGEST).all():
        raise _not_numbers(card)
    return DataRows(flat, counts)


def _not_numbers(card: KeywordCard) -> MeshError:
    for line, text in card.lines():
        for word in text.translate(FORTRAN).split(","):
            word = "".join(word.split())
            try:
                fits = not word or (not word.translate(NUMERIC) and abs(float(word)) < LARGEST)
            except ValueError:
                fits = False
            if not fits:
                cure = "write the deck without *PARAMETER" if "<" in word else "mend the line"
                return card.error(
                    "not a number", line=line, got=word[:40], expected="numbers below 1e100", cure=cure
                )
    return card.error("the data lines are not numbers", cure="mend the deck")


def rows(card: KeywordCard, width: int) -> Floats:
    """Numbers (lines, width); what a line does not give is 0, what it gives beyond is left out."""
    flat, counts = table(card)
    if not len(counts):
        return np.zeros((0, width))
    if (counts == counts[0]).all():
        full = flat.reshape(len(counts), -1)[:, :width]
    else:
        full = np.zeros((len(counts), counts.max()))
        full[np.arange(counts.max()) < counts[:, None]] = flat
        full = full[:, :width]
    return np.pad(full, ((0, 0), (0, width - full.shape[1])))


def records(card: KeywordCard, width: int, what: str) -> Integers:
    """Whole numbers (records, width). A record begins with a line and may go on over several."""
    flat, counts = table(card)
    numbers = whole(card, flat)
    ends = np.cumsum(counts)
    wanted = np.arange(width, len(flat) + width, width)
    if len(flat) % width == 0 and np.isin(wanted, ends).all():
        return numbers.reshape(-1, width)
    raise _broken_record(card, width, what, ends)


def _broken_record(card: KeywordCard, width: int, what: str, ends: Integers) -> MeshError:
    """The first record that does not end with a line."""
    lines = list(card.lines())
    lines = [(line, text) for line, text in lines if text.strip(", \t")]
    start = 0
    for number, end in enumerate(ends):
        if end - start == width:
            start = int(end)
        elif end - start > width or number == len(ends) - 1:
            line, text = lines[min(number, len(lines) - 1)]
            first = text.split(",")[0].strip()
            got = f"{end - start - 1} nodes"
            return card.error(
                f"{what} {first}" if end - start <= width else f"the record of {what} that ends here",
                line=line,
                got=got,
                expected=f"{width - 1} nodes",
                cure="mend the line",
            )
    return card.error(f"records of {what} are broken", cure="mend the deck")


def whole(card: KeywordCard, numbers: Floats) -> Integers:
    """The same as integers."""
    if ((numbers != np.floor(numbers)) | (np.abs(numbers) > LARGEST_NUMBER)).any():
        found = numbers[(numbers != np.floor(numbers)) | (np.abs(numbers) > LARGEST_NUMBER)][0]
        for line, text in card.lines():
            if any(_is(word, found) for word in text.split(",")):
                raise card.error("not a whole number", line=line, got=float(found), cure="mend the line")
        raise card.error("not a whole number", got=float(found), cure="mend the deck")
    return numbers.astype(np.int64)


def plain_number(word: str) -> int | None:
    """A whole number without a sign, as large as numbers of nodes and elements may be; None for anything else."""
    if not (word.isdecimal() and word.isascii() and len(word) <= len(str(LARGEST_NUMBER))):
        return None
    return int(word) if int(word) <= LARGEST_NUMBER else None


def _is(word: str, number: float) -> bool:
    try:
        return float(word.translate(FORTRAN)) == number
    except ValueError:
        return False


def numbered(card: KeywordCard, numbers: Integers, what: str) -> Integers:
    """Numbers of nodes or elements, which are positive."""
    if len(numbers) and numbers.min() < 1:
        raise card.error(
            f"a number of {what}", got=int(numbers.min()), expected="1 or more", cure="number them from 1"
        )
    return numbers


def words(text: str) -> list[str]:
    """The fields of data lines, empty ones left out, names in quotes whole."""
    found = QUOTED.findall(text) if '"' in text else text.replace("\n", ",").split(",")
    return [word for field in found if (word := field.strip())]


def fields(text: str) -> list[str]:
    """The fields of one data line, empty ones included."""
    if '"' not in text:
        return [field.strip() for field in text.split(",")]
    pieces = re.findall(r'((?:"[^"]*"|[^,"])*)(?:,|$)', text)
    return [piece.strip() for piece in pieces]


Line = tuple[Path, int]
