"""Gmsh in this process, for making meshes and writing them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ancf_petsc.errors import EnvironmentProblem


@contextmanager
def gmsh_session(**options: float) -> Iterator[Any]:
    """The gmsh module with an empty model and silent; afterwards all is as it was before."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise EnvironmentProblem(f"Gmsh cannot be loaded ({error}); install it: pip install gmsh") from None
    running = gmsh.isInitialized()
    if not running:
        gmsh.initialize(interruptible=False, readConfigFiles=False)
    current = gmsh.model.getCurrent()
    wanted = {"General.Terminal": 0.0, **options}
    before = {name: gmsh.option.getNumber(name) for name in wanted}
    try:
        for name, value in wanted.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.add("ancf")
        yield gmsh
    finally:
        if running:
            gmsh.model.remove()
            gmsh.model.setCurrent(current)
            for name, value in before.items():
                gmsh.option.setNumber(name, value)
        else:
            gmsh.finalize()
