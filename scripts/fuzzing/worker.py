"""A process that tries inputs one after the other: `python worker.py SEEDS ROOM`; jobs come as lines of JSON, answers go as such.

Each input gets a folder of its own; everything the program may write to is inside, and what changes elsewhere is seen: by looking
at the tree before and after, and by Python's audit events. The process has a gigabyte of addresses beyond what it starts with.
"""

from __future__ import annotations

import contextlib
import faulthandler
import io
import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from fuzzing.inputs import SECRET, Attempt, Room  # noqa: E402
from fuzzing.seeds import read_seeds  # noqa: E402
from fuzzing.watch import GIGABYTE, Watch, forget_peak, limited_memory, memory, processor_time, tree  # noqa: E402


def run(attempt: Attempt, watch: Watch) -> dict[str, Any]:
    """What became of an input; `wrong` lists what must not be."""
    from ancf_petsc.cli import main

    room = attempt.room
    out = room.box / "run" if "over" in "".join(attempt.damages) else room.out
    watch.allowed = (str(out), str(room.folder / "temporary"), *_caches())
    before = tree(room.folder, out)
    wrong: list[str] = []
    said, told = io.StringIO(), io.StringIO()
    forget_peak()
    resident, begun, busy = memory("VmRSS"), time.perf_counter(), processor_time()
    watch.seen, watch.deck, watch.on = [], attempt.kind in ("inp", "bdf"), True
    try:
        with limited_memory(attempt.kind), contextlib.redirect_stdout(said), contextlib.redirect_stderr(told):
            code: Any = main(attempt.words)
    except BaseException:
        code = "traceback"
        wrong.append("traceback: " + traceback.format_exc(limit=-4))
    finally:
        watch.on = False
    seconds, busy = time.perf_counter() - begun, processor_time() - busy
    grown = memory("VmHWM") - resident
    wrong += watch.seen
    after = tree(room.folder, out)
    wrong += [
        f"changed: {name}"
        for name in sorted(set(before) | set(after))
        if before.get(name) != after.get(name) and not name.startswith(_caches())
    ]
    wrong += _judge(attempt, code, told.getvalue(), grown)
    answer = {
        "code": code,
        "seconds": seconds,
        "busy": busy,
        "grown": grown,
        "wrong": wrong,
        "said": told.getvalue()[:2000],
        "second": "",
    }
    if code == 0 and attempt.mesh is not None and not wrong:
        answer["second"] = _compare(attempt, wrong)
    return answer


def _caches() -> tuple[str, ...]:
    """Where machine code and made meshes are kept."""
    return (os.environ["ANCF_CACHE_DIR"],)


def _judge(attempt: Attempt, code: Any, told: str, grown: int) -> list[str]:
    wrong = []
    good = (0, 2, 3) if attempt.kind == "results" else (0, 2)
    if code not in (*good, "traceback"):
        wrong.append(f"exit code {code}")
    if code == 2:
        lines = told.splitlines()
        errors = [line for line in lines if line.startswith("error: ")]
        if len(errors) != 1 or not lines[-1].startswith("error: "):
            wrong.append(f"not one line of error: {told[:400]!r}")
        elif len(errors[0]) > 4000:
            wrong.append(f"a line of {len(errors[0])} letters")
    if SECRET.split()[0] in told and attempt.kind not in ("inp", "bdf"):
        wrong.append("shows what it must not read")
    if grown > GIGABYTE:
        wrong.append(f"{grown / GIGABYTE:.2f} GiB of memory")
    return wrong


def _compare(attempt: Attempt, wrong: list[str]) -> str:
    from ancf_petsc.element.catalog import element
    from ancf_petsc.mesh.read import read_mesh
    from fuzzing import second

    assert attempt.mesh is not None
    path, code = attempt.mesh
    kind = attempt.kind if path.suffix in SUFFIXES.get(attempt.kind, ()) else "other"
    if kind == "other":
        return "no second reader"
    mesh = read_mesh(path, element(code).kinds, element=code)
    ours = mesh.points[mesh.cells]
    if (ours == 424242.5).any():
        wrong.append("holds what it must not read")
    answer, theirs = second.read_apart(path.resolve(), kind, code)
    if theirs is None:
        return answer
    if second.same(ours, theirs):
        return "same"
    wrong.append(
        f"second reader has other cells: {ours.shape} {theirs.shape} {np_show(ours)} {np_show(theirs)}"
    )
    return "different"


def np_show(cells: Any) -> str:
    return " ".join(str(cells).split())[:300]


SUFFIXES = {
    "msh_text": (".msh",), "msh_binary": (".msh",), "inp": (".inp",), "bdf": (".bdf",), "exodus": (".e", ".exo", ".ex2"),
    "vtu": (".vtu",), "vtk": (".vtk",), "xdmf": (".xdmf",), "med": (".med",), "medit": (".mesh", ".meshb"),
}  # fmt: skip


def serve(seeds: Path, folder: Path) -> None:
    """Answer jobs until standard input ends."""
    faulthandler.enable(all_threads=False)
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    room = Room(folder, read_seeds(seeds))
    watch = Watch()
    _start_quickly()
    warm: set[str] = set()
    out.write("ready\n")
    out.flush()
    for line in sys.stdin:
        kind, seed, number = json.loads(line)
        if kind not in warm:
            _warm(room, watch, kind)
            warm.add(kind)
        room.clean()
        attempt = Attempt(room, kind, seed, number)
        attempt.make()
        answer = run(attempt, watch) | {"damage": attempt.damages, "words": attempt.words}
        out.write(json.dumps(answer) + "\n")
        out.flush()


class Forked:
    """A reading process that is a copy of this one: it need not start Python and load libraries."""

    def __init__(self, words: list[str], home: str) -> None:
        from ancf_petsc.mesh.foreign import child

        self.pipe, write = os.pipe()
        self.number = os.fork()
        if not self.number:
            os.dup2(write, 1)
            os.close(self.pipe)
            os.environ["HOME"] = home
            child.main(words)
        os.close(write)

    def kill(self) -> None:
        os.kill(self.number, signal.SIGKILL)

    def wait(self) -> int:
        return os.waitstatus_to_exitcode(os.waitpid(self.number, 0)[1])


def _start_quickly() -> None:
    """Have the program's reading processes forked from this one."""
    import gmsh  # noqa: F401
    import meshio  # noqa: F401
    import netCDF4  # noqa: F401

    from ancf_petsc.mesh.foreign import process

    def start(words: list[str], home: str) -> tuple[Any, int]:
        forked = Forked(words, home)
        return forked, forked.pipe

    process.start = start


def _warm(room: Room, watch: Watch, kind: str) -> None:
    """Load what a kind of input needs, so that its memory does not count as an input's and copies of this process have it."""
    for number in range(3 if kind == "results" else 1):
        room.clean()
        attempt = Attempt(room, kind, 0, 0)
        attempt.random.seed(number)
        attempt.make()
        run(attempt, watch)
    if kind == "bdf":
        from pyNastran.bdf.bdf import BDF  # noqa: F401


if __name__ == "__main__":
    serve(Path(sys.argv[1]), Path(sys.argv[2]))
