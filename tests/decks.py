"""A small bar as decks of other programs write it, in many styles."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from ancf_petsc import case_from_dict, run
from ancf_petsc.mesh.generate import bricks
from ancf_petsc.mesh.kinds import KUHN

FORCE = 8594.0290162641
"""Of the bar stretched by 20 %, E = 5e6, nu = 0.4, neo-Hookean, cross-section 0.1 x 0.1: in closed form for any mesh."""

BAR_KINDS = {"TET4": "tetra", "TETRA": "tetra", "HEX8": "hexahedron", "HEX": "hexahedron"}
"""Exodus's types of elements."""


@dataclass
class Bar:
    """0.1 x 0.1 x length along z. numbers (n,) with gaps, points (n, 3); element numbers (e,), nodes (e, k) by number."""

    numbers: np.ndarray
    points: np.ndarray
    elements: np.ndarray
    nodes: np.ndarray
    sets: dict[str, list[int]]
    lower: list[int]


def bar(divisions: tuple[int, int, int] = (1, 1, 2), length: float = 0.2, *, tetrahedra: bool = True) -> Bar:
    """Bricks, or six tetrahedra in each."""
    axes = [np.linspace(0, size, n + 1) for size, n in zip((0.1, 0.1, length), divisions, strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    points, cells = bricks(np.stack([x, y, z], axis=-1))
    if tetrahedra:
        cells = cells[:, np.array(KUHN)].reshape(-1, 4)
    numbers = 7 + 3 * np.arange(len(points))
    planes = {"bottom": (2, 0.0), "top": (2, length), "left": (0, 0.0), "front": (1, 0.0)}
    sets = {name: numbers[points[:, axis] == at].tolist() for name, (axis, at) in planes.items()}
    elements = 11 + 2 * np.arange(len(cells))
    lower = elements[points[cells].mean(axis=1)[:, 2] < length / 2].tolist()
    return Bar(numbers, points, elements, numbers[cells], sets, lower)


def node_lines(body: Bar) -> list[str]:
    return [
        f"{n}, {x!r}, {y!r}, {z!r}" for n, (x, y, z) in zip(body.numbers, body.points.tolist(), strict=True)
    ]


def element_lines(body: Bar) -> list[str]:
    return [", ".join(map(str, (n, *row))) for n, row in zip(body.elements, body.nodes.tolist(), strict=True)]


def abaqus(body: Bar, kind: str = "C3D4", **more: str) -> str:
    """The plainest deck; more: text in place of a part of it, by name: nodes, elements, or a set."""
    parts = {
        "nodes": "\n".join(["*NODE", *node_lines(body)]),
        "elements": "\n".join([f"*ELEMENT, TYPE={kind}", *element_lines(body)]),
        **{name: f"*NSET, NSET={name}\n" + ",\n".join(map(str, own)) for name, own in body.sets.items()},
        "lower": "*ELSET, ELSET=lower\n" + "\n".join(map(str, body.lower)),
    }
    return "\n".join((parts | more).values()) + "\n"


class Style:
    """Writes the same mesh differently each time: case, blanks, comments, order, pieces, ranges, sets of sets."""

    def __init__(self, random: Random, folder: Path, *, plain: bool = False) -> None:
        """plain: nothing that CalculiX does not read: names with blanks, broken lines, sets before their members."""
        self.random, self.folder, self.plain = random, folder, plain
        self.made = 0

    def text(self, body: Bar, kind: str = "C3D4") -> str:
        pieces = [*self._nodes(body), *self._elements(body, kind)]
        sets = [self._set("nset", name, own) for name, own in body.sets.items()] + [
            self._set("elset", "lower", body.lower)
        ]
        self.random.shuffle(sets)
        for piece in sets:
            if not self.plain and self.random.random() < 0.3:  # a set may stand before its members
                pieces.insert(self.random.randrange(len(pieces) + 1), piece)
            else:
                pieces.append(piece)
        for noise in (
            ()
            if self.plain
            else ("*MATERIAL, NAME=rubber", "*ELASTIC\n5e6, 0.4", "*STEP\n*STATIC\n1., 1.\n*END STEP")
        ):
            pieces.insert(self.random.randrange(len(pieces) + 1), noise)
        lines = [line for piece in pieces for line in self._included(piece).split("\n")]
        text = "\n".join(
            ["*Heading", " a bar, 1, 2, 3", *(noisy for line in lines for noisy in self._noise(line))]
        )
        return text.replace("\n", self.random.choice(["\n", "\r\n"])) + "\n"

    def _included(self, piece: str) -> str:
        if self.random.random() > 0.15:
            return piece
        self.made += 1
        name = f"part{self.made}.inp" if self.plain else f"part {self.made}.inp"
        (self.folder / name).write_text(piece + "\n")
        return f"*INCLUDE, INPUT={name}" if self.plain else f'*INCLUDE, INPUT="{name}"'

    def _noise(self, line: str) -> list[str]:
        r = self.random
        if line.startswith("*"):
            if not line.upper().startswith("*INCLUDE"):
                line = r.choice(
                    [
                        line,
                        re.sub(r"^[^=]+|,[^=,]+", lambda found: found[0].upper(), line),
                        line.replace(",", " , ").replace("=", " = "),
                        line.replace("*", "* ", 1),
                    ]
                )
                if not self.plain and "," in line and r.random() < 0.3:  # the keyword line goes on
                    head, _, tail = line.partition(",")
                    line = f"{head},\n  {tail}"
        elif r.random() < 0.4:
            line = line.replace(", ", r.choice([",", " ,", " ,\t", ",  "]))
        return [*(["** a comment, 1, 2"] * (r.random() < 0.1)), line, *([""] * (r.random() < 0.05))]

    def _split(self, things: Sequence[Any], most: int = 3) -> list[list[Any]]:
        cuts = sorted(self.random.randrange(len(things) + 1) for _ in range(self.random.randrange(most)))
        bounds = [0, *cuts, len(things)]
        return [list(things[a:b]) for a, b in zip(bounds, bounds[1:], strict=False) if b > a]

    def _number(self, value: float) -> str:
        if self.plain:
            return f"{value:.9e}"
        return self.random.choice([repr(value), f"{value:.17e}", f"{value:.17E}".replace("E", "D")])

    def _nodes(self, body: Bar) -> list[str]:
        rows = list(zip(body.numbers.tolist(), body.points.tolist(), strict=True))
        self.random.shuffle(rows)
        lines = [", ".join([str(n), *(self._number(value) for value in point)]) for n, point in rows]
        heads = ["*node", "*Node, nset=all_of_them", *([] if self.plain else ["*NODE, SYSTEM=R"])]
        return ["\n".join([self.random.choice(heads), *piece]) for piece in self._split(lines)]

    def _elements(self, body: Bar, kind: str) -> list[str]:
        lines = []
        for line in element_lines(body):
            words = line.split(", ")
            cut = self.random.randrange(2, len(words))
            broken = ", ".join(words[:cut]) + ",\n" + ", ".join(words[cut:])
            lines.append(broken if not self.plain and self.random.random() < 0.2 else line)
        self.random.shuffle(lines)
        heads = [f"*element, type={kind}", f"*Element, elset=solid, type={kind.lower()}"]
        return ["\n".join([self.random.choice(heads), *piece]) for piece in self._split(lines)]

    def _set(self, what: str, name: str, members: Sequence[int]) -> str:
        """In pieces: ranges, lists, members of helper sets; the name in changing case."""
        text = []
        for piece in self._split(self.random.sample(list(members), len(members))):
            shown = self.random.choice([name, name.upper(), name.capitalize()]) if text else name
            head = f"*{what}, {what}={shown}"
            way = self.random.randrange(4)
            if way == 0:
                text.append("\n".join([f"{head}, generate", *(f"{n}, {n}, 1" for n in piece)]))
            elif way == 1:
                step = int(np.gcd.reduce(np.diff(sorted(piece)))) if len(piece) > 1 else 1
                inside = set(range(min(piece), max(piece) + 1, step)) == set(piece)
                text.append(
                    f"{head}, GENERATE\n{min(piece)}, {max(piece)}, {step}"
                    if inside
                    else f"{head}\n{self._list(piece)}"
                )
            elif way == 2:
                self.made += 1
                helper = f"_{name}_{self.made}"
                own, others = piece[: len(piece) // 2], piece[len(piece) // 2 :]
                first = [f"*{what}, {what}={helper}\n{self._list(own)}"] if own else []
                text += [*first, f"{head}\n{self._list([*([helper] if own else []), *others])}"]
            else:
                text.append(f"{head}\n{self._list(piece)}")
        return "\n".join(text)

    def _list(self, members: Sequence[Any]) -> str:
        lines, left = [], [str(member) for member in members]
        while left:
            size = self.random.randrange(1, 17)
            lines.append(", ".join(left[:size]))
            left = left[size:]
        end = self.random.choice(["", ","])
        return f"{end}\n".join(lines) + end


def assert_is(mesh: Any, body: Bar) -> None:
    """The mesh that was read is the bar: numbers, places, elements and sets."""
    assert mesh.node_numbers.tolist() == body.numbers.tolist()
    assert np.allclose(mesh.points, body.points, rtol=0, atol=1e-15)
    assert mesh.cell_numbers.tolist() == body.elements.tolist()
    assert mesh.node_numbers[mesh.cells].tolist() == body.nodes.tolist()
    for name, own in body.sets.items():
        assert mesh.node_numbers[mesh.groups[name].nodes].tolist() == own, name
    lower = np.unique(body.nodes[np.isin(body.elements, body.lower)])
    assert mesh.node_numbers[mesh.groups["lower"].nodes].tolist() == lower.tolist()
    assert len(mesh.groups["lower"].parts[3]) == len(body.lower)


def pulled(
    folder: Path,
    mesh: Path,
    *,
    element: str = "3413",
    stroke: float = 0.04,
    names: Mapping[str, str] | None = None,
    groups: Mapping[str, Any] | None = None,
    axes: str = "xyz",
) -> float:
    """Force at the top of the bar stretched by `stroke`; names: groups by the names of the bar's sets; axes: of the bar."""
    name = {own: own for own in ("bottom", "top", "left", "front")} | dict(names or {})
    x, y, z = axes
    data = {
        "title": "bar",
        "mesh": {"file": str(mesh), "element": element},
        "groups": dict(groups or {}),
        "material": {"law": "neo_hooke", "young": 5e6, "poisson": 0.4},
        "constraint": [
            {"group": name["bottom"], "fix": [z]},
            {"group": name["left"], "fix": [x]},
            {"group": name["front"], "fix": [y]},
            {"group": name["top"], "move": {z: stroke}},
        ],
        "statics": {"steps": 1},
        "output": {"curve": {"force": f"{name['top']}.{z}", "stroke": f"{name['top']}.{z}"}},
    }
    return float(run(case_from_dict(data, folder), folder / "run").curve["force"][-1])
