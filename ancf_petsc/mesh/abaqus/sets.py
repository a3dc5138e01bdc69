"""Members of sets as numbers: ranges, sets of sets, sets of instances."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from ancf_petsc.errors import did_you_mean
from ancf_petsc.mesh.abaqus.data import Label
from ancf_petsc.mesh.abaqus.deck import KeywordCard
from ancf_petsc.mesh.abaqus.scope import Instance, Listed, Member, Range, Reader, Reference, Scope
from ancf_petsc.mesh.mesh import Integers

DEEPEST = 100
"""Sets in sets: more would exceed Python's stack."""

Found = dict[str, list[Integers]]


class Resolver:
    """Numbers of the members of sets, once all nodes and elements are there.

    missing: how many numbers the deck does not hold, by set, and the first of them.
    """

    def __init__(self, instances: Mapping[str, Instance], assembly: Scope) -> None:
        self.instances, self.assembly = instances, assembly
        self._existing: dict[tuple[int, str], Integers] = {}
        self._members: dict[tuple[int, str, str], dict[str, Integers]] = {}
        self.missing: dict[str, tuple[int, int]] = {}

    def existing(self, scope: Scope, what: str) -> Integers:
        """Ascending numbers of the nodes or elements of a scope."""
        key = id(scope), what
        if key not in self._existing:
            self._existing[key] = scope.node_table()[0] if what == "node" else scope.element_numbers()
        return self._existing[key]

    def numbers(self, scope: Scope, what: str, key: str) -> dict[str, Integers]:
        """Key of the instance ("" for the scope itself) -> ascending numbers of a set's members that are there."""
        return self._set(scope, what, key, ())

    def _set(self, scope: Scope, what: str, key: str, above: tuple) -> dict[str, Integers]:
        place = (id(scope), what, key)
        if place in self._members:
            return self._members[place]
        found: Found = defaultdict(list)
        own = scope.sets[what][key]
        for member in own.members:
            self._expand(member, scope, what, found, (*above, place), own.shown)
        self._members[place] = {name: np.unique(np.concatenate(parts)) for name, parts in found.items()}
        return self._members[place]

    def _scope(self, scope: Scope, instance: str) -> Scope:
        return self.instances[instance].scope if instance else scope

    def _expand(self, member: Member, scope: Scope, what: str, found: Found, above: tuple, name: str) -> None:
        owner = self._scope(scope, member.instance)
        if isinstance(member, Reference):
            for instance, numbers in self._referred(member, owner, what, above).items():
                found[member.instance or instance].append(numbers)
            return
        existing = self.existing(owner, what)
        if isinstance(member, Range):
            low, high = np.searchsorted(existing, (member.first, member.last + 1))
            inside = existing[low:high]
            inside = inside[(inside - member.first) % member.step == 0]
            short = (member.last - member.first) // member.step + 1 - len(inside)
            if short:
                self._miss(name, short, member.first)
        else:
            there = np.isin(member.numbers, existing)
            inside = member.numbers[there]
            if not there.all():
                self._miss(name, int((~there).sum()), int(member.numbers[~there][0]))
        found[member.instance].append(inside)

    def _miss(self, name: str, count: int, first: int) -> None:
        before = self.missing.get(name, (0, first))
        self.missing[name] = (before[0] + count, before[1])

    def _referred(self, member: Reference, owner: Scope, what: str, above: tuple) -> dict[str, Integers]:
        kind = "element" if member.elements else what
        key = member.label.key
        if (id(owner), kind, key) in above:
            raise member.card.error(
                f"the set {member.label.shown} contains itself", line=member.line, cure="break the circle"
            )
        if len(above) >= DEEPEST:
            raise member.card.error(
                f"the set {member.label.shown} is the last of {DEEPEST} that are members of each other",
                line=member.line,
                cure="give its members themselves",
            )
        if key in owner.sets[kind]:
            numbers = self._set(owner, kind, key, above)
        else:
            known = [known.shown for known in owner.sets[kind].values()]
            raise member.card.error(
                f"there is no {kind} set of this name",
                line=member.line,
                got=member.label.shown,
                cure=did_you_mean(member.label.shown, known),
            )
        if member.elements:
            return {
                instance: self._nodes_of(self._scope(owner, instance), own)
                for instance, own in numbers.items()
            }
        return numbers

    @staticmethod
    def _nodes_of(scope: Scope, numbers: Integers) -> Integers:
        nodes = [block.nodes[np.isin(block.numbers, numbers)].ravel() for block in scope.elements]
        return np.unique(np.concatenate([np.empty(0, np.int64), *nodes]))


def of_set(reader: Reader, card: KeywordCard, what: str, name: Label) -> Integers:
    """Ascending numbers of a set of the scope that is being read, as far as the deck has come."""
    known = reader.scope.sets[what].get(name.key)
    if known is None:
        shown = [own.shown for own in reader.scope.sets[what].values()]
        raise card.error(
            f"there is no {what} set of this name", got=name.shown, cure=did_you_mean(name.shown, shown)
        )
    if known.unsorted:
        raise card.error(
            f"the set {name.shown} is UNSORTED, which is not read here", cure="write the nodes themselves"
        )
    found = Resolver(reader.instances, reader.assembly).numbers(reader.scope, what, name.key)
    return found.get("", np.empty(0, dtype=np.int64))


__all__ = ["Listed", "Resolver", "of_set"]
