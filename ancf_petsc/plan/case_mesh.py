"""The mesh of a case: the file it names or one made for it, refined as it asks."""

from __future__ import annotations

import os
from pathlib import Path

from ancf_petsc.element.catalog import element
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case
from ancf_petsc.mesh.mesh import Mesh
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.mesh.refine import refine


def mesh_file(case: Case) -> Path:
    """The file of a case's mesh; one of the program's bodies is made if it is not there. Raises CaseError."""
    asked = case.spec.mesh
    if asked.body is None:
        return Path(
            os.path.realpath(case.folder / str(asked.file))
        )  # Path.resolve raises on links in a circle
    from ancf_petsc.mesh.made import Request, made_mesh  # making meshes is rare, and takes time to import

    try:
        return made_mesh(
            Request(
                asked.body, asked.size, asked.rim, asked.divisions, asked.hexahedra, flat=asked.flat or ""
            )
        )
    except CaseError as error:
        error.file = error.file or case.file
        raise


def mesh_of(case: Case) -> Mesh:
    """The mesh a case is computed on, before the nodes that its element needs are added. Raises CaseError."""
    asked = case.spec.mesh
    row = element(asked.element)
    mesh = read_mesh(mesh_file(case), row.kinds, duplicates=asked.duplicates, element=row.code)
    refine(mesh, asked.refine)
    return mesh
