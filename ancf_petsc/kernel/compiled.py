"""How kernels are compiled and where the machine code is kept.

The cache folder's name holds a hash of the sources of all kernels and laws and the versions of numba and numpy: numba itself
does not notice changes in functions of other files. `ANCF_CACHE_DIR` moves the folder.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numba
import numpy

PACKAGE = Path(__file__).parent.parent


def source_hash() -> str:
    """Hash of every file that machine code is made from, and of the compiler."""
    digest = hashlib.sha256(f"{numba.__version__} {numpy.__version__}".encode())
    for folder in ("kernel", "material", "mesh"):
        for file in sorted((PACKAGE / folder).glob("*.py")):
            digest.update(file.name.encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """The folder for machine code: the first of these that can be written to."""
    base = os.environ.get("ANCF_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    candidates = [
        Path(base) if base else Path.home() / ".cache",
        Path(tempfile.gettempdir()) / f"cache-{os.getuid()}",
    ]
    for candidate in candidates:
        folder = candidate / "ancf_petsc" / f"kernels-{source_hash()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return candidates[-1]


CACHE_FOLDER = cache_folder()
numba.config.CACHE_DIR = str(CACHE_FOLDER)


REGROUPED = {"contract", "reassoc"}
"""Mathematics of a sum whose terms may be added in any order."""


def kernel(function: Callable) -> Callable:
    """Compile a pure loop, keep its machine code, divide like IEEE 754 does; products and sums may be fused."""
    return numba.njit(function, cache=True, error_model="numpy", nogil=True, fastmath={"contract"})
