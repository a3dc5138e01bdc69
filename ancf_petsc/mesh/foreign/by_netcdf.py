"""What an Exodus file holds of a mesh, by netCDF4: sizes of dimensions and those variables that describe mesh and sets."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np

from ancf_petsc.mesh.foreign.guard import Refused, one_line

WANTED = re.compile(
    r"coord[xyz]?|node_num_map|elem_num_map|connect\d+|node_ns\d+|(?:elem|side)_ss\d+|(?:eb|ns|ss)_(?:names|prop1)"
)


def contents(path: Path, words: list[str]) -> dict[str, Any]:
    """dimensions: name and size. variables: name and array. titles: name of a block's connectivity and its elements' type."""
    del words
    try:
        data = netCDF4.Dataset(str(path))
    except (OSError, RuntimeError, ValueError) as error:
        raise Refused(str(error)) from None
    with data:
        data.set_auto_mask(False)
        wanted = {name: one for name, one in data.variables.items() if WANTED.fullmatch(name)}
        size = path.stat().st_size
        for name, one in wanted.items():
            if data.data_model != "NETCDF4" and one.size * one.dtype.itemsize > size:
                raise Refused(f"{name} is announced with {one.size} numbers, more than the file holds")
        try:
            return {
                "dimensions": {name: len(one) for name, one in data.dimensions.items()},
                "variables": {name: np.asarray(one[:]) for name, one in wanted.items()},
                "titles": {name: str(getattr(one, "elem_type", "")) for name, one in wanted.items()},
            }
        except (KeyError, IndexError, ValueError, AttributeError, OSError, RuntimeError, TypeError) as error:
            raise Refused(one_line(error)) from None
