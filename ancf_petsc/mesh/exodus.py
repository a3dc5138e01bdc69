"""Exodus files (.e, .exo, .ex2): blocks, node sets and side sets with their names.

meshio reads them too; it loses the names of blocks, all side sets and the order of middles of bricks.
Source: Schoof and Yarberry, EXODUS II: a finite element data model, SAND92-2137, 1994.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.errors import EnvironmentProblem
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.mesh import Integers
from ancf_petsc.mesh.raw import Block, RawMesh, mesh_error

FAMILIES = {
    "TET": {4: "tetra", 10: "tetra10"},
    "HEX": {8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"},
    "WED": {6: "wedge", 15: "wedge15"},
    "PYR": {5: "pyramid", 13: "pyramid13"},
    "TRI": {3: "triangle", 6: "triangle6"},
    "QUA": {4: "quad", 8: "quad8", 9: "quad9"},
    "SHE": {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"},
    "BAR": {2: "line", 3: "line3"},
    "BEA": {2: "line", 3: "line3"},
    "TRU": {2: "line", 3: "line3"},
    "EDG": {2: "line", 3: "line3"},
}
"""Beginning of an element type -> number of nodes -> meshio's name."""
ORDER = {
    "hexahedron20": (*range(12), *range(16, 20), *range(12, 16)),
    "wedge15": (*range(9), *range(12, 15), *range(9, 12)),
}
"""Exodus has the middles of the upright edges before those of the top."""
SIDES = {
    "tetra": ((0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)),
    "hexahedron": ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7)),
    "wedge": ((0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)),
    "pyramid": ((0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 3), (0, 3, 2, 1)),
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
}
"""Corners of the sides of a cell, in Exodus's order."""


def read_exodus(path: Path) -> RawMesh:
    """The mesh in a file. Raises MeshError where it cannot be read, EnvironmentProblem without netCDF4."""
    try:
        import netCDF4
    except ImportError as error:
        raise EnvironmentProblem(
            f"Exodus files need netCDF4 ({error}); install it: pip install netCDF4"
        ) from None
    wrong = mesh_error(path)
    try:
        data = netCDF4.Dataset(str(path))
    except (OSError, RuntimeError, ValueError) as error:
        raise wrong(f"netCDF4 cannot read it ({error})", cure="write the mesh again as Exodus") from None
    with data:
        data.set_auto_mask(False)
        try:
            return _Exodus(data, path).mesh()
        except (KeyError, IndexError, ValueError, AttributeError, OSError, RuntimeError) as error:
            reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
            raise wrong(f"not a mesh of Exodus ({reason})", cure="write the mesh again as Exodus") from None


class _Exodus:
    def __init__(self, data: Any, path: Path) -> None:
        self.data, self.path = data, path
        self.names: list[str] = []
        self.node_sets: dict[str, Integers] = {}

    def mesh(self) -> RawMesh:
        count = len(self.data.dimensions["num_nodes"])
        numbers = self._numbers("node_num_map", count)
        blocks, rows = self._blocks(numbers)
        for number, name in self._sets("ns", "node_ns", "num_node_sets"):
            self.node_sets[name] = numbers[self._indices(f"node_ns{number}", count)]
            self.names.append(name)
        blocks += self._side_sets(blocks, rows)
        names = list(dict.fromkeys(self.names))
        return RawMesh(numbers, self._points(count), blocks, names, self.node_sets)

    def _array(self, name: str) -> np.ndarray:
        return np.asarray(self.data.variables[name][:])

    def _indices(self, name: str, bound: int) -> Integers:
        """Indices from 0 of what a variable numbers from 1."""
        found = self._array(name).astype(np.int64).ravel() - 1
        if len(found) and (found.min() < 0 or found.max() >= bound):
            raise mesh_error(self.path)(
                f"{name} names what is not there", got=int(found.max()) + 1, expected=f"1 to {bound}"
            )
        return found

    def _numbers(self, name: str, count: int) -> Integers:
        numbers = (
            self._array(name).astype(np.int64) if name in self.data.variables else np.arange(1, count + 1)
        )
        if len(np.unique(numbers)) < count or numbers.min(initial=1) < 1:
            return np.arange(1, count + 1)
        return numbers

    def _points(self, count: int) -> np.ndarray:
        points = np.zeros((count, 3))
        if "coord" in self.data.variables:
            given = self._array("coord").T
            points[:, : given.shape[1]] = given
            return points
        for axis, name in enumerate(("coordx", "coordy", "coordz")):
            if name in self.data.variables:
                points[:, axis] = self._array(name)
        return points

    def _sets(self, short: str, variable: str, dimension: str) -> list[tuple[int, str]]:
        """Number of each block or set, and its name: as given, else its kind and id."""
        if dimension not in self.data.dimensions:
            return []
        count = len(self.data.dimensions[dimension])
        ids = (
            self._array(f"{short}_prop1")
            if f"{short}_prop1" in self.data.variables
            else np.arange(1, count + 1)
        )
        given = self._words(f"{short}_names") if f"{short}_names" in self.data.variables else [""] * count
        kind = {"eb": "block", "ns": "nodeset", "ss": "sideset"}[short]
        found = [(k + 1, given[k] or f"{kind}_{ids[k]}") for k in range(count)]
        return [(number, name) for number, name in found if f"{variable}{number}" in self.data.variables]

    def _words(self, name: str) -> list[str]:
        words = []
        for row in self._array(name):
            raw = b"".join(bytes(letter) for letter in row).split(b"\0")[0].strip()
            try:
                words.append(raw.decode("utf-8"))
            except UnicodeDecodeError:
                words.append(raw.decode("latin-1"))
        return words

    def _blocks(self, numbers: Integers) -> tuple[list[Block], list[tuple[str, Integers]]]:
        """Blocks of cells; and for each the kind of its corners and its nodes as they stand, for side sets."""
        blocks, rows, start = [], [], 0
        total = len(self.data.dimensions["num_elem"]) if "num_elem" in self.data.dimensions else 0
        own = self._numbers("elem_num_map", total)
        for number, name in self._sets("eb", "connect", "num_el_blk"):
            variable = self.data.variables[f"connect{number}"]
            shape = variable.shape
            nodes = self._indices(f"connect{number}", len(numbers)).reshape(shape)
            title = str(getattr(variable, "elem_type", "")).strip("\0 ").upper()
            kind = FAMILIES.get(title[:3], {}).get(shape[1], title)
            ordered = nodes[:, ORDER[kind]] if kind in ORDER else nodes
            blocks.append(Block(kind, own[start : start + len(nodes)], numbers[ordered], (name,)))
            rows.append(((KINDS[kind].linear or kind) if kind in KINDS else kind, nodes))
            self.names.append(name)
            start += len(nodes)
        if start != total:
            raise mesh_error(self.path)(
                f"the blocks hold {start} elements", expected=f"{total} as num_elem says"
            )
        return blocks, [(kind, numbers[nodes]) for kind, nodes in rows]

    def _side_sets(self, blocks: list[Block], rows: list[tuple[str, Integers]]) -> list[Block]:
        """Faces of side sets as parts; each names an element, counted through all blocks, and one of its sides."""
        first = np.cumsum([0, *(len(block.numbers) for block in blocks)])
        found = []
        for number, name in self._sets("ss", "elem_ss", "num_side_sets"):
            self.names.append(name)
            elements = self._indices(f"elem_ss{number}", int(first[-1]))
            sides = self._array(f"side_ss{number}").astype(np.int64) - 1
            for (kind, nodes), start, stop in zip(rows, first[:-1], first[1:], strict=True):
                inside = (elements >= start) & (elements < stop)
                for side in np.unique(sides[inside]):
                    if kind not in SIDES or not 0 <= side < len(SIDES[kind]):
                        raise mesh_error(self.path)(
                            f"side set {name} names side {side + 1} of a {kind}", cure="mend it"
                        )
                    corners = nodes[elements[inside & (sides == side)] - start][:, SIDES[kind][side]]
                    part = {2: "line", 3: "triangle", 4: "quad"}[corners.shape[1]]
                    found.append(Block(part, np.arange(1, len(corners) + 1), corners, (name,)))
        return found
