"""Binary files of Gmsh, version 4.1: read in this process, since counts that are damaged keep Gmsh busy for ever.

Source: Gmsh reference manual, "MSH file format".
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from ancf_petsc.mesh.kinds import BY_GMSH
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.msh_text import Names, NotOrdinary, Rows, group_of

Groups = dict[tuple[int, int], tuple[str, ...]]


class Cursor:
    """Reads numbers of one byte order one after the other. Raises ValueError where there are fewer than asked for."""

    def __init__(self, data: bytes, at: int, order: str) -> None:
        self.data, self.at, self.order = data, at, order

    def take(self, kind: str, count: int) -> np.ndarray:
        """kind: "i4", "u8" or "f8"."""
        row = np.dtype(self.order + kind)
        if count < 0 or count * row.itemsize > len(self.data) - self.at:
            raise ValueError(f"{count} numbers are announced where fewer follow")
        found = np.frombuffer(self.data, row, count, self.at)
        self.at += found.nbytes
        return found

    def whole(self, kind: str, count: int) -> list[int]:
        return [int(value) for value in self.take(kind, count)]

    def end(self, name: str) -> None:
        if re.match(rb"\s*\$End" + name.encode(), self.data[self.at : self.at + 64]) is None:
            raise ValueError(f"${name} does not end where its counts say")


def read_41(data: bytes, order: str, names: Names) -> tuple[Integers, Floats, Rows]:
    """Node numbers (n,), points (n, 3) and rows of elements by kind and groups.

    Raises NotOrdinary for what is left to Gmsh, ValueError where the file is damaged.
    """
    groups = _entities(_section(data, order, "Entities"), names)
    numbers, points = _nodes(_section(data, order, "Nodes"))
    rows: Rows = defaultdict(list)
    for kind, own, table in _elements(_section(data, order, "Elements"), groups):
        rows[kind, own].append(table)
    return numbers, points, rows


def _section(data: bytes, order: str, name: str) -> Cursor:
    start = re.search(rb"^\$" + name.encode() + rb"[ \t]*\r?\n", data, re.MULTILINE)
    if start is None:
        raise NotOrdinary
    return Cursor(data, start.end(), order)


def _entities(cursor: Cursor, names: Names) -> Groups:
    """(dimension, tag) of every entity -> its groups."""
    found: Groups = {}
    for dimension, count in enumerate(cursor.whole("u8", 4)):
        for _ in range(count):
            (tag,) = cursor.whole("i4", 1)
            cursor.take("f8", 3 if dimension == 0 else 6)
            tags = cursor.whole("i4", cursor.whole("u8", 1)[0])
            if dimension:
                cursor.take("i4", cursor.whole("u8", 1)[0])
            every = [name for own in tags for name in group_of(names, dimension, own)]
            found[dimension, tag] = tuple(dict.fromkeys(every))
    cursor.end("Entities")
    return found


def _nodes(cursor: Cursor) -> tuple[Integers, Floats]:
    blocks, total, _, _ = cursor.whole("u8", 4)
    numbers, points = [np.empty(0, np.int64)], [np.empty((0, 3))]
    for _ in range(blocks):
        dimension, _, parametric = cursor.whole("i4", 3)
        (count,) = cursor.whole("u8", 1)
        numbers.append(cursor.take("u8", count).astype(np.int64))
        width = 3 + (dimension if parametric else 0)
        if not 3 <= width <= 6:
            raise ValueError("$Nodes")
        points.append(cursor.take("f8", width * count).reshape(count, width)[:, :3].astype(float))
    cursor.end("Nodes")
    every = np.concatenate(numbers)
    if len(every) != total:
        raise ValueError(f"$Nodes holds {len(every)} nodes of {total}")
    return every, np.concatenate(points)


def _elements(cursor: Cursor, groups: Groups) -> Iterator[tuple[str, tuple[str, ...], Integers]]:
    """Kind, groups and rows (m, 1 + nodes) of every block."""
    blocks, total, _, _ = cursor.whole("u8", 4)
    read = 0
    for _ in range(blocks):
        dimension, entity, number = cursor.whole("i4", 3)
        (count,) = cursor.whole("u8", 1)
        if number not in BY_GMSH or (dimension, entity) not in groups:
            raise NotOrdinary
        kind = BY_GMSH[number]
        table = cursor.take("u8", count * (1 + kind.nodes)).reshape(count, -1).astype(np.int64)
        yield kind.name, groups[dimension, entity], table
        read += count
    cursor.end("Elements")
    if read != total:
        raise ValueError(f"$Elements holds {read} elements of {total}")
