"""Second readers of accepted meshes: the body's cells by their corners, read by a program that shares no code with this one's."""

from __future__ import annotations

import os
import pickle
import re
import signal
from pathlib import Path
from typing import Any

import numpy as np

SECONDS = 10
MESHIO_NAMES = {"3413": "tetra", "3813": "hexahedron"}
VTK_TYPES = {"3413": 10, "3813": 12}
GMSH_TYPES = {"3413": 4, "3813": 5}


PLACED = re.compile(
    rb"(?:^|[\r\n])[^\w*]*\*\s*(?:PART|INSTANCE|SYSTEM|NCOPY|NGEN|NFILL|ELGEN|ELCOPY|INCLUDE)", re.IGNORECASE
)
"""Keywords of decks that meshio passes over."""


class Unsupported(Exception):
    """The second reader does not read this, or not the same things."""


def corners(path: Path, kind: str, element: str) -> np.ndarray:
    """Corners (e, k, 3) of the body's cells as the second reader has them. Raises anything."""
    return {"msh_text": _gmsh, "msh_binary": _gmsh, "inp": _meshio, "bdf": _pynastran, "exodus": _exodus_by_hand, "vtu": _vtk_xml,
            "vtk": _vtk_legacy, "xdmf": _xdmf_by_hand, "med": _med_by_hand, "medit": _gmsh}[kind](path, element)  # fmt: skip


def _gmsh(path: Path, element: str) -> np.ndarray:
    import gmsh

    gmsh.initialize(interruptible=False, readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.merge(str(path))
    numbers, coordinates, _ = gmsh.model.mesh.getNodes()
    _, cells = gmsh.model.mesh.getElementsByType(GMSH_TYPES[element])
    order = np.argsort(numbers)
    rows = order[np.searchsorted(numbers, cells, sorter=order)]
    return coordinates.reshape(-1, 3)[rows].reshape(-1, len(rows) and {"3413": 4, "3813": 8}[element], 3)


def _meshio(path: Path, element: str) -> np.ndarray:
    import meshio

    text = path.read_bytes().replace(b"\0", b"")  # of UTF-16 too
    if path.suffix == ".inp" and PLACED.search(text):
        raise Unsupported("meshio knows none of these")
    mesh = meshio.read(path)
    cells = [block.data for block in mesh.cells if block.type == MESHIO_NAMES[element]]
    return np.asarray(mesh.points, float)[np.concatenate(cells)]


def _pynastran(path: Path, element: str) -> np.ndarray:
    from pyNastran.bdf.bdf import BDF

    model = BDF(debug=None, mode="msc")
    model.read_bdf(str(path), xref=False, punch="BEGIN BULK" not in path.read_text("latin-1").upper())
    model.cross_reference(xref=False, xref_nodes=True, xref_elements=False, xref_nodes_with_elements=False,
                          xref_properties=False, xref_masses=False, xref_materials=False, xref_loads=False,
                          xref_constraints=False, xref_aero=False, xref_sets=False, xref_optimization=False)  # fmt: skip
    title = {"3413": "CTETRA", "3813": "CHEXA"}[element]
    places = {number: node.get_position() for number, node in model.nodes.items()}
    return np.array(
        [[places[n] for n in one.node_ids] for one in model.elements.values() if one.type == title]
    )


def _of_vtk(grid: Any, element: str) -> np.ndarray:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    points = vtk_to_numpy(grid.GetPoints().GetData()).astype(float)
    wanted = VTK_TYPES[element]
    rows = []
    for cell in range(grid.GetNumberOfCells()):
        if grid.GetCellType(cell) == wanted:
            ids = grid.GetCell(cell).GetPointIds()
            rows.append([ids.GetId(k) for k in range(ids.GetNumberOfIds())])
    return points[np.array(rows, dtype=np.int64)]


def _silent(reader: Any, path: Path) -> Any:
    from vtkmodules.vtkCommonCore import vtkObject

    vtkObject.GlobalWarningDisplayOff()
    failed: list[str] = []
    reader.AddObserver("ErrorEvent", lambda *_: failed.append("error"))
    reader.SetFileName(str(path))
    reader.Update()
    if failed or reader.GetErrorCode():
        raise Unsupported("VTK reports an error")
    return reader


def _vtk_xml(path: Path, element: str) -> np.ndarray:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    return _of_vtk(_silent(vtkXMLUnstructuredGridReader(), path).GetOutput(), element)


def _vtk_legacy(path: Path, element: str) -> np.ndarray:
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridReader

    return _of_vtk(_silent(vtkUnstructuredGridReader(), path).GetOutput(), element)


def _exodus_by_hand(path: Path, element: str) -> np.ndarray:
    """Coordinates and connectivity of all blocks of the kind, by netCDF4 alone."""
    import netCDF4

    title, width = {"3413": ("TET", 4), "3813": ("HEX", 8)}[element]
    with netCDF4.Dataset(path) as data:
        axes = [np.asarray(data[f"coord{axis}"][:], float) for axis in "xyz"]
        blocks = [one for name, one in data.variables.items() if re.fullmatch(r"connect\d+", name)]
        rows = [
            np.asarray(one[:])
            for one in blocks
            if one.elem_type.upper().startswith(title) and one.shape[1] == width
        ]
    return np.stack(axes, axis=1)[np.concatenate(rows) - 1]


def _xdmf_by_hand(path: Path, element: str) -> np.ndarray:
    """Geometry and the mixed topology that meshio writes, by h5py and numpy alone."""
    from xml.etree import ElementTree

    grid = ElementTree.parse(path).getroot().find(".//Grid")  # noqa: S314  in a process of its own, of limited memory
    assert grid is not None
    geometry, topology = grid.find("Geometry/DataItem"), grid.find("Topology")
    assert geometry is not None
    assert topology is not None
    points = _data_item(geometry, path)
    item = topology.find("DataItem")
    if item is None or (topology.get("TopologyType") or topology.get("Type")) != "Mixed":
        raise Unsupported("another topology")
    flat = _data_item(item, path).astype(np.int64).ravel()
    rows, at, sizes = [], 0, {4: 3, 6: 4, 9: 8}
    wanted = {"3413": 6, "3813": 9}[element]
    while at < len(flat):
        size = sizes.get(int(flat[at]))
        if size is None:
            raise Unsupported("another cell")
        if flat[at] == wanted:
            rows.append(flat[at + 1 : at + 1 + size])
        at += 1 + size
    return points.astype(float).reshape(len(points), -1)[np.array(rows)]


def _data_item(item: Any, path: Path) -> np.ndarray:
    shape = tuple(map(int, item.get("Dimensions").split()))
    text = (item.text or "").strip()
    if item.get("Format") == "HDF":
        import h5py

        name, _, place = text.partition(":")
        with h5py.File(path.parent / name, "r") as file:
            return np.asarray(file[place][()])
    kind = {"Float": "f", "Int": "i", "UInt": "u"}[item.get("DataType") or item.get("NumberType") or "Float"]
    dtype = np.dtype(f"{kind}{item.get('Precision', '4')}")
    if item.get("Format") == "Binary":
        return np.fromfile(path.parent / text, dtype).reshape(shape)
    return np.array(text.split(), dtype=dtype).reshape(shape)


def _med_by_hand(path: Path, element: str) -> np.ndarray:
    import h5py

    with h5py.File(path, "r") as file:
        (mesh,) = file["ENS_MAA"].values()
        (step,) = mesh.values() if "NOE" not in mesh else (mesh,)
        count = int(step["NOE/COO"].attrs["NBR"])
        points = step["NOE/COO"][()].reshape(-1, count).T
        cells = step["MAI/TE4/NOD"]
        nodes = cells[()].reshape(4, int(cells.attrs["NBR"])).T - 1
        return points[nodes]


def read_apart(path: Path, kind: str, element: str) -> tuple[str, np.ndarray | None]:
    """`corners` in a process of its own, which may die or not end: ("read", corners) or (why not, None)."""
    receive, send = os.pipe()
    child = os.fork()
    if not child:
        _answer(send, path, kind, element)
    os.close(send)
    with os.fdopen(receive, "rb") as pipe:
        said = pipe.read()
    os.waitpid(child, 0)
    if not said:
        return "second reader died", None
    return pickle.loads(said)  # noqa: S301  of the process just forked


def _answer(send: int, path: Path, kind: str, element: str) -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(1, 2)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(SECONDS)
    try:
        answer: tuple[str, Any] = ("read", corners(path, kind, element))
    except BaseException as error:
        answer = (f"second reader refuses: {type(error).__name__}", None)
    with os.fdopen(send, "wb") as pipe:
        pipe.write(pickle.dumps(answer))
    os._exit(0)


def canonical(cells: np.ndarray) -> np.ndarray:
    """Cells (e, k, 3) in an order that neither numbering decides: corners within each, then cells."""
    cells = np.asarray(cells, float) + 0.0
    order = np.lexsort(np.moveaxis(cells, 2, 0)[::-1], axis=1)
    cells = np.take_along_axis(cells, order[..., None], axis=1)
    flat = cells.reshape(len(cells), -1)
    return np.unique(flat, axis=0)


def same(ours: np.ndarray, theirs: np.ndarray, relative: float = 1e-6) -> bool:
    """Whether both are the same cells, to the digits a deck may hold."""
    if theirs.ndim != 3 or not len(theirs) or not np.isfinite(theirs).all():
        return False
    scale = np.abs(ours).max()
    a, b = canonical(np.round(ours / scale, 7)), canonical(np.round(theirs / scale, 7))
    return a.shape == b.shape and bool(np.allclose(a, b, rtol=0, atol=relative))
