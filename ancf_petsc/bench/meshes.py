"""The benchmarks' meshes: the project's own, and larger ones made once and kept in the user's cache."""

from __future__ import annotations

import os
import re
from pathlib import Path

import ancf_petsc
from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.generate import make_mesh

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
    place = cache_folder() / f"{name.replace(':', '_')}.msh"
    if not place.is_file():
        place.parent.mkdir(parents=True, exist_ok=True)
        _make(made, place)
    return place


def _make(made: re.Match[str], place: Path) -> None:
    bricks = "x" in made["how"]
    draft = place.with_name(f"{os.getpid()}.msh")
    make_mesh(
        made["body"],
        draft,
        size=None if bricks else float(made["how"]),
        rim=None if made["rim"] is None else float(made["rim"]),
        divisions=[int(count) for count in made["how"].split("x")] if bricks else None,
        order=2 if made["more"] == ":quadratic" else 1,
        hexahedra=made["more"] == ":hexahedra",
        flat="line" if made["more"] == ":line" else "",
    )
    draft.replace(place)


def cache_folder() -> Path:
    """Where made meshes are kept; ANCF_CACHE_DIR and XDG_CACHE_HOME move it."""
    base = os.environ.get("ANCF_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "ancf_petsc" / "meshes"


def project_file(*parts: str) -> Path:
    """A file of the project's checkout."""
    file = PROJECT.joinpath(*parts)
    if not file.is_file():
        cure = "run the benchmarks from a checkout of the project, installed by scripts/setup"
        raise CaseError("the benchmarks' file is missing", file=file, cure=cure)
    return file
