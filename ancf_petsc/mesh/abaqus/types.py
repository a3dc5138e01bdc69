"""Element types of Abaqus: the kind of cell, its faces as surfaces name them, and what has no part in a body.

Order of nodes and faces: Abaqus Analysis User's Guide, "Three-dimensional solid element library" and its neighbours.
"""

from __future__ import annotations

import re
from typing import NamedTuple

Faces = dict[str, tuple[int, ...]]


class CellShape(NamedTuple):
    """kind: meshio's name. order: its nodes among those of the file, where that differs."""

    kind: str
    order: tuple[int, ...] = ()


SHAPES = {
    4: CellShape("tetra"),
    10: CellShape("tetra10"),
    8: CellShape("hexahedron"),
    20: CellShape("hexahedron20"),
    6: CellShape("wedge"),
    15: CellShape("wedge15"),
    5: CellShape("pyramid"),
    13: CellShape("pyramid13"),
}
"""Of solids by the number of their nodes."""
PLANE_SHAPES = {
    3: CellShape("triangle"),
    4: CellShape("quad"),
    6: CellShape("triangle6"),
    8: CellShape("quad8"),
    9: CellShape("quad9"),
}
# Abaqus has the middle of a line second, meshio last.
LINE_SHAPES = {2: CellShape("line"), 3: CellShape("line3", (0, 2, 1))}

SOLID = "solid"
PLANE = "plane"
AXISYMMETRIC = "axisymmetric"
SKIN = "skin"
LINE = "line"
BEYOND = "no cell"

_NO_CELL = re.compile(
    r"(SPRING[12A]|DASHPOT[12A]|MASS|ROTARYI|HEATCAP|CONN[23]D2|JOINTC|JOINT2D|JOINT3D|GAP\w+|ITT\w+|DRAG[23]D|"
    r"DCOUP[23]D|PSI\w+|PD3D|FRAME[23]D|PIPE\w*|ELBOW\w*|D|DGAP|CT3D\w+)"
)

FACES: dict[str, Faces] = {
    "tetra": {"S1": (0, 1, 2), "S2": (0, 3, 1), "S3": (1, 3, 2), "S4": (2, 3, 0)},
    "hexahedron": {
        "S1": (0, 1, 2, 3),
        "S2": (4, 7, 6, 5),
        "S3": (0, 4, 5, 1),
        "S4": (1, 5, 6, 2),
        "S5": (2, 6, 7, 3),
        "S6": (3, 7, 4, 0),
    },
    "wedge": {"S1": (0, 1, 2), "S2": (3, 5, 4), "S3": (0, 3, 4, 1), "S4": (1, 4, 5, 2), "S5": (2, 5, 3, 0)},
    "pyramid": {"S1": (0, 1, 2, 3), "S2": (0, 4, 1), "S3": (1, 4, 2), "S4": (2, 4, 3), "S5": (3, 4, 0)},
    "triangle": {"S1": (0, 1), "S2": (1, 2), "S3": (2, 0)},
    "quad": {"S1": (0, 1), "S2": (1, 2), "S3": (2, 3), "S4": (3, 0)},
    "line": {"END1": (0,), "END2": (1,)},
}
"""Corners of the faces by the kind of the corners."""

_PATTERNS: tuple[tuple[str, str, dict[int, CellShape]], ...] = (
    (r"C3D(4|5|6|8|10|13|15|20)(?!V)[A-Z]*", SOLID, SHAPES),
    (r"CP[ES]G?(3|4|6|8)[A-Z]*", PLANE, PLANE_SHAPES),
    (r"CG?AX(3|4|6|8)[A-Z]*", AXISYMMETRIC, PLANE_SHAPES),
    (r"(?:S|M3D|SFM3D|R3D|DS|STRI)(3|4|6|8|9)[A-Z]*5?", SKIN, PLANE_SHAPES),
    (r"(?:T[23]D|R2D|RAX|RB[23]D)([23])[A-Z]*", LINE, LINE_SHAPES),
)
"""Family by family; the group is the number of nodes."""
_BEAM = re.compile(r"(?:B[23]|(?:SFM|S|M|DS)AX)([123])[A-Z]*")
_ORDER_NODES = {"1": 2, "2": 3, "3": 2}
"""Of beams and axisymmetric shells, which are numbered by their order; 3 is cubic with two nodes."""


class ElementType(NamedTuple):
    """family: what the type is for; shape: None for what is no cell, such as a spring."""

    family: str
    shape: CellShape | None = None


def element_type(name: str) -> ElementType | None:
    """What a type is; None for one that is not known here."""
    if _NO_CELL.fullmatch(name):
        return ElementType(BEYOND)
    beam = _BEAM.fullmatch(name)
    if beam:
        return ElementType(LINE, LINE_SHAPES[_ORDER_NODES[beam[1]]])
    for pattern, family, shapes in _PATTERNS:
        found = re.fullmatch(pattern, name)
        if found:
            nodes = int(found[1])
            return ElementType(family, shapes[nodes]) if nodes in shapes else None
    return None
