"""The XDMF file beside results.h5: one temporal collection that refers to the HDF5 data.

Format: XDMF 3, https://xdmf.org/index.php/XDMF_Model_and_Format, of which only what the readers of VTK
(ParaView, pyvista) and meshio have in common is used.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote
from xml.sax.saxutils import escape, quoteattr

from ancf_petsc.results.folder import write_atomic


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
    """A name as one HDF5 link that XDMF can point to: slash and colon mean something else there."""
    for mark in "%/:":
        name = name.replace(mark, f"%{ord(mark):02X}")
    return name


field_name = unquote


def attribute_type(components: tuple[int, ...]) -> str:
    """XDMF's word for a value of shape `components`: (), (3,), (9,)."""
    words = {(): "Scalar", (1,): "Scalar", (2,): "Vector", (3,): "Vector", (6,): "Tensor6", (9,): "Tensor"}
    return words.get(components, "Matrix")


class Xdmf:
    """Grows by a grid a step; `write` replaces the file as a whole, so a reader never sees half of it."""

    def __init__(self, path: Path, data_file: str) -> None:
        self.path = path
        self.data_file = data_file
        self.grids: list[str] = []
        self.mesh = ""

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
        self.grids.append("".join(lines) + "</Grid>\n")

    def write(self) -> None:
        head = '<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>\n'
        collection = '<Grid Name="steps" GridType="Collection" CollectionType="Temporal">\n'
        write_atomic(self.path, head + collection + "".join(self.grids) + "</Grid>\n</Domain></Xdmf>\n")
