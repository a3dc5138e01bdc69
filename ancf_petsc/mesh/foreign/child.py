"""The process that reads one file: `main` with the reader's name, the file, seconds of processor time, and words for the reader.

What it sends to standard output: "ready", and then what `wire` makes of the contents, or the reason of a refusal as text.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path

from ancf_petsc.mesh.foreign import guard, limits, wire

READY = b"ready\n"
REFUSED = 3
"""The reason is on standard output."""
NOT_THERE = 4
"""A library cannot be loaded; the reason is on standard output."""
NO_MEMORY = 5
"""The limit of memory was reached; it is on standard output, in bytes."""


def main(words: list[str]) -> None:
    """Read, answer, leave without taking the libraries down: their memory goes with the process."""
    # What libraries print themselves goes to standard error.
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        code, pieces = _answer(words, out)
        for piece in pieces:
            out.write(piece)
    os._exit(code)


def _answer(words: list[str], out) -> tuple[int, list[bytes]]:
    name, path, seconds, *rest = words
    try:
        reader = import_module(f"ancf_petsc.mesh.foreign.by_{name}")
    except (ImportError, OSError) as error:
        return NOT_THERE, [str(error).encode()]
    out.write(READY)
    out.flush()
    allowed = limits.MEMORY
    try:
        for size in (os.path.getsize, guard.check):  # of the file, then of all that belong to it
            allowed = limits.allowed_bytes(Path(path), size(Path(path)))
            limits.limit(allowed, float(seconds))
        return 0, wire.encode(reader.contents(Path(path), rest))
    except MemoryError:
        return NO_MEMORY, [str(allowed).encode()]
    except Exception as error:
        text = str(error) if isinstance(error, guard.Refused) else guard.one_line(error)
        return REFUSED, [text.encode("utf-8", "replace")]


if __name__ == "__main__":
    main(sys.argv[1:])
