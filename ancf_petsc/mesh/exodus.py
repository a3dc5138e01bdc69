"""Exodus files (.e, .exo, .ex2): blocks, node sets and side sets with their names.

meshio reads them too; it loses the names of blocks, all side sets and the order of middles of bricks.
Source: Schoof and Yarberry, EXODUS II: a finite element data model, SAND92-2137, 1994.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.mesh.foreign.process import CURES, contents
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
    found = contents(path, "netcdf")
    try:
        return _Exodus(found, path).mesh()
    except (KeyError, IndexError, ValueError, AttributeError, TypeError, OverflowError) as error:
        reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise mesh_error(path)(f"not a mesh of Exodus ({reason})", cure=CURES["netcdf"]) from None


class _Exodus:
    """The mesh of what `foreign.by_netcdf` found."""

    def __init__(self, found: dict[str, Any], path: Path) -> None:
        self.path = path
        self.dimensions: dict[str, int] = found["dimensions"]
        self.variables: dict[str, np.ndarray] = found["variables"]
        self.titles: dict[str, str] = found["titles"]
        self.names: list[str] = []
        self.node_sets: dict[str, Integers] = {}

    def mesh(self) -> RawMesh:
        count = self.dimensions["num_nodes"]
        self._check_counts(count)
        numbers = self._numbers("node_num_map", count)
        blocks, rows = self._blocks(numbers)
        for number, name in self._sets("ns", "node_ns", "num_node_sets"):
            self.node_sets[name] = numbers[self._indices(f"node_ns{number}", count)]
            self.names.append(name)
        blocks += self._side_sets(blocks, rows)
        names = list(dict.fromkeys(self.names))
        return RawMesh(numbers, self._points(count), blocks, names, self.node_sets)

    def _check_counts(self, count: int) -> None:
        """Sizes of dimensions are those of what stands in the file."""
        wrong = mesh_error(self.path)
        axes = [name for name in ("coordx", "coordy", "coordz") if name in self.variables]
        given = self.variables["coord"].shape[-1:] if "coord" in self.variables else ()
        found = given or tuple(len(self.variables[name]) for name in axes) or (0,)
        if set(found) != {count}:
            raise wrong(
                f"coordinates of {found[0]} nodes",
                expected=f"{count} as num_nodes says",
                cure=CURES["netcdf"],
            )
        rows = [one.shape for name, one in self.variables.items() if name.startswith("connect")]
        if any(len(shape) != 2 for shape in rows):
            raise wrong("a block of elements is no table", cure=CURES["netcdf"])
        total = self.dimensions.get("num_elem", 0)
        if sum(shape[0] for shape in rows) < total:
            raise wrong(
                f"the blocks hold {sum(shape[0] for shape in rows)} elements",
                expected=f"{total} as num_elem says",
                cure=CURES["netcdf"],
            )

    def _array(self, name: str) -> np.ndarray:
        return np.asarray(self.variables[name])

    def _indices(self, name: str, bound: int) -> Integers:
        """Indices from 0 of what a variable numbers from 1."""
        found = self._array(name).astype(np.int64).ravel() - 1
        if len(found) and (found.min() < 0 or found.max() >= bound):
            raise mesh_error(self.path)(
                f"{name} names what is not there", got=int(found.max()) + 1, expected=f"1 to {bound}"
            )
        return found

    def _numbers(self, name: str, count: int) -> Integers:
        numbers = self._array(name).astype(np.int64) if name in self.variables else np.arange(1, count + 1)
        if len(np.unique(numbers)) < count or numbers.min(initial=1) < 1:
            return np.arange(1, count + 1)
        return numbers

    def _points(self, count: int) -> np.ndarray:
        points = np.zeros((count, 3))
        if "coord" in self.variables:
            given = self._array("coord").T
            points[:, : given.shape[1]] = given
            return points
        for axis, name in enumerate(("coordx", "coordy", "coordz")):
            if name in self.variables:
                points[:, axis] = self._array(name)
        return points

    def _sets(self, short: str, variable: str, dimension: str) -> list[tuple[int, str]]:
        """Number of each block or set, and its name: as given, else its kind and id."""
        if dimension not in self.dimensions:
            return []
        count = self.dimensions[dimension]
        if count > len(self.variables):
            raise mesh_error(self.path)(
                f"{dimension} is {count}", expected="as many as stand in the file", cure=CURES["netcdf"]
            )
        ids = self._array(f"{short}_prop1") if f"{short}_prop1" in self.variables else np.arange(1, count + 1)
        given = self._words(f"{short}_names") if f"{short}_names" in self.variables else [""] * count
        kind = {"eb": "block", "ns": "nodeset", "ss": "sideset"}[short]
        found = [(k + 1, given[k] or f"{kind}_{ids[k]}") for k in range(count)]
        return [(number, name) for number, name in found if f"{variable}{number}" in self.variables]

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
        total = self.dimensions.get("num_elem", 0)
        own = self._numbers("elem_num_map", total)
        for number, name in self._sets("eb", "connect", "num_el_blk"):
            variable = self.variables[f"connect{number}"]
            shape = variable.shape
            nodes = self._indices(f"connect{number}", len(numbers)).reshape(shape)
            title = self.titles[f"connect{number}"].strip("\0 ").upper()
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
