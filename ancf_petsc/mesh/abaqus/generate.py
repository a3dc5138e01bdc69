"""Nodes and elements that a deck makes from others: *NGEN, *NFILL, *NCOPY, *ELGEN, *ELCOPY.

Source: Abaqus Analysis User's Guide, "Node definition" and "Element definition".
"""

from __future__ import annotations

import numpy as np

from ancf_petsc.mesh.abaqus.data import LARGEST_NUMBER, Line, fields, label, plain_number, words
from ancf_petsc.mesh.abaqus.deck import KeywordCard
from ancf_petsc.mesh.abaqus.place import motion
from ancf_petsc.mesh.abaqus.scope import Elements, Listed, Nodes, Reader
from ancf_petsc.mesh.abaqus.sets import of_set
from ancf_petsc.mesh.mesh import Floats, Integers

MOST = 20_000_000
"""Numbers that the cards of a deck may make, four a node, and one more than its nodes an element: more is a slip of the pen."""


def _whole_fields(card: KeywordCard, line: Line, text: str, least: int, most: int) -> list[int]:
    """The whole numbers of a data line; empty fields are 0."""
    found = fields(text)
    while found and not found[-1]:
        found.pop()
    try:
        numbers = [int(word or 0) for word in found]
    except ValueError:
        numbers = []
    if any(abs(number) > LARGEST_NUMBER for number in numbers):
        numbers = []
    if not least <= len(numbers) <= most:
        raise card.error(
            "a data line", line=line, got=text.strip()[:60], expected=f"{least} to {most} whole numbers"
        )
    return numbers


def _limit(reader: Reader, card: KeywordCard, count: int, width: int = 4) -> None:
    """Add what a card makes, `width` numbers each. Raises MeshError beyond MOST."""
    reader.made += count * width
    if reader.made > MOST:
        kind = "elements" if card.name.startswith("EL") else "nodes"
        raise card.error(
            f"makes more {kind} than fit", got=count, expected=f"at most {MOST // width} in a deck"
        )


def _places(reader: Reader, card: KeywordCard, numbers: Integers) -> Floats:
    """Points (n, 3) of nodes that are there."""
    known, points = reader.scope.node_table()
    place = np.minimum(np.searchsorted(known, numbers), max(len(known) - 1, 0))
    if not len(known) or (known[place] != numbers).any():
        missing = next(int(number) for number in numbers if number not in known)
        raise card.error(f"node {missing} is not there yet", cure="give the nodes it starts from before it")
    return points[place]


def nodes_between(reader: Reader, card: KeywordCard) -> None:
    """*NGEN: nodes at equal distances on the straight line from one node to another."""
    given = card.known("NSET", "LINE", "SYSTEM")
    if label(given.get("LINE", "")).key not in ("", "S"):
        raise card.error(
            f"LINE={given['LINE']} is not read", expected="a straight line", cure="write the nodes themselves"
        )
    every = []
    for line, text in card.lines():
        first, last, step = (*_whole_fields(card, line, text, 2, 6), 0)[:3]
        step = step or 1
        if last <= first or step < 1 or (last - first) % step:
            raise card.error(
                "a data line", line=line, got=text.strip(), expected="first < last, and a step that divides"
            )
        count = (last - first) // step
        _limit(reader, card, count)
        ends = _places(reader, card, np.array([first, last]))
        share = np.arange(1, count)[:, None] / count
        numbers = np.arange(first + step, last, step)
        reader.scope.nodes.append(Nodes(numbers, ends[0] + share * (ends[1] - ends[0]), card))
        every += [numbers, np.array([first, last])]
    if given.get("NSET") and every:
        reader.scope.add("node", label(given["NSET"]), [Listed(np.concatenate(every))])


def fill(reader: Reader, card: KeywordCard) -> None:
    """*NFILL: nodes at equal distances on the straight lines between nodes of two sets, taken in ascending order."""
    given = card.known("NSET")
    every = []
    for line, text in card.lines():
        names = fields(text)
        if len(names) < 3:
            raise card.error(
                "a data line",
                line=line,
                got=text.strip(),
                expected="two node sets, intervals, step of numbers",
            )
        intervals, step = (*_whole_fields(card, line, ",".join(names[2:]), 1, 2), 0)[:2]
        sets = [of_set(reader, card, "node", label(name)) for name in names[:2]]
        if len(sets[0]) != len(sets[1]) or intervals < 1:
            raise card.error(
                "the two sets", line=line, got=[len(s) for s in sets], expected="equally many nodes"
            )
        _limit(reader, card, intervals * len(sets[0]))
        start, stop = (_places(reader, card, numbers) for numbers in sets)
        for k in range(1, intervals):
            numbers = sets[0] + k * (step or 1)
            reader.scope.nodes.append(Nodes(numbers, start + k / intervals * (stop - start), card))
            every.append(numbers)
        every += sets
    if given.get("NSET") and every:
        reader.scope.add("node", label(given["NSET"]), [Listed(np.unique(np.concatenate(every)))])


def copy_nodes(reader: Reader, card: KeywordCard) -> None:
    """*NCOPY, SHIFT: a set of nodes again, moved and turned, its numbers raised."""
    given = card.known("CHANGENUMBER", "OLDSET", "NEWSET", "SHIFT", "MULTIPLE")
    if "SHIFT" not in given:
        raise card.error("only SHIFT is read", cure="write the nodes themselves")
    step = _number(card, given, "CHANGENUMBER")
    times = _number(card, given, "MULTIPLE") if "MULTIPLE" in given else 1
    numbers = of_set(reader, card, "node", label(card.needed(given, "OLDSET")))
    _limit(reader, card, times * len(numbers))
    points = _places(reader, card, numbers)
    rotation, shift = motion(card)
    new = []
    for _ in range(times):
        numbers, points = numbers + step, points @ rotation.T + shift
        reader.scope.nodes.append(Nodes(numbers, points, card))
        new.append(numbers)
    if given.get("NEWSET"):
        reader.scope.add("node", label(given["NEWSET"]), [Listed(np.concatenate(new))])


def _number(card: KeywordCard, given: dict[str, str], name: str) -> int:
    value = card.needed(given, name).strip()
    number = plain_number(value)
    if number is None or number < 1:
        raise card.error(f"{name}=", got=value, expected="a whole number, 1 or more")
    return number


def elements(reader: Reader, card: KeywordCard) -> None:
    """*ELGEN: rows, columns and layers of elements like one that is there."""
    given = card.known("ELSET")
    made = []
    for line, text in card.lines():
        numbers = _whole_fields(card, line, text, 2, 10)
        numbers += [0] * (10 - len(numbers))
        master, counts = numbers[0], [max(n, 1) for n in numbers[1::3]]
        node_steps, element_steps = [n or 1 for n in numbers[2::3]], [n or 1 for n in numbers[3::3]]
        block, row = _find(reader, card, master, line)
        _limit(reader, card, int(np.prod(counts, dtype=object)), 1 + block.nodes.shape[1])
        grid = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 3)[
            1:
        ]
        own = master + grid @ np.array(element_steps)
        nodes = block.nodes[row] + (grid @ np.array(node_steps))[:, None]
        reader.scope.elements.append(Elements(block.title, block.type, own, nodes, card))
        made += [np.array([master]), own]
    if given.get("ELSET") and made:
        reader.scope.add("element", label(given["ELSET"]), [Listed(np.concatenate(made))])


def _find(reader: Reader, card: KeywordCard, number: int, line: Line) -> tuple[Elements, int]:
    for block in reader.scope.elements:
        found = np.flatnonzero(block.numbers == number)
        if len(found):
            return block, int(found[0])
    raise card.error(f"element {number} is not there yet", line=line, cure="give the element before it")


def copy_elements(reader: Reader, card: KeywordCard) -> None:
    """*ELCOPY: a set of elements again, their numbers and those of their nodes raised."""
    given = card.known("ELEMENTSHIFT", "OLDSET", "SHIFTNODES", "NEWSET")
    if words(card.text()):
        raise card.error("data lines", got=words(card.text())[0], expected="none")
    shift, by = _number(card, given, "ELEMENTSHIFT"), _number(card, given, "SHIFTNODES")
    numbers = of_set(reader, card, "element", label(card.needed(given, "OLDSET")))
    made = []
    for block in list(reader.scope.elements):
        rows = np.isin(block.numbers, numbers)
        if rows.any():
            _limit(reader, card, int(rows.sum()), 1 + block.nodes.shape[1])
            copied = Elements(
                block.title, block.type, block.numbers[rows] + shift, block.nodes[rows] + by, card
            )
            reader.scope.elements.append(copied)
            made.append(copied.numbers)
    if given.get("NEWSET") and made:
        reader.scope.add("element", label(given["NEWSET"]), [Listed(np.concatenate(made))])
