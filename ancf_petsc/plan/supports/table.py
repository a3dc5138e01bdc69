"""Which degrees of freedom are driven, and by what."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.groups import parts_for_support
from ancf_petsc.mesh.mesh import Group
from ancf_petsc.model.drive import HELD, Drive
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.slopes import prescribed_slopes
from ancf_petsc.plan.supports.frames import Contradiction, Wanted, frame_of
from ancf_petsc.plan.supports.mirrors import Prescribed, mirrors_of


class SupportTable:
    """drive (v, 3): index into drives of each degree of freedom of a part's nodal vectors, -1 where it is free.

    frame (v,): index into axes (k, 3, 3) of the nodal vectors whose degrees of freedom are along the columns there, -1 where they
    are along the axes.
    Supports enter it with `prescribe`, `prescribe_normal` and `hold`; `finish` adds what follows from all of them.
    """

    def __init__(self, part: Part) -> None:
        self.part = part
        self.drive = np.full((part.vectors, 3), -1, np.int32)
        self.drives: list[Drive] = []
        self.frame = np.full(part.vectors, -1, np.int32)
        self.axes: NDArray[np.float64] = np.zeros((0, 3, 3))
        self._groups: list[str] = []
        self._source = np.full((part.vectors, 3), -1, np.int32)
        self._prescribed: list[Prescribed] = []
        self._held: list[tuple[NDArray[np.int64], int]] = []
        self._normals: list[tuple[str, NDArray[np.int64], NDArray[np.float64]]] = []

    def prescribe(self, group: Group, drives: Mapping[int, Drive]) -> None:
        """Let components of the positions of a group's nodes follow drives: axis -> drive.

        The slopes along what the group is meshed with are held. Raises CaseError where another support drives the same degree of
        freedom differently.
        """
        vectors = self.part.positions(group)
        self._groups.append(group.name)
        for axis, drive in drives.items():
            index = self._index_of(drive)
            present = self.drive[vectors, axis]
            clash = (present >= 0) & (present != index)
            if clash.any():
                raise self._contradiction(group.name, vectors[clash], axis, drive)
            self.drive[vectors, axis] = index
            self._source[vectors, axis] = len(self._groups) - 1
        if self.part.element.has_slopes:
            parts = parts_for_support(self.part.mesh, group)
            self._prescribed.append(Prescribed(group.name, dict(drives), parts))

    def prescribe_normal(self, group: Group, normal: NDArray[np.float64]) -> None:
        """Hold the positions of a group's nodes along a unit vector (3,)."""
        self._normals.append((group.name, self.part.positions(group), normal))

    def hold(self, vectors: NDArray[np.int64], axis: int) -> None:
        """Hold a component of nodal vectors where nothing else drives it, once all supports are known."""
        self._held.append((vectors, axis))

    def finish(self) -> None:
        """Hold the slopes along surfaces and lines whose positions are prescribed, those across planes of symmetry, and what else
        is to be held."""
        if self.part.element.has_slopes:
            self._hold_slopes_along_surfaces()
        for vectors, axis in self._held:
            self._hold(vectors, axis)
        if self.part.normal is not None:
            self._hold(np.arange(self.part.vectors), self.part.normal)
        if self._normals:
            self._make_frames()

    def _make_frames(self) -> None:
        """Give the nodes of oblique planes their frames: nodes of which the same is asked share one."""
        nodes = np.unique(np.concatenate([vectors for _, vectors, _ in self._normals]))
        member = np.stack([np.isin(nodes, vectors) for _, vectors, _ in self._normals], axis=1)
        asked, which = np.unique(np.hstack((member, self.drive[nodes])), axis=0, return_inverse=True)
        axes: list[NDArray[np.float64]] = []
        for number, row in enumerate(asked):
            here, drive = nodes[which.ravel() == number], row[member.shape[1] :]
            wanted = [
                Wanted(np.eye(3)[i], self.drives[drive[i]], self._asking(here[0], i))
                for i in range(3)
                if drive[i] >= 0
            ]
            wanted += [
                Wanted(n, HELD, name)
                for inside, (name, _, n) in zip(row, self._normals, strict=False)
                if inside
            ]
            try:
                frame = frame_of(wanted)
            except Contradiction as problem:
                raise self._against(problem, here, wanted) from None
            if not frame.is_global:
                self.frame[here] = len(axes)
                axes.append(frame.axes)
            for i, found in enumerate(frame.drives):
                self.drive[here, i] = -1 if found is None else self._index_of(found)
        self.axes = np.array(axes).reshape(-1, 3, 3)

    def _asking(self, vector: int, axis: int) -> str:
        source = self._source[vector, axis]
        return self._groups[source] if source >= 0 else "the plane of the body"

    def _against(self, problem: Contradiction, vectors: NDArray[np.int64], wanted: list[Wanted]) -> CaseError:
        name, direction, space = problem.wanted.name, problem.wanted.direction, self.part.space
        others = ", ".join(
            repr(other) for other in dict.fromkeys(item.name for item in wanted) if other != name
        )
        node = self.part.mesh.node_numbers[space.nodes[space.node_of()[vectors[0]]]]
        return CaseError(
            f"the constraint on {name!r} holds ({', '.join(f'{c:.6g}' for c in direction)}) and contradicts {others} at "
            f"{len(vectors)} nodes, the first is node {node}: {problem.why}",
            key=f"constraint.{name}.fix",
            got=["normal"],
            expected="supports that agree, or move along the plane",
            cure="take the shared nodes out of one group, or move them along the plane",
        )

    def _hold_slopes_along_surfaces(self) -> None:
        surfaces = [(set(drives), parts) for _, drives, parts in self._prescribed]
        mirrors = mirrors_of(self.part, self._prescribed)
        held, odd = prescribed_slopes(self.part.space, surfaces, mirrors)
        for axis in range(3):
            self._hold(np.flatnonzero(held[:, axis]), axis)
        if odd:
            self.part.mesh.notes.append(
                f"at {odd} nodes surfaces at odd angles hold different components: all slopes of these components are held"
            )

    def _hold(self, vectors: NDArray[np.int64], axis: int) -> None:
        if len(vectors):
            free = vectors[self.drive[vectors, axis] < 0]
            self.drive[free, axis] = self._index_of(HELD)

    def _index_of(self, drive: Drive) -> int:
        if drive.amplitude == 0.0:
            drive = HELD
        if drive not in self.drives:
            self.drives.append(drive)
        return self.drives.index(drive)

    def _contradiction(self, group: str, vectors: NDArray[np.int64], axis: int, drive: Drive) -> CaseError:
        space, first = self.part.space, vectors[0]
        node = self.part.mesh.node_numbers[space.nodes[space.node_of()[first]]]
        other = self._groups[self._source[first, axis]]
        return CaseError(
            f"the constraints on {other!r} and {group!r} contradict each other: "
            f"{len(vectors)} nodes are driven twice in {AXES[axis]}, "
            f"the first is node {node}",
            key=f"constraint.{group}.{AXES[axis]}",
            got=drive.describe(),
            expected=f"{self.drives[self.drive[first, axis]].describe()} as {other!r} asks",
            cure="fix or move each degree of freedom once, or take the shared nodes out of one group",
        )
