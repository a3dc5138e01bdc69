"""The benchmarks' meshes: the project's own, and larger ones made once and kept in the user's cache."""

from __future__ import annotations

import re
from pathlib import Path

import ancf_petsc
from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.made import Request, made_mesh

PROJECT = Path(ancf_petsc.__file__).resolve().parent.parent
MADE = re.compile(
    r"(?P<body>[a-z_]+):(?P<how>[0-9.]+|\d+x\d+x\d+)(?P<more>:hexahedra|:quadratic|:line)?"
    r"(:rim=(?P<rim>[0-9.]+))?"
)


def mesh_path(name: str) -> Path:
    """The file of a mesh: "cube_m2" is the project's; "cube:0.0025" (size), "cube:4x4x8" (bricks) are made.

    ":hexahedra" leaves bricks whole, ":line" keeps the axis alone, ":quadratic" adds mid-nodes, ":rim=0.001" at the end
    grades towards rims with edges of that length there.
    """
    made = MADE.fullmatch(name)
    if made is None:
        return project_file("meshes", f"{name}.msh")
    bricks = "x" in made["how"]
    nx, ny, nz = (int(count) for count in made["how"].split("x")) if bricks else (0, 0, 0)
    request = Request(
        body=made["body"],
        size=None if bricks else float(made["how"]),
        rim=None if made["rim"] is None else float(made["rim"]),
        divisions=(nx, ny, nz) if bricks else None,
        hexahedra=made["more"] == ":hexahedra",
        order=2 if made["more"] == ":quadratic" else 1,
        flat="line" if made["more"] == ":line" else "",
    )
    return made_mesh(request)


def project_file(*parts: str) -> Path:
    """A file of the project's checkout."""
    file = PROJECT.joinpath(*parts)
    if not file.is_file():
        cure = "run the benchmarks from a checkout of the project, installed by scripts/setup"
        raise CaseError("the benchmarks' file is missing", file=file, cure=cure)
    return file
