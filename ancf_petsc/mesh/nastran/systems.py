"""Coordinate systems of Nastran: CORD1R, CORD1C, CORD1S, CORD2R, CORD2C, CORD2S.

Source: MSC Nastran Quick Reference Guide, entries CORD1R to CORD2S: the first point is the origin, the second lies on the z axis,
the third in the plane of x and z.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ancf_petsc.mesh.mesh import Floats
from ancf_petsc.mesh.nastran.bulk import Card, integers, numbers


class CoordinateSystem(NamedTuple):
    """kind: "R", "C" or "S"; axes: rows are the unit axes in the basic system."""

    kind: str
    origin: Floats
    axes: Floats

    def to_basic(self, given: Floats) -> Floats:
        """Points (n, 3) of coordinates in this system; angles are in degrees."""
        return rectangular(self.kind, given) @ self.axes + self.origin


DEEPEST = 100
"""Systems in systems: more would exceed Python's stack."""

BASIC = CoordinateSystem("R", np.zeros(3), np.eye(3))


def rectangular(kind: str, given: Floats) -> Floats:
    """x, y, z of coordinates (n, 3): C is r, theta, z; S is r, theta from the z axis, phi about it."""
    if kind == "R":
        return given
    second = np.radians(given[:, 1])
    if kind == "C":
        return np.stack([given[:, 0] * np.cos(second), given[:, 0] * np.sin(second), given[:, 2]], axis=1)
    third, across = np.radians(given[:, 2]), given[:, 0] * np.sin(second)
    return np.stack([across * np.cos(third), across * np.sin(third), given[:, 0] * np.cos(second)], axis=1)


class Systems:
    """The systems of a deck by number. place: position (3,) of a grid point by its number, as far as it is known."""

    def __init__(self, cards: list[Card], place: Callable[[Card, int, tuple[int, ...]], Floats]) -> None:
        self._cards: dict[int, tuple[Card, int]] = {}
        self._known = {0: BASIC}
        self._place = place
        for card in cards:
            for start in (1, 5) if card.name.startswith("CORD1") else (1,):
                if card.field(start):
                    number = int(integers([card], start)[0])
                    if number in self._cards:
                        raise card.error(f"coordinate system {number} is given twice", cure="give it once")
                    self._cards[number] = (card, start)

    def get(self, number: int, asked_by: Card, above: tuple[int, ...] = ()) -> CoordinateSystem:
        """A system by its number. Raises MeshError where it is missing or hangs on itself."""
        if number in self._known:
            return self._known[number]
        if number not in self._cards:
            raise asked_by.error(
                f"there is no coordinate system {number}", expected="CORD1 or CORD2 of R, C, S", cure="add it"
            )
        if number in above:
            raise asked_by.error(f"coordinate system {number} is defined by itself", cure="break the circle")
        if len(above) >= DEEPEST:
            raise asked_by.error(
                f"coordinate system {number} is the last of {DEEPEST} that are defined in each other",
                cure="define it in the basic system",
            )
        card, start = self._cards[number]
        above = (*above, number)
        if card.name.startswith("CORD1"):
            grids = [int(integers([card], start + k)[0]) for k in (1, 2, 3)]
            points = np.array([self._place(card, grid, above) for grid in grids])
        else:
            reference = self.get(int(integers([card], 2)[0]), card, above)
            given = np.array([numbers([card], k)[0] for k in range(3, 12)]).reshape(3, 3)
            points = reference.to_basic(given)
        self._known[number] = CoordinateSystem(card.name[5], points[0], _axes(card, points))
        return self._known[number]


def _axes(card: Card, points: Floats) -> Floats:
    z, toward_x = points[1] - points[0], points[2] - points[0]
    y = np.cross(z, toward_x)
    if not np.linalg.norm(y) > 1e-12 * np.linalg.norm(z) * np.linalg.norm(toward_x):
        raise card.error("its three points lie on one line", cure="give points that span a plane")
    z, y = z / np.linalg.norm(z), y / np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z])
