"""The part of a mesh that is planned here, which entries of a case look at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.input.load import Case
from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.mesh.groups import find_group
from ancf_petsc.mesh.mesh import Group, Mesh
from ancf_petsc.plan.plane import plane_normal
from ancf_petsc.plan.ramps import Ramps
from ancf_petsc.plan.revolution import revolution_of
from ancf_petsc.plan.space import Space

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Part:
    """A case's mesh and space with what entries ask of them; tables are over its v nodal vectors and e cells, in file order.

    Today one part, on the root rank, is all of the mesh. Entries speak of a part nevertheless, and of sums over all parts
    (`total`), so that none of them stands in the way of reading and planning on every rank. normal: the axis that a plane body
    does not move along, None for a body in space. revolution: of a body whose section the mesh is. ramps: makes those of the case.
    """

    def __init__(self, case: Case, mesh: Mesh, element: Element) -> None:
        self.file: Path | None = case.file
        self.spec: CaseSpec = case.spec
        self.mesh, self.element = mesh, element
        self.space = Space(mesh, element)
        self.normal = plane_normal(self.space, case.spec, self._nodes_of, case.file)
        self.revolution = revolution_of(self.space, case.spec, self.normal, case.file)
        self.space.revolution = self.revolution
        self.ramps = Ramps(case.spec, case.file)

    @property
    def vectors(self) -> int:
        """How many nodal vectors the part has."""
        return self.space.vectors

    def group(self, name: str, key: str) -> Group:
        """A group of the case. Raises CaseError that names the key."""
        return find_group(self.mesh, name, key, self.file)

    @property
    def lacking(self) -> NDArray[np.bool_]:
        """(6,) translations and rotations that are no rigid motions of the body: those out of the plane of a plane one; a ring has
        none but the translation along its axis."""
        lacking = np.zeros(6, bool)
        if self.normal is not None:
            lacking[[self.normal, 3 + (self.normal + 1) % 3, 3 + (self.normal + 2) % 3]] = True
        if self.revolution is not None:
            lacking[:] = np.arange(6) != self.revolution.axis
        return lacking

    def _nodes_of(self, name: str, key: str) -> Integers:
        return self.group(name, key).nodes

    def positions(self, group: Group) -> Integers:
        """The nodal vectors that are positions of a group's nodes."""
        return self.space.first[self.space.compact[group.nodes]]

    def members(self, group: Group) -> NDArray[np.bool_]:
        """(v,) whether a nodal vector is the position of one of the group's nodes."""
        inside = np.zeros(self.vectors, bool)
        inside[self.positions(group)] = True
        return inside

    def node_mean(self, group: Group) -> Floats:
        """(v,) weights of the mean position of a group's nodes."""
        return self.members(group) / self.total(len(group.nodes))

    def total(self, number: float) -> float:
        """The sum of a number over all parts."""
        return number
