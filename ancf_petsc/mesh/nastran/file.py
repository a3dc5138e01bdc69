"""Reading the mesh in bulk data: grid points in their coordinate systems, elements, properties and sets as groups.

What describes the mesh is read, what does not is skipped and named in a note. `docs/case-format.md` lists it.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Floats, Integers
from ancf_petsc.mesh.nastran.bulk import Card, integers, listed, numbers, read_bulk
from ancf_petsc.mesh.nastran.systems import Systems
from ancf_petsc.mesh.raw import Block, RawMesh, mesh_error


class Shape(NamedTuple):
    """kinds: number of nodes -> meshio's name. first: the field of the first node; pid: whether field 3 is the property."""

    kinds: dict[int, str]
    first: int = 3
    pid: bool = True


ORDER = {
    "hexahedron20": (*range(12), *range(16, 20), *range(12, 16)),
    "wedge15": (*range(9), *range(12, 15), *range(9, 12)),
}
"""Nastran has the middles of the upright edges before those of the top."""

TRIANGLE, QUAD = {3: "triangle", 6: "triangle6"}, {4: "quad", 8: "quad8", 9: "quad9"}
SHAPES = {
    "CTETRA": Shape({4: "tetra", 10: "tetra10"}),
    "CHEXA": Shape({8: "hexahedron", 20: "hexahedron20"}),
    "CPENTA": Shape({6: "wedge", 15: "wedge15"}),
    "CPYRAM": Shape({5: "pyramid", 13: "pyramid13"}),
    "CPYRA": Shape({5: "pyramid", 13: "pyramid13"}),
    **dict.fromkeys(("CTRIA3", "CTRIAR", "CPLSTN3", "CPLSTS3"), Shape({3: "triangle"})),
    **dict.fromkeys(("CTRIA6", "CPLSTN6", "CPLSTS6"), Shape(TRIANGLE)),
    **dict.fromkeys(("CQUAD4", "CQUADR", "CSHEAR", "CPLSTN4", "CPLSTS4"), Shape({4: "quad"})),
    **dict.fromkeys(("CQUAD8", "CQUAD", "CPLSTN8", "CPLSTS8"), Shape(QUAD)),
    **dict.fromkeys(("CROD", "CTUBE", "CBAR", "CBEAM", "CBEND"), Shape({2: "line"})),
    "CONROD": Shape({2: "line"}, first=2, pid=False),
}
REFUSED = (
    "CTRIAX",
    "CTRIAX6",
    "CTRAX3",
    "CTRAX6",
    "CQUADX",
    "CQUADX4",
    "CQUADX8",
    "CIFHEX",
    "CIFPENT",
    "CIFQDX",
    "CBEAM3",
)
"""Elements of bodies whose cells are not known here."""
MECHANICS = re.compile(
    r"C(?:ELAS|BUSH|DAMP|MASS|VISC|GAP|FAST|WELD|SEAM|INTC)\w*|CONM\d|R(?:BE\d|BAR|ROD|TRPLT|SPLINE|SSCON)\w*|MPC\w*|SPC\w*|"
    r"BCONP|BCTABLE|BCTSET|BCTADD|BGSET|TIE|CONTACT|SPOINT|EPOINT"
)
NAMED = re.compile(
    r'HMNAME\s+(?:PROP|COMP)\S*\s+([0-9]{1,15})\s*"([^"]+)"|\s*Femap Property ([0-9]{1,15}) : (.+)',
    re.IGNORECASE,
)


def read_nastran(path: Path) -> RawMesh:
    """The mesh in a deck. Raises MeshError with file and line of what cannot be read."""
    notes: list[str] = []
    cards, comments = read_bulk(path, notes)
    by_name: dict[str, list[Card]] = defaultdict(list)
    for card in cards:
        by_name[card.name].append(card)
    for name in REFUSED:
        if name in by_name:
            raise by_name[name][0].error(
                "this element is not read", cure="write the body with CTETRA, CHEXA, CQUAD4 or CBAR"
            )
    grids = by_name.pop("GRID", [])
    if not grids:
        raise mesh_error(path)("the file holds no GRID", cure="write the bulk data of the mesh")
    node_numbers, points = _grids(grids, by_name, notes)
    blocks = [
        block for name in list(by_name) if name in SHAPES for block in _elements(name, by_name.pop(name))
    ]
    _refuse_doubled(blocks, path)
    raw = RawMesh(node_numbers, points, blocks, notes=notes)
    _sets(raw, by_name, comments)
    _note_skipped(notes, by_name)
    return raw


def _grids(grids: list[Card], by_name: dict[str, list[Card]], notes: list[str]) -> tuple[Integers, Floats]:
    """Numbers (n,) and points (n, 3) in the basic system. Raises MeshError where one is given twice at two places."""
    default = by_name.pop("GRDSET", [])
    number = integers(grids, 1)
    frame = integers(grids, 2, default[0].field(2) or "0" if default else "0")
    given = np.stack([numbers(grids, field) for field in (3, 4, 5)], axis=1)
    row_of = {int(own): row for row, own in enumerate(number)}

    def place(card: Card, grid: int, above: tuple[int, ...]) -> Floats:
        if grid not in row_of:
            raise card.error(f"there is no GRID {grid}", cure="add it")
        row = row_of[grid]
        return systems.get(int(frame[row]), card, above).to_basic(given[row : row + 1])[0]

    systems = Systems(
        [card for name in list(by_name) if name.startswith("CORD") for card in by_name.pop(name)], place
    )
    points = np.empty_like(given)
    for own in np.unique(frame):
        rows = np.flatnonzero(frame == own)
        points[rows] = systems.get(int(own), grids[rows[0]]).to_basic(given[rows])
    turned = np.count_nonzero(integers(grids, 6, default[0].field(6) or "0" if default else "0"))
    if turned:
        notes.append(
            f"{turned} GRIDs have output directions of their own (CD): results are in the basic system"
        )
    return _once(number, points, grids)


def _once(number: Integers, points: Floats, grids: list[Card]) -> tuple[Integers, Floats]:
    order = np.argsort(number, kind="stable")
    number, points = number[order], points[order]
    if number[0] < 1:
        raise grids[order[0]].error("its number", got=int(number[0]), expected="1 or more")
    again = np.flatnonzero(number[1:] == number[:-1])
    moved = again[(points[again] != points[again + 1]).any(axis=1)]
    if len(moved):
        card = grids[order[moved[0] + 1]]
        raise card.error(
            f"{len(moved)} GRIDs are given again at other places, first {number[moved[0]]}",
            cure="give each once",
        )
    kept = np.append(True, number[1:] != number[:-1])
    return number[kept], points[kept]


def _elements(name: str, cards: list[Card]) -> list[Block]:
    """Blocks by number of nodes and property."""
    shape = SHAPES[name]
    most = max(shape.kinds)
    rows: dict[tuple[int, str], list[Card]] = defaultdict(list)
    for card in cards:
        given = [bool(word) for word in card.fields[shape.first : shape.first + most]]
        count = len(given) - given[::-1].index(True) if any(given) else 0
        count = min((size for size in shape.kinds if size >= count), default=most)
        rows[count, (card.field(2) or card.field(1)) if shape.pid else ""].append(card)
    blocks = []
    for (count, _), own in rows.items():
        kind = shape.kinds[count]
        nodes = np.stack([integers(own, shape.first + k) for k in range(count)], axis=1)
        missing = np.flatnonzero((nodes < 1).any(axis=1))
        if len(missing):
            card = own[missing[0]]
            raise card.error(
                f"element {card.field(1)} lacks nodes: {(nodes[missing[0]] > 0).sum()}",
                expected=" or ".join(map(str, shape.kinds)),
                cure="write it with all of them",
            )
        numbers_ = integers(own, 1)
        names: tuple[str, ...] = ()
        if shape.pid:
            number = int(integers(own[:1], 2, own[0].field(1))[0])
            names = (f"physical_{KINDS[kind].dimension}_{number}",)
        blocks.append(Block(kind, numbers_, nodes[:, ORDER[kind]] if kind in ORDER else nodes, names))
    return blocks


def _refuse_doubled(blocks: list[Block], path: Path) -> None:
    every = np.sort(np.concatenate([np.empty(0, np.int64), *(block.numbers for block in blocks)]))
    twice = np.unique(every[1:][every[1:] == every[:-1]])
    if len(twice):
        raise mesh_error(path)(
            f"{len(twice)} element numbers are given twice, first {twice[0]}", cure="give each its own number"
        )


def _sets(raw: RawMesh, by_name: dict[str, list[Card]], comments: list[str]) -> None:
    """Names of properties from comments, and sets of grid points and elements, as groups."""
    shown = {}
    for comment in comments:
        found = NAMED.match(comment)
        if found:
            shown[int(found[1] or found[3])] = (found[2] or found[4]).strip()
    raw.blocks = [_also(block, shown) for block in raw.blocks]
    raw.names = list(dict.fromkeys(name for block in raw.blocks for name in block.names))
    body = list(raw.blocks)
    for card in by_name.pop("SET1", []):
        _node_set(raw, card, listed_after(card, 2))
    for card in [*by_name.pop("SET3", []), *by_name.pop("SET", [])]:
        kind = card.field(2).upper()
        start = 9 if card.name == "SET" else 3
        if (
            card.name == "SET"
            and card.field(3).upper() not in ("", "LIST")
            or kind not in ("GRID", "ELEM", "ELEMENT")
        ):
            raw.notes.append(
                f"set {card.field(1)} of {kind or 'no kind'} {card.field(3)} is not read".replace("  ", " ")
            )
        elif kind == "GRID":
            _node_set(raw, card, listed_after(card, start))
        else:
            _element_set(raw, card, listed_after(card, start), body)


def listed_after(card: Card, start: int) -> Integers:
    while start < len(card.fields) and card.field(start).upper() in ("SKIN", "THRU", ""):
        start += 1
    return listed(card, start)


def _also(block: Block, shown: dict[int, str]) -> Block:
    names = [
        shown[int(name.rpartition("_")[2])] for name in block.names if int(name.rpartition("_")[2]) in shown
    ]
    return replace(block, names=(*block.names, *names))


def _node_set(raw: RawMesh, card: Card, nodes: Integers) -> None:
    name = f"set_{card.field(1)}"
    missing = nodes[~np.isin(nodes, raw.node_numbers)]
    if len(missing):
        raise card.error(
            f"{len(missing)} grid points of the set are not there, first {missing[0]}", cure="mend the set"
        )
    raw.names.append(name)
    raw.node_sets[name] = np.union1d(raw.node_sets.get(name, nodes), nodes)


def _element_set(raw: RawMesh, card: Card, numbers_: Integers, body: list[Block]) -> None:
    name, found = f"set_{card.field(1)}", 0
    raw.names.append(name)
    for block in body:
        rows = np.isin(block.numbers, numbers_)
        found += int(rows.sum())
        if rows.any():
            raw.blocks.append(Block(block.kind, block.numbers[rows], block.nodes[rows], (name,)))
    if found < len(numbers_):
        raw.notes.append(
            f"{len(numbers_) - found} elements of set {card.field(1)} are no cells of the mesh: left out"
        )


def _note_skipped(notes: list[str], by_name: dict[str, list[Card]]) -> None:
    mechanics = [name for name in by_name if MECHANICS.fullmatch(name)]
    others = [name for name in by_name if name not in mechanics]
    if mechanics:
        notes.append(
            f"not taken over from the deck, though it changes how the body moves: {', '.join(mechanics)}"
        )
    if others:
        notes.append(f"cards of the deck that do not describe the mesh are skipped: {', '.join(others)}")
