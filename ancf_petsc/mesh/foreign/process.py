"""Starting the process that reads a file, waiting for it, and saying what went wrong."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from ancf_petsc.errors import EnvironmentProblem
from ancf_petsc.mesh.foreign import child, wire
from ancf_petsc.mesh.raw import mesh_error

CURES = {
    "gmsh": "the file may be truncated or damaged: write it again",
    "meshio": "write it again, or in another format such as .msh, .vtu or .inp",
    "netcdf": "write the mesh again as Exodus",
}
STARTING = 120.0
"""Seconds a process may take to load a library: network drives are slow."""
PATIENCE, SLOWEST = 8.0, 1e5
"""Seconds of processor time, and bytes a second: damaged counts keep libraries busy for ever; whole files take a hundredth."""
WAITING = 15.0
"""Times as long may pass on a machine that has other work."""
LONGEST_REASON = 300
"""Letters of what a library says."""
TITLES = {"gmsh": "Gmsh", "meshio": "meshio", "netcdf": "netCDF4"}


def contents(path: Path, reader: str, *words: str) -> Any:
    """What a library finds in a file: see the modules by_*. reader: "gmsh", "meshio" or "netcdf".

    Raises MeshError where it refuses the file, crashes on it or does not come to an end, EnvironmentProblem without it.
    """
    size = _size(path)
    seconds = PATIENCE + size / SLOWEST
    with tempfile.TemporaryDirectory(prefix="ancf-") as home:
        code, said = _run([reader, str(path), f"{seconds:.0f}", *words], home, WAITING * seconds)
    if code == 0:
        return wire.decode(said)
    title, cure = TITLES[reader], CURES[reader]
    wrong = mesh_error(path)
    if code in (None, -signal.SIGXCPU):
        raise wrong(f"{title} does not come to an end of it in {seconds:.0f} s", cure=cure)
    reason = " ".join(said.decode("utf-8", "replace").split()) or "no reason given"
    if len(reason) > LONGEST_REASON:
        reason = f"{reason[:LONGEST_REASON]} ..."
    if code == child.REFUSED:
        raise wrong(f"{title} cannot read it ({reason})", cure=cure)
    if code == child.NO_MEMORY:
        raise wrong(f"{title} needs more memory for it than {int(said) / 2**30:.2g} GiB", cure=cure)
    if code == child.NOT_THERE:
        raise EnvironmentProblem(f"{title} cannot be loaded ({reason}); install it: pip install {title}")
    why = "the file may be truncated or damaged, or elements refer to nodes it lacks: write it again"
    raise wrong(f"{title} crashes on it ({_name(code)})", cure=why)


def _size(path: Path) -> int:
    """Bytes of a file, and of those beside it that hold the numbers of XDMF."""
    if path.suffix.lower() not in (".xdmf", ".xmf"):
        return path.stat().st_size
    return sum(file.stat().st_size for file in path.parent.iterdir() if file.is_file())


def _name(code: int) -> str:
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"exit code {code}"


def _run(words: list[str], home: str, seconds: float) -> tuple[int | None, bytes]:
    """Exit code, None where more than `seconds` passed, and what came after "ready"."""
    process, pipe = start(words, home)
    try:
        begun = _read(pipe, STARTING, len(child.READY))
        said = begun if begun is not None and begun != child.READY else None
        if begun is not None and said is None:
            said = _read(pipe, seconds)
        elif said is not None:
            said += _read(pipe, STARTING) or b""
        if said is None:
            process.kill()
        code = process.wait()
    finally:
        os.close(pipe)
    return (None if said is None else code), said or b""


def start(words: list[str], home: str) -> tuple[Any, int]:
    """Start `child.main`: the process, which can be killed and waited for, and the pipe it writes to.

    home: an empty folder; what libraries keep for their user goes there.
    """
    place = os.fspath(Path(__file__).parents[3])
    code = (
        f"import sys; sys.path.append({place!r}); "
        "from ancf_petsc.mesh.foreign import child; child.main(sys.argv[1:])"
    )
    # A library built with MPI must not take itself for a rank of this run.
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_", "PMI", "MPI_"))}
    environment |= {"HOME": home, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    read, write = os.pipe()
    try:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", code, *words],
            stdin=subprocess.DEVNULL, stdout=write, stderr=subprocess.DEVNULL, env=environment,
        )  # fmt: skip
    except BaseException:
        os.close(read)
        raise
    finally:
        os.close(write)
    return process, read


def _read(pipe: int, seconds: float, count: int | None = None) -> bytes | None:
    """What comes until the other end is closed, or `count` bytes; None where that takes too long."""
    end = time.monotonic() + seconds
    pieces: list[bytes] = []
    left = count
    while left is None or left:
        waiting = end - time.monotonic()
        if waiting <= 0.0 or not select.select([pipe], [], [], waiting)[0]:
            return None
        piece = os.read(pipe, 2**20 if left is None else left)
        if not piece:
            break
        pieces.append(piece)
        left = None if left is None else left - len(piece)
    return b"".join(pieces)
