"""Reading an input file of Abaqus or CalculiX: cards one after the other, then nodes, cells and groups.

What describes the mesh is read, what does not is skipped and named in a note. `docs/case-format.md` lists it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ancf_petsc.mesh.abaqus.cards import HANDLERS, HARMLESS, MECHANICS
from ancf_petsc.mesh.abaqus.deck import KeywordCard, read_cards
from ancf_petsc.mesh.abaqus.groups import name_groups
from ancf_petsc.mesh.abaqus.scope import Deck, Instance, Reader
from ancf_petsc.mesh.abaqus.sets import Resolver
from ancf_petsc.mesh.abaqus.types import AXISYMMETRIC, SKIN
from ancf_petsc.mesh.mesh import Integers
from ancf_petsc.mesh.raw import Block, RawMesh, mesh_error

MOST_RAISED = 2**62
"""Numbers of nodes and elements, raised by instance, fit into 64 bits."""


def _take(reader: Reader, card: KeywordCard) -> None:
    """Enter what a card says, or note that it was skipped."""
    handler = HANDLERS.get(card.name)
    if handler:
        handler(reader, card)
    elif card.name not in HARMLESS:
        reader.skipped.setdefault(card.name, card.name)


def read_abaqus(path: Path) -> RawMesh:
    """The mesh in a deck. Raises MeshError with file and line of what cannot be read."""
    notes: list[str] = []
    reader = Reader()
    cards = read_cards(path, notes)
    for card in cards:
        _take(reader, card)
    if reader.scope is not reader.assembly:
        raise cards[-1].error(
            f"the deck ends within {reader.scope.name!r}", cure="end it by *END PART or *END INSTANCE"
        )
    notes += _skipped(reader)
    model = Deck(reader.assembly, _placed(reader, notes), notes)
    return _raw(model, reader, path)


def _skipped(reader: Reader) -> list[str]:
    """What was not read, in words."""
    notes = []
    mechanics = [f"*{name}" for name in reader.skipped if name in MECHANICS]
    others = [f"*{name}" for name in reader.skipped if name not in MECHANICS]
    if mechanics:
        notes.append(
            f"not taken over from the deck, though it changes how the body moves: {', '.join(mechanics)}"
        )
    if others:
        notes.append(f"keywords of the deck that do not describe the mesh are skipped: {', '.join(others)}")
    if reader.beyond:
        listing = ", ".join(f"{count} {title}" for title, count in sorted(reader.beyond.items()))
        notes.append(f"elements that are no part of the body are skipped: {listing}")
    if reader.refused:
        notes.append("; ".join(f"{name}: {why}" for name, why in reader.refused.items()))
    return notes


def _placed(reader: Reader, notes: list[str]) -> dict[str, Instance]:
    """The instances; a deck without an assembly has its nodes, and its parts as they stand."""
    instances = dict(reader.instances)
    still = np.eye(3), np.zeros(3)
    if reader.assembly.nodes or reader.assembly.elements or not (instances or reader.parts):
        instances[""] = Instance("", "", reader.assembly, *still)
    if reader.parts and not reader.instances:
        names = ", ".join(scope.name for scope in reader.parts.values())
        notes.append(f"the deck has parts and no instance of them: taken as they stand: {names}")
        instances |= {key: Instance(key, scope.name, scope, *still) for key, scope in reader.parts.items()}
    else:
        left = [
            scope.name
            for key, scope in reader.parts.items()
            if key not in reader.used_parts and scope.elements
        ]
        if left:
            notes.append(f"parts without an instance are no part of the model: {', '.join(left)}")
    return instances


class Offsets:
    """What is added to the numbers of each instance, so that all are different; nothing where there is one instance.

    by[what][key]: of nodes and elements.
    """

    def __init__(self, model: Deck, resolver: Resolver, path: Path) -> None:
        self.by: dict[str, dict[str, int]] = {"node": {}, "element": {}}
        for what, offsets in self.by.items():
            highest = {}
            for key, instance in model.instances.items():
                numbers = resolver.existing(instance.scope, what)
                if len(numbers):
                    highest[key] = int(numbers[-1])
            step = 10 ** len(str(max(highest.values(), default=0)))
            if step * len(highest) > MOST_RAISED:
                raise mesh_error(path)(
                    f"{len(highest)} instances with {what} numbers up to {max(highest.values())} cannot be told apart",
                    cure="number each part from 1",
                )
            for place, key in enumerate(highest):
                offsets[key] = place * step
            for key in model.instances:
                offsets.setdefault(key, 0)

    def note(self, model: Deck) -> list[str]:
        added = [
            f"{offset} to those of {model.instances[key].shown or 'the assembly'}"
            for key, offset in self.by["node"].items()
            if offset
        ]
        return [f"instances number their nodes alike: added {', '.join(added)}"] if added else []


def _raw(model: Deck, reader: Reader, path: Path) -> RawMesh:
    resolver = Resolver(model.instances, model.assembly)
    offsets = Offsets(model, resolver, path)
    numbers: list[Integers] = [np.empty(0, dtype=np.int64)]
    points = [np.empty((0, 3))]
    for key, instance in model.instances.items():
        own, places = instance.scope.node_table()
        numbers.append(own + offsets.by["node"][key])
        points.append(places @ instance.rotation.T + instance.shift)
    blocks = [
        block
        for key, instance in model.instances.items()
        for block in _blocks(instance, key, offsets, model.notes)
    ]
    raw = RawMesh(
        np.concatenate(numbers), np.concatenate(points), blocks, notes=model.notes, refused=reader.refused
    )
    name_groups(raw, model, resolver, offsets.by)
    model.notes += offsets.note(model)
    for name, (count, first) in resolver.missing.items():
        model.notes.append(
            f"the set {name} lists {count} numbers that the deck does not hold, first {first}: left out"
        )
    return raw


def _blocks(instance: Instance, key: str, offsets: Offsets, notes: list[str]) -> list[Block]:
    """The cells of an instance. Raises MeshError where two have one number."""
    blocks = []
    seen: Integers = np.empty(0, dtype=np.int64)
    for elements in instance.scope.elements:
        numbers = np.sort(elements.numbers)
        twice = np.union1d(numbers[1:][numbers[1:] == numbers[:-1]], np.intersect1d(numbers, seen))
        if len(twice):
            raise elements.card.error(
                f"{len(twice)} element numbers are given twice, first {twice[0]}",
                cure="give each element its own number",
            )
        seen = np.concatenate([seen, numbers])
        shape = elements.type.shape
        if shape is None:
            continue
        nodes = elements.nodes[:, shape.order] if shape.order else elements.nodes
        by = offsets.by
        blocks.append(Block(shape.kind, elements.numbers + by["element"][key], nodes + by["node"][key]))
        if elements.type.family == AXISYMMETRIC:
            notes.append(
                f"{len(numbers)} {elements.title} elements are axisymmetric in the deck: "
                '[section] plane = "axisymmetric" computes them so'
            )
        if elements.type.family == SKIN:
            notes.append(
                f"{len(numbers)} {elements.title} elements: beside solids they are faces of groups, without stiffness"
            )
    return blocks
