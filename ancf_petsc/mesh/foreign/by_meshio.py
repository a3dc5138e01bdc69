"""What meshio finds in a file of any format it reads."""

from __future__ import annotations

import base64
import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from ancf_petsc.mesh.foreign.guard import Refused, one_line

BASE64 = re.compile(rb"[A-Za-z0-9+/=\s]*")


def contents(path: Path, words: list[str]) -> dict[str, Any]:
    """meshio's mesh as tables and arrays, and what it says while it reads.

    known: whether meshio reads this format at all. points (n, d). cells: kind and nodes (m, k); of polyhedra, whose cells have
    different numbers of nodes, (m, 0). cell_sets, cell_data: name and a list by block of cells; point_sets, point_data,
    field_data: name and array. cell_tags, point_tags: tag and names of MED's families. Raises Refused where
    meshio cannot read it; it prints, and may leave the interpreter, when it cannot.
    """
    del words
    if not set(path.suffixes) & set(meshio.extension_to_filetypes):
        return {"known": False}
    said = io.StringIO()
    try:
        with _strict_base64(), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            mesh = meshio.read(path)
    except SystemExit:
        raise Refused(" ".join(said.getvalue().split()) or "no reason given") from None
    except MemoryError:
        raise
    except Exception as error:
        raise Refused(one_line(error) or "no reason given") from None
    return {
        "known": True,
        "points": _numbers(mesh.points, "points"),
        "cells": [(block.type, _nodes(block)) for block in mesh.cells],
        "cell_sets": list(mesh.cell_sets.items()),
        "cell_data": _tags(mesh.cell_data),
        "point_sets": list(mesh.point_sets.items()),
        "point_data": _tags({key: [data] for key, data in mesh.point_data.items()}),
        "field_data": _pairs(mesh.field_data),
        "cell_tags": _families(mesh, "cell_tags"),
        "point_tags": _families(mesh, "point_tags"),
        "said": " ".join(said.getvalue().split()),
    }  # fmt: skip


@contextlib.contextmanager
def _strict_base64() -> Iterator[None]:
    """Python passes over letters that are none of base64, and all numbers behind them are others: here they are an error."""
    lenient = base64.b64decode

    def decode(text: Any, *rest: Any, **more: Any) -> bytes:
        letters = text.encode() if isinstance(text, str) else bytes(text)
        if not BASE64.fullmatch(letters):
            raise ValueError("its packed numbers are no base64")
        return lenient(letters, *rest, **more)

    base64.b64decode = decode  # type: ignore[assignment]
    try:
        yield
    finally:
        base64.b64decode = lenient


def _numbers(given: Any, what: str) -> np.ndarray:
    found = np.asarray(given)
    if found.dtype.kind not in "iuf":
        raise Refused(f"its {what} are no numbers but {found.dtype}")
    return found


def _nodes(block: Any) -> np.ndarray:
    count = len(block.data)
    if not count or block.type.startswith("polyhedron"):
        return np.empty((count, 0), np.int64)
    nodes = _numbers(block.data, f"{block.type} cells")
    if nodes.ndim != 2 or nodes.dtype.kind == "f" and not np.array_equal(nodes, np.floor(nodes)):
        raise Refused(f"its {block.type} cells are no table of whole numbers")
    return nodes


def _tags(data: dict[str, list[Any]]) -> list[tuple[str, list[np.ndarray]]]:
    """Data that may number sets or families: whole numbers, one to each cell or point."""
    found = []
    for name, given in data.items():
        parts = [np.asarray(part) for part in given]
        if all(part.dtype.kind in "iuf" and part.size == len(part) for part in parts if part.ndim) and all(
            part.ndim for part in parts
        ):
            whole = [part.ravel() for part in parts]
            if all(np.array_equal(part, np.floor(part)) for part in whole if part.dtype.kind == "f"):
                found.append((name, whole))
    return found


def _pairs(data: dict[str, Any]) -> list[tuple[str, np.ndarray]]:
    """Numbers of field data, in which Gmsh keeps tag and dimension of a name."""
    flat = [(name, np.ravel(value)) for name, value in data.items()]
    return [(name, value) for name, value in flat if value.dtype.kind in "iuf"]


def _families(mesh: Any, name: str) -> list[tuple[int, list[str]]] | None:
    given = getattr(mesh, name, None)
    return None if given is None else [(int(tag), list(map(str, names))) for tag, names in given.items()]
