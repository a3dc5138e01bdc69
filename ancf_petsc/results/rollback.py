"""Taking the files of a run back to where they stood at a checkpoint.

HDF5 changes its tables in place, and a run that is killed while it writes leaves them half changed. Numbers of fields are
written once and stay where they are: everything else of results.h5, a few kilobytes a step, is copied into the checkpoint and
put back, and what was added since is cut off. The tables and results.xdmf are kept whole.
"""

from __future__ import annotations

import os
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.errors import EnvironmentProblem, writing
from ancf_petsc.results.checkpoint_file import sync
from ancf_petsc.results.folder import write_atomic

TEXTS = ("curve.csv", "probes.csv", "results.xdmf")
Bytes = NDArray[np.uint8]


class GoesOn(NamedTuple):
    """Of a results.h5 that a run goes on with: steps in it, and where its numbers lie (k, 2)."""

    steps: int
    spans: NDArray[np.int64]


class RawNumbers:
    """Where the numbers of datasets lie in an HDF5 file, in bytes."""

    def __init__(self, spans: NDArray[np.int64] | None = None) -> None:
        self._spans = [] if spans is None else [tuple(map(int, span)) for span in spans]

    def note(self, datasets: list[Any]) -> None:
        """See datasets (h5py's low-level ones) that were written."""
        for data in datasets:
            place, size = data.get_offset(), data.get_storage_size()
            if place is not None and size:
                self._spans.append((int(place), int(size)))

    def spans(self) -> NDArray[np.int64]:
        """(k, 2) begin and size, ascending."""
        return np.array(sorted(self._spans), np.int64).reshape(-1, 2)


def _between(spans: NDArray[np.int64], size: int) -> list[tuple[int, int]]:
    """Begin and end of what lies between spans in a file of `size` bytes."""
    ends = np.concatenate(([0], spans.sum(axis=1)))
    begins = np.concatenate((spans[:, 0], [size]))
    return [(int(a), int(b)) for a, b in zip(ends, begins, strict=True) if b > a]


def position_of(folder: Path, numbers: RawNumbers) -> dict[str, Any]:
    """What takes the files of a run back to where they stand now; numbers: of results.h5. They are on the disk afterwards.
    Raises EnvironmentProblem.
    """
    path, spans = folder / "results.h5", numbers.spans()
    with writing(path):
        sync(path)
        size = path.stat().st_size
        with path.open("rb") as file:
            pieces = []
            for begin, end in _between(spans, size):
                file.seek(begin)
                pieces.append(file.read(end - begin))
    texts = {}
    for name in TEXTS:
        with writing(folder / name):
            if (folder / name).is_file():
                texts[name] = _packed((folder / name).read_bytes())
    return {"size": size, "spans": spans, "rest": _packed(b"".join(pieces)), "texts": texts}


def take_back(folder: Path, position: dict[str, Any]) -> None:
    """Bring the files of a run to a position, on the disk too. Raises EnvironmentProblem."""
    path, size = folder / "results.h5", position["size"]
    there = path.stat().st_size if path.is_file() else 0
    if there < size:
        raise EnvironmentProblem(
            f"{path}: {there} bytes are left of the {size} that it had at the checkpoint: fields are lost; "
            "run without --restart to start from the beginning"
        )
    rest, done = _unpacked(position["rest"]), 0
    with writing(path), path.open("r+b") as file:
        for begin, end in _between(position["spans"], size):
            file.seek(begin)
            file.write(rest[done : done + end - begin])
            done += end - begin
        file.truncate(size)
        file.flush()
        os.fsync(file.fileno())
    for name in TEXTS:
        with writing(folder / name):
            if name in position["texts"]:
                write_atomic(folder / name, _unpacked(position["texts"][name]).decode())
                sync(folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
    with writing(folder):
        sync(folder)


def _packed(data: bytes) -> Bytes:
    return np.frombuffer(zlib.compress(data, 1), np.uint8)


def _unpacked(data: Bytes) -> bytes:
    return zlib.decompress(data.tobytes())
