"""Text files of Gmsh (.msh 2.2 and 4.1) as Gmsh writes them, read section by section in this process.

A small mesh is read before a process with Gmsh in it has started, a large one several times faster; meshio, which
reads them too, loses the numbers of nodes and cells and all but one group of a cell. What is out of the
ordinary (other sections, a kind of cell unknown here) is left to Gmsh; what does not fit (a count, a number given twice)
is an error, since Gmsh drops cells without a word.
"""

from __future__ import annotations

import re
import warnings
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ancf_petsc.mesh.kinds import BY_GMSH
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.raw import Block, RawMesh, mesh_error
from ancf_petsc.mesh.text import decoded

SECTIONS = {"2.2": ("Nodes", "Elements"), "4.1": ("Entities", "Nodes", "Elements")}
OTHER_SECTIONS = {"Periodic", "NodeData", "ElementData", "ElementNodeData", "InterpolationScheme", "Comments"}
"""They say nothing of nodes, elements and groups."""
PARAMETRIC = "ParametricNodes"
"""Nodes of version 2 with their place on the entity behind the coordinates."""
MOST_RUNS = 10_000
"""Of elements of one kind with equally many tags: more are not worth looking at one by one."""

MOST_NUMBER = 2**53
"""Numbers of nodes are read as floating point: up to here exactly."""

CURE = "the file is truncated or damaged: write it again"

Names = dict[tuple[int, int], str]
Rows = dict[tuple[str, tuple[str, ...]], list[Integers]]


class NotOrdinary(Exception):
    """The file holds something that is left to Gmsh."""


def read_ordinary(path: Path) -> RawMesh | None:
    """The mesh in an ordinary text file, else None. Raises MeshError where counts or numbers of one do not fit."""
    notes: list[str] = []
    try:
        version, sections = _sections(path, notes)
        names = physical_names(sections.pop("PhysicalNames", ""))
        read = _read_22 if version == "2.2" else _read_41
        numbers, points, rows = read(sections, names)
        return raw_mesh(numbers, points, rows, names, path, notes)
    except (NotOrdinary, ValueError, IndexError, OverflowError):
        check_lines(path)
        return None


def check_lines(path: Path) -> None:
    """Compare the lines of $Nodes and $Elements of a text file with the numbers they announce. Raises MeshError."""
    data = path.read_bytes()
    head = re.match(rb"\s*\$MeshFormat\s+(\d+(?:\.\d+)?)\s+0\s", data)
    if head is None:
        return
    version = float(head[1])
    for name in ("Nodes", PARAMETRIC, "Elements"):
        found = re.search(
            rb"^\$" + name.encode() + rb"[ \t]*\r?\n(.*?)^\$End" + name.encode(),
            data,
            re.DOTALL | re.MULTILINE,
        )
        if found is None:
            continue
        lines = [line for line in found[1].split(b"\n") if line.strip()]
        try:
            counts = [int(word) for word in lines[0].split()]
            expected = (
                counts[0]
                if version < 4
                else counts[0] + counts[1] * (2 if name == "Nodes" and version > 4 else 1)
            )
        except (ValueError, IndexError, OverflowError):
            raise mesh_error(path)(f"${name} does not begin with how many they are", cure=CURE) from None
        if len(lines) - 1 != expected:
            raise mesh_error(path)(
                f"${name} holds {len(lines) - 1} lines",
                expected=f"{expected} as its first line announces",
                cure=CURE,
            )


def _sections(path: Path, notes: list[str]) -> tuple[str, dict[str, str]]:
    """Version, and the text of each section by its name."""
    data = path.read_bytes()
    head = re.match(rb"\$MeshFormat\r?\n(2\.2|4\.1) 0 8\r?\n\$EndMeshFormat\s", data)
    if head is None:
        raise NotOrdinary
    version, found, at = head[1].decode(), {}, head.end()
    start = re.compile(rb"\s*\$(\w+)[ \t]*\r?\n")
    while (begun := start.match(data, at)) is not None:
        ending = b"$End" + begun[1]
        end = data.find(ending, begun.end())
        if end < 0 or begun[1].decode() in found:
            raise NotOrdinary
        text = data[begun.end() : end]
        name = begun[1].decode()
        if name not in OTHER_SECTIONS:
            found[name] = decoded(text, notes) if name == "PhysicalNames" else text.decode("ascii")
        at = end + len(ending)
    wanted = {*SECTIONS[version]}
    if PARAMETRIC in found and version == "2.2":
        found["Nodes"] = _without_parameters(found.pop(PARAMETRIC))
    if data[at:].strip() or {*found} - {"PhysicalNames"} != wanted:
        raise NotOrdinary
    return version, found


def _without_parameters(text: str) -> str:
    """The lines of $ParametricNodes as those of $Nodes."""
    first, *lines = text.strip().split("\n")
    return "\n".join([first, *(" ".join(line.split(None, 4)[:4]) for line in lines)])


def physical_names(text: str) -> Names:
    """(dimension, tag) -> name, in the order of the file."""
    entries = re.findall(r'^(\d) (\d+) "([^"\n]*)"\s*$', text, re.MULTILINE)
    if text and len(entries) != int(text.split(maxsplit=1)[0]):
        raise NotOrdinary
    return {(int(dimension), int(tag)): name for dimension, tag, name in entries}


def _numbers(text: str, kind: type) -> np.ndarray:
    """Every number of a text; the text may hold nothing else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found: np.ndarray = np.fromstring(text, kind, sep=" ")
        except DeprecationWarning:
            raise NotOrdinary from None
    if kind is np.int64 and len(found) and max(-int(found.min()), int(found.max())) >= MOST_NUMBER:
        raise NotOrdinary  # larger ones have become the largest there is
    return found


def _whole(found: Floats) -> Integers:
    """Numbers of nodes, read beside coordinates."""
    if not (found == np.floor(found)).all() or not (np.abs(found) < MOST_NUMBER).all():
        raise NotOrdinary
    return found.astype(np.int64)


def group_of(names: Names, dimension: int, tag: int) -> tuple[str, ...]:
    if tag < 0:
        raise NotOrdinary
    return (names.get((dimension, tag)) or f"physical_{dimension}_{tag}",) if tag else ()


# --- version 2.2: every element has its tags, the first is its physical group


def _read_22(sections: dict[str, str], names: Names) -> tuple[Integers, Floats, Rows]:
    table = _numbers(sections["Nodes"], float)
    if len(table) != 1 + 4 * table[0]:
        raise NotOrdinary
    table, rows = table[1:].reshape(-1, 4), defaultdict(list)
    for number, run in _runs(_numbers(sections["Elements"], np.int64)):
        kind, tags = BY_GMSH[number], run[:, 3]
        for tag in np.unique(tags):
            group = group_of(names, kind.dimension, int(tag))
            own = run if len(tags) == 1 else run[tags == tag]
            rows[kind.name, group].append(np.delete(own, np.s_[1 : 3 + own[0, 2]], axis=1))
    return _whole(table[:, 0]), table[:, 1:], rows


def _runs(flat: Integers) -> Iterator[tuple[int, Integers]]:
    """Gmsh's kind and rows (m, 3 + tags + nodes) of elements that follow each other with equally many numbers."""
    at, count, runs = 1, 0, 0
    while at < len(flat):
        number, tags = int(flat[at + 1]), int(flat[at + 2])
        if number not in BY_GMSH or tags < 1 or runs == MOST_RUNS:
            raise NotOrdinary
        width = 3 + tags + BY_GMSH[number].nodes
        look = 64
        while True:
            rows = flat[at : at + min(look, (len(flat) - at) // width) * width].reshape(-1, width)
            same = (rows[:, 1] == number) & (rows[:, 2] == tags)
            if not same.all() or len(rows) < look:
                break
            look *= 8
        rows = rows if same.all() else rows[: np.argmin(same)]
        if not len(rows):
            raise NotOrdinary
        yield number, rows
        at, count, runs = at + rows.size, count + len(rows), runs + 1
    if count != flat[0]:
        raise NotOrdinary


# --- version 4.1: elements stand by entity, and entities have physical groups


def _read_41(sections: dict[str, str], names: Names) -> tuple[Integers, Floats, Rows]:
    groups = _entity_groups(sections["Entities"], names)
    numbers, points = _nodes_41(_numbers(sections["Nodes"], float))
    flat, rows, at, count, blocks = _numbers(sections["Elements"], np.int64), defaultdict(list), 4, 0, 0
    while at < len(flat):
        dimension, entity, number, size = (int(value) for value in flat[at : at + 4])
        if number not in BY_GMSH or (dimension, entity) not in groups or not 0 <= size <= len(flat):
            raise NotOrdinary
        width, at = 1 + BY_GMSH[number].nodes, at + 4
        block = flat[at : at + size * width].reshape(size, width)
        rows[BY_GMSH[number].name, groups[dimension, entity]].append(block)
        at, count, blocks = at + block.size, count + size, blocks + 1
    if count != flat[1] or blocks != flat[0]:
        raise NotOrdinary
    return numbers, points, rows


def _nodes_41(flat: Floats) -> tuple[Integers, Floats]:
    numbers, points, at = [np.empty(0)], [np.empty((0, 3))], 4
    while at < len(flat):
        _, _, parametric, size = (int(value) for value in flat[at : at + 4])
        if parametric or not 0 <= size <= len(flat):
            raise NotOrdinary
        at += 4
        numbers.append(flat[at : at + size])
        points.append(flat[at + size : at + 4 * size].reshape(size, 3))
        at += 4 * size
    found = _whole(np.concatenate(numbers))
    if len(found) != flat[1] or len(numbers) - 1 != flat[0]:
        raise NotOrdinary
    return found, np.concatenate(points)


def _entity_groups(text: str, names: Names) -> dict[tuple[int, int], tuple[str, ...]]:
    """(dimension, tag) of every entity -> its groups."""
    lines = text.splitlines()
    counts = [int(word) for word in lines[0].split()]
    if len(lines) != 1 + sum(counts) or len(counts) != 4:
        raise NotOrdinary
    found: dict[tuple[int, int], tuple[str, ...]] = {}
    for dimension, line in zip(np.repeat(np.arange(4), counts), lines[1:], strict=True):
        words = line.split()
        first = 4 if dimension == 0 else 7
        tags = [int(word) for word in words[first + 1 : first + 1 + int(words[first])]]
        every = [name for tag in tags for name in group_of(names, int(dimension), tag)]
        found[int(dimension), int(words[0])] = tuple(dict.fromkeys(every))
    return found


def raw_mesh(
    numbers: Integers, points: Floats, rows: Rows, names: Names, path: Path, notes: list[str]
) -> RawMesh:
    """Blocks in meshio's order of nodes. Raises MeshError where two nodes or two elements have one number."""
    _refuse_doubled("node", numbers, path)
    _refuse_doubled(
        "element",
        np.concatenate([table[:, 0] for parts in rows.values() for table in parts] or [numbers]),
        path,
    )
    blocks = []
    for (kind, groups), parts in rows.items():
        table = np.concatenate(parts)
        nodes = table[:, 1:]
        order = next(known.gmsh_order for known in BY_GMSH.values() if known.name == kind)
        blocks.append(Block(kind, table[:, 0], nodes[:, order] if order else nodes, groups))
    spoken = [*names.values(), *(name for block in blocks for name in block.names)]
    return RawMesh(numbers, points, blocks, list(dict.fromkeys(spoken)), notes=notes)


def _refuse_doubled(what: str, numbers: Integers, path: Path) -> None:
    ascending = np.sort(numbers)
    twice = np.unique(ascending[1:][ascending[1:] == ascending[:-1]])
    if len(twice):
        raise mesh_error(path)(
            f"{len(twice)} {what} numbers are given twice, first {what} {twice[0]}", cure=CURE
        )
