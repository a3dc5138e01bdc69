"""Sets and surfaces of a deck as groups of the mesh."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from ancf_petsc.mesh.abaqus.data import Label, label, plain_number
from ancf_petsc.mesh.abaqus.scope import Deck, Elements, Instance, Scope, Surface, SurfaceLine
from ancf_petsc.mesh.abaqus.sets import Resolver
from ancf_petsc.mesh.abaqus.types import FACES, PLANE, SKIN, SOLID
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Integers
from ancf_petsc.mesh.parts import row_keys, rows_in
from ancf_petsc.mesh.raw import Block, RawMesh

Offsets = dict[str, dict[str, int]]


def name_groups(raw: RawMesh, model: Deck, resolver: Resolver, offsets: Offsets) -> None:
    """Enter node sets, element sets and surfaces into `raw`, under the names a case may use.

    A set of the assembly has its name; one of a part INSTANCE.name, and its name alone where nothing else has it.
    """
    _Groups(raw, model, resolver, offsets).enter()


class _Groups:
    def __init__(self, raw: RawMesh, model: Deck, resolver: Resolver, offsets: Offsets) -> None:
        self.raw, self.model, self.resolver, self.offsets = raw, model, resolver, offsets
        self.kinds: dict[str, set[str]] = {}

    def enter(self) -> None:
        for names, scope, instance in self._scopes():
            for key, own in scope.sets["node"].items():
                self._node_set(names["node", key], self._global(scope, "node", key, instance), own.shown)
            for key in scope.sets["element"]:
                numbers = self.resolver.numbers(scope, "element", key)
                self._element_set(names["element", key], {i or instance: n for i, n in numbers.items()})
            for key, surface in scope.surfaces.items():
                self._surface(names["surface", key], surface, scope, instance)
        self.raw.names = list(dict.fromkeys(self.raw.names))

    def _scopes(self) -> Iterator[tuple[dict[tuple[str, str], list[str]], Scope, str]]:
        """Names of all sets and surfaces by kind and key, the scope, the key of its instance ("" for the assembly)."""
        own = self.model.assembly
        places = [(own, "")] + [(i.scope, key) for key, i in self.model.instances.items() if key]
        every = [(what, key) for scope, _ in places for what, key, _ in _named(scope)]
        often = Counter(every)
        spoken = {(what, key) for what, key, _ in _named(own)}
        for scope, instance in places:
            shown = self.model.instances[instance].shown if instance else ""
            names: dict[tuple[str, str], list[str]] = {}
            for what, key, name in _named(scope):
                alone = not instance or (often[what, key] == 1 and (what, key) not in spoken)
                names[what, key] = ([f"{shown}.{name}"] if instance else []) + ([name] if alone else [])
            yield names, scope, instance

    def _global(self, scope: Scope, what: str, key: str, instance: str) -> Integers:
        numbers = self.resolver.numbers(scope, what, key)
        parts = [own + self.offsets[what].get(i or instance, 0) for i, own in numbers.items()]
        return np.concatenate([np.empty(0, dtype=np.int64), *parts])

    def _node_set(self, names: list[str], numbers: Integers, shown: str) -> None:
        for name in names:
            self.raw.names.append(name)
            self.raw.node_sets[name] = np.union1d(self.raw.node_sets.get(name, numbers), numbers)

    def _element_set(self, names: list[str], by_instance: dict[str, Integers]) -> None:
        self.raw.names += names
        self.raw.materials.update(names)
        for key, numbers in by_instance.items():
            if key not in self.model.instances:
                continue
            for elements in self.model.instances[key].scope.elements:
                rows = np.isin(elements.numbers, numbers)
                if rows.any() and elements.type.shape:
                    self.raw.blocks.append(self._block(elements, rows, key, tuple(names)))

    def _block(self, elements: Elements, rows: np.ndarray, key: str, names: tuple[str, ...]) -> Block:
        assert elements.type.shape
        nodes, order = elements.nodes[rows] + self.offsets["node"][key], elements.type.shape.order
        numbers = elements.numbers[rows] + self.offsets["element"][key]
        return Block(elements.type.shape.kind, numbers, nodes[:, order] if order else nodes, names)

    # --- surfaces

    def _surface(self, names: list[str], surface: Surface, scope: Scope, instance: str) -> None:
        """Faces as parts of the group, nodes as a set of nodes; another name where a set has it and is not the same."""
        blocks: list[Block] = []
        nodes: list[Integers] = [np.empty(0, dtype=np.int64)]
        for line in surface.lines:
            if surface.of_nodes:
                nodes.append(self._surface_nodes(surface, line, scope, instance))
            else:
                blocks += self._faces(surface, line, scope, instance)
        found = np.unique(np.concatenate(nodes + [block.nodes.ravel() for block in blocks]))
        own = tuple(self._free_name(name, found) for name in names)
        self.raw.names += own
        if surface.of_nodes:
            self.raw.node_sets.update(dict.fromkeys(own, found))
        else:
            self.raw.boundary_only.update(own)
        self.raw.blocks += [Block(block.kind, block.numbers, block.nodes, own) for block in blocks]

    def _free_name(self, name: str, nodes: Integers) -> str:
        known = self.raw.node_sets.get(name)
        if known is None or np.array_equal(known, nodes):
            return name
        self.model.notes.append(
            f"{name} is a node set and a surface of other nodes: the surface is {name}.surface"
        )
        return f"{name}.surface"

    def _surface_nodes(self, surface: Surface, line: SurfaceLine, scope: Scope, instance: str) -> Integers:
        return self._chosen(surface, line, scope, instance, "node", summed=True)[""]

    def _chosen(
        self,
        surface: Surface,
        line: SurfaceLine,
        scope: Scope,
        instance: str,
        what: str,
        *,
        summed: bool = False,
    ) -> dict[str, Integers]:
        """Numbers a line of a surface names, by instance; with `summed` those of the whole mesh, under ""."""
        if not line.word:
            numbers = {
                key: self.resolver.existing(own.scope, what)
                for key, own in self.model.instances.items()
                if not instance or key == instance
            }
        else:
            owner, target, key, number = self._owner(line, scope, instance)
            if number is not None:
                numbers = {owner: np.array([number], dtype=np.int64)}
            elif key in target.sets[what]:
                numbers = {i or owner: n for i, n in self.resolver.numbers(target, what, key).items()}
            else:
                raise surface.card.error(
                    f"there is no {what} set of this name",
                    line=line.line,
                    got=line.word,
                    cure="give the set it is made of",
                )
        if summed:
            parts = [own + self.offsets[what].get(i, 0) for i, own in numbers.items()]
            return {"": np.concatenate([np.empty(0, dtype=np.int64), *parts])}
        return numbers

    def _owner(self, line: SurfaceLine, scope: Scope, instance: str) -> tuple[str, Scope, str, int | None]:
        """Instance, scope and key of the set a line names, or the number in it."""
        word, owner = line.word, instance
        prefix, dot, rest = word.partition(".")
        if dot and label(prefix).key in self.model.instances:
            owner, word = label(prefix).key, rest
            scope = self.model.instances[owner].scope
        name: Label = label(word)
        return owner, scope, name.key, plain_number(word)

    def _faces(self, surface: Surface, line: SurfaceLine, scope: Scope, instance: str) -> Iterator[Block]:
        for key, numbers in self._chosen(surface, line, scope, instance, "element").items():
            if key not in self.model.instances:
                continue
            placed = self.model.instances[key]
            free = None if line.face else _free_faces(placed)
            found = False
            for elements in placed.scope.elements:
                rows = np.isin(elements.numbers, numbers)
                if not rows.any() or elements.type.shape is None:
                    continue
                found = True
                for corners in _sides(surface, line, elements, rows, free):
                    nodes = corners + self.offsets["node"][key]
                    kind = {1: "vertex", 2: "line", 3: "triangle", 4: "quad"}[corners.shape[1]]
                    yield Block(kind, np.arange(1, len(nodes) + 1), nodes)
            if not found and line.word and line.word.isdecimal():
                raise surface.card.error(
                    f"there is no element {line.word}", line=line.line, cure="mend the surface"
                )


def _named(scope: Scope) -> Iterator[tuple[str, str, str]]:
    """Kind, key and name of every set and surface."""
    for what, sets in scope.sets.items():
        yield from ((what, key, own.shown) for key, own in sets.items())
    yield from (("surface", key, own.shown) for key, own in scope.surfaces.items())


def _sides(
    surface: Surface,
    line: SurfaceLine,
    elements: Elements,
    rows: np.ndarray,
    free: dict[int, Integers] | None,
) -> Iterator[Integers]:
    """Corners (m, c) of the faces a line names of some elements of a card, as numbers of the deck."""
    assert elements.type.shape
    kind = KINDS[elements.type.shape.kind]
    order = elements.type.shape.order
    nodes = elements.nodes[rows][:, order] if order else elements.nodes[rows]
    faces = FACES.get(kind.linear or kind.name, {})
    if elements.type.family == SKIN or line.face in ("SPOS", "SNEG"):
        if line.face in ("", "SPOS", "SNEG", "S1", "S2"):
            yield nodes[:, : kind.corners]
            return
        faces = {name.replace("S", "E"): corners for name, corners in faces.items()}
    if not line.face:
        if free is not None and elements.type.family in (SOLID, PLANE):
            yield from _only_free(nodes, faces, free)
        return
    if line.face not in faces:
        raise surface.card.error(
            f"face {line.face} of {elements.title}",
            line=line.line,
            expected=f"one of {', '.join(faces) or 'none'}",
        )
    yield nodes[:, faces[line.face]]


def _only_free(
    nodes: Integers, faces: dict[str, tuple[int, ...]], free: dict[int, Integers]
) -> Iterator[Integers]:
    """Faces (m, c) of cells (e, k) that belong to no other cell."""
    for size, known in free.items():
        own = [nodes[:, corners] for corners in faces.values() if len(corners) == size]
        if own:
            candidates = np.concatenate(own)
            bound = int(max(candidates.max(), known.max(initial=0))) + 1
            yield candidates[rows_in(candidates, known, bound) >= 0]


def _free_faces(placed: Instance) -> dict[int, Integers]:
    """Number of corners -> faces (m, c) that belong to one solid or plane element of the instance only."""
    sides: dict[int, list[Integers]] = {}
    for elements in placed.scope.elements:
        if elements.type.shape is None or elements.type.family not in (SOLID, PLANE):
            continue
        order = elements.type.shape.order
        nodes = elements.nodes[:, order] if order else elements.nodes
        kind = KINDS[elements.type.shape.kind]
        for corners in FACES[kind.linear or kind.name].values():
            sides.setdefault(len(corners), []).append(nodes[:, corners])
    free = {}
    for size, parts in sides.items():
        every = np.concatenate(parts)
        _, first, count = np.unique(
            row_keys(every, int(every.max()) + 1), return_index=True, return_counts=True
        )
        free[size] = every[first[count == 1]]
    return free
