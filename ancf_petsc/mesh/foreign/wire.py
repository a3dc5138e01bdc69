"""Tables, lists, texts, numbers and arrays as bytes: JSON with the arrays behind it. Nothing that could be executed."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

ARRAY = "array of"
KINDS = "iufbS"
"""numpy's kinds of arrays that are sent."""


def encode(tree: Any) -> list[bytes]:
    """Pieces of bytes to be joined. Raises ValueError for arrays of other things than numbers and bytes."""
    arrays: list[np.ndarray] = []

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            if value.dtype.kind not in KINDS:
                raise ValueError(f"an array of {value.dtype}")
            arrays.append(np.ascontiguousarray(value, value.dtype.newbyteorder("=")))
            return {ARRAY: value.dtype.newbyteorder("=").str, "shape": value.shape}
        if isinstance(value, dict):
            return {str(key): plain(inner) for key, inner in value.items()}
        if isinstance(value, list | tuple):
            return [plain(inner) for inner in value]
        return value.item() if isinstance(value, np.generic) else value

    head = json.dumps(plain(tree)).encode()
    return [len(head).to_bytes(8, "little"), head, *(array.tobytes() for array in arrays)]


def decode(data: bytes) -> Any:
    """What was encoded; tuples have become lists. Arrays cannot be written to. Raises ValueError for anything else."""
    at = 8 + int.from_bytes(data[:8], "little")

    def back(value: Any) -> Any:
        nonlocal at
        if isinstance(value, list):
            return [back(inner) for inner in value]
        if not isinstance(value, dict):
            return value
        if ARRAY not in value:
            return {key: back(inner) for key, inner in value.items()}
        kind = np.dtype(value[ARRAY])
        if kind.kind not in KINDS:
            raise ValueError(f"an array of {kind}")
        count = int(np.prod(value["shape"], dtype=np.int64))
        array = np.frombuffer(data, kind, count, at) if count * kind.itemsize else np.empty(count, kind)
        at += count * kind.itemsize
        return array.reshape(value["shape"])

    return back(json.loads(data[8:at]))
