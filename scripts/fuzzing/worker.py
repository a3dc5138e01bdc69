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
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from fuzzing import cases, damage  # noqa: E402
from fuzzing.seeds import CASE, Seed, read_seeds  # noqa: E402

GIGABYTE = 2**30
SECRET = "424242.5 secret"
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
VERBS = (("plot", 0.45), ("view", 0.3), ("again", 0.1), ("over", 0.15))


class Watch:
    """Audit events that no input may cause: writing elsewhere, reading what was planted, other programs, the network."""

    def __init__(self) -> None:
        self.allowed: tuple[str, ...] = ()
        self.room = ""
        self.seen: list[str] = []
        self.on = self.deck = False
        sys.addaudithook(self.hear)

    def hear(self, event: str, given: tuple) -> None:
        if not self.on:
            return
        self.on = False
        try:
            words = self._words(event, given)
            if words:
                self.seen.append(words)
        finally:
            self.on = True

    def _words(self, event: str, given: tuple) -> str:
        if event == "open" and isinstance(given[0], str | bytes | os.PathLike):
            path = os.path.abspath(os.fsdecode(given[0]))
            flags = given[2] if isinstance(given[2], int) else 0
            if flags & WRITES and not path.startswith((*self.allowed, "/dev/null")):
                return f"writes {path}"
            # Decks may include any ordinary file, as they do in the programs they are for.
            if not self.deck and (
                "secret" in os.path.basename(path) or path in ("/etc/passwd", "/etc/shadow")
            ):
                return f"reads {path}"
        elif event in (
            "os.mkdir",
            "os.remove",
            "os.rmdir",
            "os.rename",
            "os.symlink",
            "os.link",
            "os.truncate",
            "shutil.rmtree",
        ):
            place = given[1] if event in ("os.rename", "os.symlink", "os.link") else given[0]
            # Relative to an open folder: what rmtree removes of a temporary one.
            path = (
                ""
                if isinstance(place, int) or given[-1] not in (-1, None)
                else os.path.abspath(os.fsdecode(place))
            )
            if path and not path.startswith(self.allowed):
                return f"{event} {path}"
        elif event == "subprocess.Popen" and os.path.basename(str(given[0])) not in (
            "python",
            "python3",
            os.path.basename(sys.executable),
        ):
            return f"starts {given[0]}"
        elif event in (
            "os.system",
            "socket.connect",
            "socket.getaddrinfo",
            "urllib.Request",
            "os.exec",
            "ftplib.connect",
        ):
            return f"{event} {given[1:]}"
        return ""


@contextlib.contextmanager
def limited_memory(kind: str) -> Iterator[None]:
    """A gigabyte of addresses beyond what the process has; drawing takes many that it never uses, so its peak alone is judged."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + GIGABYTE
    if kind != "results":
        resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def forget_peak() -> None:
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def memory(name: str) -> int:
    """Bytes of a line of /proc/self/status: VmHWM is the peak, VmRSS what is resident now."""
    text = Path("/proc/self/status").read_text()
    return int(text.partition(f"{name}:")[2].split()[0]) * 1024


def processor_time() -> float:
    """Seconds of this process and of those it started that have ended."""
    return sum(os.times()[:4])


def tree(room: Path, without: Path) -> dict[str, tuple]:
    """Size and date of all below a folder, except below another."""
    found: dict[str, tuple] = {}
    for folder, names, files in os.walk(room):
        if Path(folder) == without:
            names.clear()
            continue
        for name in (*names, *files):
            path = os.path.join(folder, name)
            stat = os.lstat(path)
            moment = 0 if os.path.isdir(path) else stat.st_mtime_ns
            found[path] = (stat.st_mode, 0 if os.path.isdir(path) else stat.st_size, moment)
    return found


class Room:
    """ROOM/outer/inner/box holds the input; secrets lie two folders above it, results go to box/out."""

    def __init__(self, folder: Path, seeds: list[Seed]) -> None:
        self.folder, self.seeds = folder, seeds
        self.box = folder / "outer" / "inner" / "box"
        self.out = self.box / "out"
        for name in ("home", "temporary", "outer/inner"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        (folder / "outer" / "secret.txt").write_text(SECRET * 100)
        self._plant()
        os.environ |= {"HOME": str(folder / "home"), "TMPDIR": str(folder / "temporary")}
        for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME"):
            os.environ.pop(name, None)

    def _plant(self) -> None:
        import h5py

        with h5py.File(self.folder / "outer" / "secret.h5", "w") as file:
            for name in ("data0", "data1", "points"):
                file[name] = [[424242.5, 0.0, 0.0]] * 8

    def clean(self) -> None:
        for name in ("home", "temporary"):
            for old in (self.folder / name).iterdir():
                shutil.rmtree(old, ignore_errors=True) if old.is_dir() else old.unlink()
        shutil.rmtree(self.box, ignore_errors=True)
        self.box.mkdir()


class Attempt:
    """One input, made anew by its kind, the campaign's seed and its number."""

    def __init__(self, room: Room, kind: str, seed: int, number: int) -> None:
        self.room, self.kind = room, kind
        self.random = Random(f"{kind} {seed} {number}")
        self.seed, self.number = seed, number
        self.damages: list[str] = []
        self.mesh: tuple[Path, str] | None = None
        self.words: list[str] = []

    def make(self) -> None:
        if self.kind == "case":
            self._make_case()
        elif self.kind == "results":
            self._make_results()
        else:
            self._make_mesh()

    def _copy_seed(self) -> tuple[Seed, Path]:
        seed = self.random.choice([one for one in self.room.seeds if one.kind == self.kind])
        for name, data in seed.files().items():
            target = self.room.box / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        return seed, self.room.box / seed.main

    def _damage(self, main: Path, ways: tuple[damage.Damage, ...]) -> None:
        """One to three ways, one after the other; a file that a way cannot open stays as it is."""
        for _ in range(self.random.choice((0, 1, 1, 1, 1, 1, 1, 2, 3)) if self.number else 0):
            way = self.random.choice(ways)
            self.damages.append(way.__name__)
            with contextlib.suppress(
                OSError,
                KeyError,
                ValueError,
                TypeError,
                RuntimeError,
                AttributeError,
                IndexError,
                UnicodeError,
            ):
                way(self.room.box, main, self.random)

    def _make_mesh(self) -> None:
        seed, main = self._copy_seed()
        self._damage(main, damage.ways(self.kind))
        renamed = self.room.box.parent / damage.RENAMED
        if renamed.exists():
            main = self.room.box / renamed.read_text()
            renamed.unlink()
        self.mesh = main, seed.element
        case = {**CASE, "mesh": {"file": main.name, "element": seed.element}}
        (self.room.box / "case.toml").write_text(cases.write_toml(case))
        self.words = ["check", str(self.room.box / "case.toml")]

    def _make_case(self) -> None:
        piece, place = divmod(self.number, cases.PIECE)
        sys.setrecursionlimit(20_000)
        text = cases.write_toml(_piece(self.seed * 100_003 + piece)[place])
        sys.setrecursionlimit(1_000)
        main = self.room.box / "case.toml"
        main.write_text(text, encoding="utf-8")
        cube = next(one for one in self.room.seeds if one.main == "zlib.vtu")
        shutil.copy(cube.folder / cube.main, self.room.box / "cube.vtu")
        if self.random.random() < 0.25:
            self._damage(main, damage.TEXT + damage.BYTES[:-2])
        else:
            self.damages.append("other keys and values")
        self.words = ["check", str(main)]

    def _make_results(self) -> None:
        seed, _ = self._copy_seed()
        place = self.room.box / "run"
        place.mkdir()
        for name in seed.files():
            (self.room.box / name).rename(place / name)
        files = sorted(place.iterdir())
        main = place / "results.h5" if self.random.random() < 0.6 else self.random.choice(files)
        chosen = damage.ways(self.kind) if main.suffix == ".h5" else damage.TEXT + damage.BYTES
        self._damage(main, chosen)
        cube = next(one for one in self.room.seeds if one.main == "zlib.vtu")
        shutil.copy(cube.folder / cube.main, self.room.box / "cube.vtu")
        verb = self.random.choices([name for name, _ in VERBS], [share for _, share in VERBS])[0]
        case = {**CASE, "mesh": {"file": "cube.vtu", "element": "3413"}}
        (self.room.box / "case.toml").write_text(cases.write_toml(case))
        self.words = {
            "plot": ["plot", str(place), "--out", str(self.room.out)],
            "view": ["view", str(place), "--screenshot", str(self.room.out / "picture.png"), "--field", self.random.choice(("displacement", "cauchy", "von_mises"))],
            "again": ["run", str(place), "--again", "--quiet", "--out", str(self.room.out / "again")],
            "over": ["run", str(self.room.box / "case.toml"), "--quiet", "--out", str(place)],
        }[verb]  # fmt: skip
        self.room.out.mkdir()
        self.damages = [f"{verb}, {main.suffix.strip('.')}: {', '.join(self.damages) or 'nothing'}"]


_pieces: dict[int, list[dict[str, Any]]] = {}


def _piece(number: int) -> list[dict[str, Any]]:
    if number not in _pieces:
        _pieces.clear()
        _pieces[number] = cases.piece_of_cases(number)
    return _pieces[number]


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
    "msh_text": (".msh",), "msh_binary": (".msh",), "inp": (".inp",), "bdf": (".bdf",), "exodus": (".e", ".exo", ".ex2"), "vtu": (".vtu",),
    "vtk": (".vtk",), "xdmf": (".xdmf",), "med": (".med",), "medit": (".mesh", ".meshb"),
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
    for number in range(8 if kind == "results" else 1):
        room.clean()
        attempt = Attempt(room, kind, 0, 0)
        attempt.random.seed(number)
        attempt.make()
        run(attempt, watch)
    if kind == "bdf":
        from pyNastran.bdf.bdf import BDF  # noqa: F401


if __name__ == "__main__":
    serve(Path(sys.argv[1]), Path(sys.argv[2]))
