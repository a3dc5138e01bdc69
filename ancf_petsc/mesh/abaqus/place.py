"""Where nodes are: cylindrical and spherical coordinates, *SYSTEM, parts and their instances."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ancf_petsc.mesh.abaqus.data import label, rows, table
from ancf_petsc.mesh.abaqus.deck import KeywordCard
from ancf_petsc.mesh.abaqus.scope import Instance, Reader, Scope
from ancf_petsc.mesh.mesh import Floats


def to_rectangular(card: KeywordCard, system: str, given: Floats) -> Floats:
    """Points (n, 3) of coordinates in SYSTEM=R (x, y, z), C (r, theta, z) or S (r, theta, phi), angles in degrees.

    phi is measured from the plane of x and y towards z.
    """
    kind = label(system).key[:1] or "R"
    if kind == "R":
        return given
    if kind not in "CS":
        raise card.error("SYSTEM", got=system, expected="R, C or S")
    theta = np.radians(given[:, 1])
    if kind == "C":
        radius, height = given[:, 0], given[:, 2]
    else:
        phi = np.radians(given[:, 2])
        radius, height = given[:, 0] * np.cos(phi), given[:, 0] * np.sin(phi)
    return np.stack([radius * np.cos(theta), radius * np.sin(theta), height], axis=1)


def system(reader: Reader, card: KeywordCard) -> None:
    """*SYSTEM: origin, a point on the x axis, a point in the x-y plane; without data the global axes again."""
    card.known()
    data = rows(card, 6)
    if not len(data):
        reader.scope.to_global = None
        return
    origin, along, across = data[0, :3], data[0, 3:], None
    if len(data) > 1:
        across = data[1, :3] - origin
    given = table(card).counts[0]
    axes = np.eye(3)
    if given > 3:
        x = along - origin
        if across is None:
            x, across = x * (1, 1, 0), np.cross((0, 0, 1), x * (1, 1, 0))
        axes = _axes(card, x, across)
    reader.scope.to_global = _affine(axes, origin)


def _axes(card: KeywordCard, x: Floats, y: Floats) -> Floats:
    """Rows are the unit axes with x along the first and y in the plane of both."""
    z = np.cross(x, y)
    if not np.linalg.norm(z) > 1e-12 * np.linalg.norm(x) * np.linalg.norm(y):
        raise card.error(
            "the points of the system lie on one line", cure="give three points that span a plane"
        )
    first, third = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return np.stack([first, np.cross(third, first), third])


def _affine(axes: Floats, origin: Floats) -> Callable[[Floats], Floats]:
    return lambda points: points @ axes + origin


def part(reader: Reader, card: KeywordCard) -> None:
    name = label(card.needed(card.known("NAME", ignored=("INTERNAL",)), "NAME"))
    _outside(reader, card, "a part")
    if name.key in reader.parts:
        raise card.error("a second part of this name", got=name.shown, cure="give each part its own name")
    reader.parts[name.key] = reader.scope = Scope(name.shown)


def end_part(reader: Reader, card: KeywordCard) -> None:
    reader.scope = reader.assembly


def assembly(reader: Reader, card: KeywordCard) -> None:
    _outside(reader, card, "the assembly")
    reader.has_assembly = True


def end_assembly(reader: Reader, card: KeywordCard) -> None:
    reader.scope = reader.assembly


def _outside(reader: Reader, card: KeywordCard, what: str) -> None:
    if reader.scope is not reader.assembly:
        raise card.error(
            f"{what} within {reader.scope.name!r}, which is not ended",
            cure="end it by *END PART or *END INSTANCE",
        )


def instance(reader: Reader, card: KeywordCard) -> None:
    """*INSTANCE: a part, or a mesh of its own that follows, moved and then turned about the axis from a to b."""
    given = card.known("NAME", "PART", ignored=("DEPENDENT",))
    name = label(card.needed(given, "NAME"))
    source = label(card.needed(given, "PART"))
    _outside(reader, card, "an instance")
    if name.key in reader.instances:
        raise card.error(
            "a second instance of this name", got=name.shown, cure="give each instance its own name"
        )
    if source.key not in reader.parts:
        known = ", ".join(scope.name for scope in reader.parts.values()) or "none"
        raise card.error(
            "there is no such part", got=source.shown, expected=f"one of {known}", cure="add the *PART"
        )
    rotation, shift = motion(card)
    own = Scope(name.shown)
    reader.instances[name.key] = Instance(name.key, name.shown, own, rotation, shift)
    reader.scope, reader.open_instance = own, (name.key, reader.parts[source.key])


def end_instance(reader: Reader, card: KeywordCard) -> None:
    """An instance without a mesh of its own has that of its part; sets and surfaces of both are there."""
    if reader.open_instance is None:
        raise card.error("there is no instance to end", cure="mend the deck")
    key, source = reader.open_instance
    own = reader.scope
    if not own.nodes and not own.elements:
        own.nodes, own.elements = source.nodes, source.elements
        for what, sets in source.sets.items():
            own.sets[what] = sets | own.sets[what]
        own.surfaces = source.surfaces | own.surfaces
    reader.scope, reader.open_instance = reader.assembly, None
    reader.used_parts.add(label(source.name).key)


def motion(card: KeywordCard) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and shift (3,) of data lines: a translation, then two points of an axis and an angle in degrees."""
    flat, counts = table(card)
    start = int(counts[0]) if len(counts) else 0
    first = flat[:start]
    if start >= 7:
        raise card.error("the first data line", got=f"{start} numbers", expected="a translation of 3 numbers")
    move = np.zeros(3)
    move[: len(first[:3])] = first[:3]
    if len(flat) == start:
        return np.eye(3), move
    turn = flat[start:]
    if len(turn) != 7:
        raise card.error(
            "a rotation",
            got=f"{len(turn)} numbers",
            expected="two points of the axis and an angle: 7 numbers",
        )
    a, b, angle = turn[:3], turn[3:6], turn[6]
    length = np.linalg.norm(b - a)
    if not length > 0:
        raise card.error("the axis of rotation has no length", cure="give two points that differ")
    rotation = rotation_about((b - a) / length, angle)
    return rotation, rotation @ (move - a) + a


def rotation_about(axis: Floats, degrees: float) -> Floats:
    """(3, 3) by Rodrigues' formula; exact for multiples of a right angle."""
    quarter, rest = divmod(degrees, 90.0)
    if rest == 0:
        sine, cosine = ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0))[int(quarter) % 4]
    else:
        sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return cosine * np.eye(3) + sine * cross + (1 - cosine) * np.outer(axis, axis)
