"""The XDMF file beside results.h5: one temporal collection that refers to the HDF5 data.

Format: XDMF 3, https://xdmf.org/index.php/XDMF_Model_and_Format, of which only what the readers of VTK
(ParaView, pyvista) and meshio have in common is used.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote
from xml.sax.saxutils import escape, quoteattr

from ancf_petsc.results.folder import write_atomic
from ancf_petsc.results.tables import write_whole


@dataclass(frozen=True)
class CellKind:
    """How others call a kind of cell: XDMF's topology, VTK's number; nodes a cell."""

    topology: str
    vtk: int
    nodes: int


CELL_KINDS = {  # by meshio's names
    "line": CellKind("Polyline", 3, 2),
    "line3": CellKind("Edge_3", 21, 3),
    "triangle": CellKind("Triangle", 5, 3),
    "triangle6": CellKind("Triangle_6", 22, 6),
    "quad": CellKind("Quadrilateral", 9, 4),
    "quad8": CellKind("Quadrilateral_8", 23, 8),
    "quad9": CellKind("Quadrilateral_9", 28, 9),
    "tetra": CellKind("Tetrahedron", 10, 4),
    "tetra10": CellKind("Tetrahedron_10", 24, 10),
    "hexahedron": CellKind("Hexahedron", 12, 8),
    "hexahedron20": CellKind("Hexahedron_20", 25, 20),
    "hexahedron27": CellKind("Hexahedron_27", 29, 27),
}


NO_NAME = "%"  # a link that no name becomes


@dataclass(frozen=True)
class Dataset:
    """One HDF5 dataset: its path in the file, shape, whether whole numbers, and where it lives."""

    path: str
    shape: tuple[int, ...]
    integer: bool = False
    centre: str = "Node"

    @property
    def name(self) -> str:
        return field_name(self.path.rsplit("/", 1)[-1])

    def item(self, file: str) -> str:
        dimensions = " ".join(map(str, self.shape))
        number = "Int" if self.integer else "Float"
        return (
            f'<DataItem Dimensions="{dimensions}" NumberType="{number}" Precision="8" Format="HDF">'
            f"{escape(f'{file}:{self.path}')}</DataItem>"
        )


def link_name(name: str) -> str:
    """A name as one HDF5 link that XDMF can point to.

    Slash and colon mean something else there, so do a lone dot and no name at all; a NUL ends a name.
    """
    if not name:
        return NO_NAME
    marks = "." if not name.strip(".") else "%/:"
    return "".join(f"%{ord(c):02X}" if c in marks or c < " " or c == "\x7f" else c for c in name)


def field_name(link: str) -> str:
    """The name that `link_name` made a link of."""
    return "" if link == NO_NAME else unquote(link)


def attribute_type(components: tuple[int, ...]) -> str:
    """XDMF's word for a value of shape `components`: (), (3,), (9,)."""
    words = {(): "Scalar", (1,): "Scalar", (2,): "Vector", (3,): "Vector", (6,): "Tensor6", (9,): "Tensor"}
    return words.get(components, "Matrix")


HEAD = (
    '<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>\n'
    '<Grid Name="steps" GridType="Collection" CollectionType="Temporal">\n'
)
TAIL = "</Grid>\n</Domain></Xdmf>\n"


class Xdmf:
    """Grows by a grid a step. `write` puts new grids and the closing tags over the old ones in one piece: every
    output costs the same, however many there were, and the file is whole after each.
    """

    def __init__(self, path: Path, data_file: str) -> None:
        self.path = path
        self.data_file = data_file
        self.mesh = ""
        self._waiting = ""
        self._end = 0

    def go_on(self) -> None:
        """Add to the steps that the file has. Raises OSError."""
        self._end = self.path.stat().st_size - len(TAIL.encode())

    def set_mesh(self, kind: str, points: Dataset, cells: Dataset) -> None:
        cell_kind = CELL_KINDS[kind]
        count, nodes = cells.shape
        size = f'NumberOfElements="{count}" NodesPerElement="{nodes}"'
        self.mesh = (
            f'<Topology TopologyType="{cell_kind.topology}" {size}>'
            f"{cells.item(self.data_file)}</Topology>\n"
            f'<Geometry GeometryType="XYZ">{points.item(self.data_file)}</Geometry>\n'
        )

    def add_step(self, time: float, fields: list[Dataset]) -> None:
        lines = [f'<Grid Name="body" GridType="Uniform">\n<Time Value="{time!r}"/>\n{self.mesh}']
        for field in fields:
            kind = attribute_type(field.shape[1:])
            lines.append(
                f'<Attribute Name={quoteattr(field.name)} AttributeType="{kind}" Center="{field.centre}">'
                f"{field.item(self.data_file)}</Attribute>\n"
            )
        self._waiting += "".join(lines) + "</Grid>\n"

    def write(self) -> None:
        """Put the steps added since the last time into the file."""
        grids = self._waiting.encode()
        if self._end == 0:
            write_atomic(self.path, HEAD + self._waiting + TAIL)
            self._end = len(HEAD.encode())
        else:
            self._replace_end(grids + TAIL.encode())
        self._end += len(grids)
        self._waiting = ""

    def _replace_end(self, text: bytes) -> None:
        """Write over the closing tags, which come back if there is no space."""
        with io.FileIO(self.path, "r+") as file:
            file.seek(self._end)
            write_whole(file, text, end=TAIL.encode())
