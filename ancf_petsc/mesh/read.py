"""Reading a mesh from a file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ancf_petsc.mesh.abaqus import read_abaqus
from ancf_petsc.mesh.assemble import assemble
from ancf_petsc.mesh.exodus import read_exodus
from ancf_petsc.mesh.gmsh_file import read_gmsh
from ancf_petsc.mesh.mesh import Mesh
from ancf_petsc.mesh.meshio_file import read_meshio
from ancf_petsc.mesh.msh_binary import read_binary
from ancf_petsc.mesh.msh_text import read_ordinary
from ancf_petsc.mesh.nastran import read_nastran
from ancf_petsc.mesh.raw import RawMesh, mesh_error


def read_mesh(
    path: str | Path, kinds: tuple[str, ...], *, duplicates: str = "error", element: str = "3413"
) -> Mesh:
    """The mesh in a file: nodes and cells in ascending file number, groups by physical name.

    kinds: meshio's names of the cells the element accepts; the body is meshed with one of them.
    duplicates: what to do with coincident nodes: "error", "keep" (a crack, two bodies) or "merge".
    element: the element's code, for messages.

    Raises MeshError where the file cannot be read or the mesh cannot be computed with.
    """
    path = Path(path)
    _require_file(path)
    with np.errstate(all="ignore"):  # coordinates that are not finite are an error of `assemble`
        raw = _raw(path)
    return assemble(raw, path, kinds, duplicates, element)


def _raw(path: Path) -> RawMesh:
    """What the reader for the kind of file finds in it."""
    suffix = path.suffix.lower()
    if suffix == ".msh" and not _is_ansys(path):
        return read_ordinary(path) or read_binary(path) or read_gmsh(path)
    if suffix == ".inp":
        return read_abaqus(path)
    if suffix in (".bdf", ".nas", ".fem"):
        return read_nastran(path)
    if suffix in (".e", ".exo", ".ex2", ".exii"):
        return read_exodus(path)
    return read_meshio(path)


def _require_file(path: Path) -> None:
    wrong = mesh_error(path)
    if "\0" in str(path):
        raise wrong("a path cannot hold a zero byte", cure="mend mesh.file")
    if not os.path.exists(path):
        raise wrong("there is no such file", cure="give the path of the mesh from the case file's folder")
    if not os.path.isfile(path):
        raise wrong("not a file", expected="a mesh file")
    if not os.access(path, os.R_OK):
        raise wrong("the file may not be read", cure="change its permissions")
    if not path.stat().st_size:
        raise wrong("the file is empty", cure="write the mesh again")


def _is_ansys(path: Path) -> bool:
    """Fluent's meshes have the same suffix as Gmsh's; they begin with a bracket."""
    with open(path, "rb") as file:
        return file.read(64).lstrip()[:1] == b"("
