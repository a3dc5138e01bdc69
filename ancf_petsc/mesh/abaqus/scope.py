"""What a part, an instance, the assembly or a deck without parts holds: nodes, elements, sets, surfaces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ancf_petsc.mesh.abaqus.data import Label, Line
from ancf_petsc.mesh.abaqus.deck import KeywordCard
from ancf_petsc.mesh.abaqus.types import ElementType
from ancf_petsc.mesh.mesh import Floats, Integers


class Listed(NamedTuple):
    """Numbers that a set names one by one; instance: key of the one they belong to, "" for the scope of the set."""

    numbers: Integers
    instance: str = ""


class Range(NamedTuple):
    """Numbers first, first + step, ... up to last."""

    first: int
    last: int
    step: int
    instance: str = ""


class Reference(NamedTuple):
    """Another set, which is looked for when the deck has been read; elements: the nodes of an element set are meant."""

    label: Label
    instance: str
    card: KeywordCard
    line: Line
    elements: bool = False


Member = Listed | Range | Reference


@dataclass
class Set:
    """A set of nodes or elements; what several cards say about it adds up. unsorted: its order means something."""

    shown: str
    members: list[Member] = field(default_factory=list)
    unsorted: bool = False


class SurfaceLine(NamedTuple):
    """One data line of a surface: a set or a number ("" for the whole body), its face ("" for all that are free)."""

    word: str
    face: str
    line: Line


@dataclass
class Surface:
    """of_nodes: made of nodes instead of faces."""

    shown: str
    card: KeywordCard
    of_nodes: bool
    lines: list[SurfaceLine] = field(default_factory=list)


class Elements(NamedTuple):
    """Elements of one *ELEMENT card. numbers (m,), nodes (m, k) in the file's order."""

    title: str
    type: ElementType
    numbers: Integers
    nodes: Integers
    card: KeywordCard


class Nodes(NamedTuple):
    """numbers (n,), points (n, 3)."""

    numbers: Integers
    points: Floats
    card: KeywordCard


@dataclass
class Scope:
    """name: of the part or instance, "" for the deck and the assembly. to_global: from coordinates of *SYSTEM."""

    name: str = ""
    nodes: list[Nodes] = field(default_factory=list)
    elements: list[Elements] = field(default_factory=list)
    sets: dict[str, dict[str, Set]] = field(default_factory=lambda: {"node": {}, "element": {}})
    surfaces: dict[str, Surface] = field(default_factory=dict)
    to_global: Callable[[Floats], Floats] | None = None

    def add(self, what: str, name: Label, members: list[Member]) -> None:
        """Enter members into the set of nodes or elements of a name."""
        self.sets[what].setdefault(name.key, Set(name.shown)).members.extend(members)

    def node_table(self) -> tuple[Integers, Floats]:
        """Ascending numbers (n,) and points (n, 3) of all nodes so far, each once.

        Raises MeshError where two cards, or one, place a node differently.
        """
        if not self.nodes:
            return np.empty(0, dtype=np.int64), np.empty((0, 3))
        numbers = np.concatenate([nodes.numbers for nodes in self.nodes])
        points = np.concatenate([nodes.points for nodes in self.nodes])
        order = np.argsort(numbers, kind="stable")
        numbers, points = numbers[order], points[order]
        again = np.flatnonzero(numbers[1:] == numbers[:-1])
        moved = again[(points[again] != points[again + 1]).any(axis=1)]
        if len(moved):
            card = next(n.card for n in reversed(self.nodes) if numbers[moved[0]] in n.numbers)
            raise card.error(
                f"{len(moved)} nodes are given again at other places, first node {numbers[moved[0]]}",
                cure="give each node once",
            )
        kept = np.append(True, numbers[1:] != numbers[:-1])
        return numbers[kept], points[kept]

    def element_numbers(self) -> Integers:
        """All element numbers (m,), ascending, each once."""
        return np.unique(np.concatenate([np.empty(0, np.int64), *(block.numbers for block in self.elements)]))


class Instance(NamedTuple):
    """A part in its place: points @ rotation.T + shift. key: of its name; scope: what it consists of."""

    key: str
    shown: str
    scope: Scope
    rotation: Floats
    shift: Floats


@dataclass
class Deck:
    """Everything a deck says about the mesh.

    assembly: sets, surfaces and nodes beyond the parts. instances: key -> what the model consists of; a deck without parts
    is one instance, whose key is "".
    """

    assembly: Scope
    instances: dict[str, Instance]
    notes: list[str]


class Reader:
    """What the cards so far have said. scope: where nodes, elements and sets are entered.

    open_instance: key of the instance that is being read, and its part. beyond: elements that are no cells, by type.
    made: numbers that cards have made of others.
    """

    def __init__(self) -> None:
        self.assembly = self.scope = Scope()
        self.parts: dict[str, Scope] = {}
        self.instances: dict[str, Instance] = {}
        self.open_instance: tuple[str, Scope] | None = None
        self.has_assembly = False
        self.used_parts: set[str] = set()
        self.beyond: dict[str, int] = {}
        self.refused: dict[str, str] = {}
        self.skipped: dict[str, str] = {}
        self.made = 0
