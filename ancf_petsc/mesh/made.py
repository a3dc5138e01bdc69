"""Meshes of the program's bodies, made once and kept in the user's cache."""

from __future__ import annotations

import os
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from ancf_petsc.errors import CaseError, did_you_mean, writing
from ancf_petsc.mesh.bodies import BODIES
from ancf_petsc.mesh.generate import make_mesh


class Request(NamedTuple):
    """What `generate.make_mesh` is asked for; see there."""

    body: str
    size: float | None = None
    rim: float | None = None
    divisions: tuple[int, int, int] | None = None
    hexahedra: bool = False
    order: int = 1
    flat: str = ""


def made_mesh(request: Request) -> Path:
    """The file of a mesh, made if it is not there yet. Raises CaseError about keys of [mesh], EnvironmentProblem."""
    place = _place(request)
    if place.is_file():
        return place
    with writing(place):
        place.parent.mkdir(parents=True, exist_ok=True)
    with writing(place), TemporaryDirectory(prefix=".", dir=place.parent) as folder:
        draft = Path(folder) / place.name
        asked = request._asdict()
        try:
            make_mesh(asked.pop("body"), draft, **asked)
        except CaseError as error:
            named = (error.key or "").removeprefix("--")
            error.key = "mesh.body" if named in ("NAME", "out", "") else f"mesh.{named}"
            error.expected, error.cure = (
                text and text.replace("--", "mesh.") for text in (error.expected, error.cure)
            )
            raise
        draft.replace(place)
    return place


def _place(request: Request) -> Path:
    """Where a mesh is kept; another version of Gmsh makes another mesh."""
    if request.body not in BODIES:
        raise CaseError(
            "no such body", key="mesh.body", got=request.body, cure=did_you_mean(request.body, list(BODIES))
        )
    try:
        version = metadata.version("gmsh")
    except metadata.PackageNotFoundError:  # of conda or Debian
        version = ""
    said = repr((tuple(request), BODIES[request.body].about, version))
    return cache_folder() / f"{request.body}_{sha256(said.encode()).hexdigest()[:16]}.msh"


def cache_folder() -> Path:
    """Where made meshes are kept; ANCF_CACHE_DIR and XDG_CACHE_HOME move it."""
    base = os.environ.get("ANCF_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "ancf_petsc" / "meshes"
