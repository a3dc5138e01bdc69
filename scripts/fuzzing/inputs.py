"""One input: made anew from its kind, the campaign's seed and its number, in a folder of its own."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
from pathlib import Path
from random import Random
from typing import Any

from fuzzing import cases, damage
from fuzzing.datasets import HDF5, NETCDF
from fuzzing.seeds import CASE, Seed

SECRET = "424242.5 planted"
VERBS = (("plot", 0.45), ("view", 0.3), ("again", 0.1), ("over", 0.15))
"""What is done with a run's folder, and how often."""


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
            if not os.path.isfile(main) and self.damages[-1:] != ["other_suffix"]:
                return  # a device, a pipe, a folder: nothing more can be done to it
            way = self.random.choice(ways)
            self.damages.append(way.__name__)
            if way in HDF5 + NETCDF:
                _apart(way, self.room.box, main, self.random)
            else:
                _try(way, self.room.box, main, self.random)

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
        field = self.random.choice(("displacement", "cauchy", "von_mises"))
        self.words = {
            "plot": ["plot", str(place), "--out", str(self.room.out)],
            "view": ["view", str(place), "--screenshot", str(self.room.out / "picture.png"), "--field", field],
            "again": ["run", str(place), "--again", "--quiet", "--out", str(self.room.out / "again")],
            "over": ["run", str(self.room.box / "case.toml"), "--quiet", "--out", str(place)],
        }[verb]  # fmt: skip
        self.room.out.mkdir()
        self.damages = [f"{verb}, {main.suffix.strip('.')}: {', '.join(self.damages) or 'nothing'}"]


def _try(way: damage.Damage, box: Path, main: Path, random: Random) -> None:
    """A file that a way cannot open stays as it is."""
    with contextlib.suppress(
        OSError, KeyError, ValueError, TypeError, RuntimeError, AttributeError, IndexError, UnicodeError
    ):
        way(box, main, random)


def _apart(way: damage.Damage, box: Path, main: Path, random: Random) -> None:
    """The same in a process of its own: libraries crash on what was damaged before."""
    receive, send = os.pipe()
    child = os.fork()
    if not child:
        _try(way, box, main, random)
        with os.fdopen(send, "w") as pipe:
            json.dump(random.getstate(), pipe)
        os._exit(0)
    os.close(send)
    with os.fdopen(receive) as pipe:
        said = pipe.read()
    os.waitpid(child, 0)
    if said:
        version, state, following = json.loads(said)
        random.setstate((version, tuple(state), following))


_pieces: dict[int, list[dict[str, Any]]] = {}


def _piece(number: int) -> list[dict[str, Any]]:
    if number not in _pieces:
        _pieces.clear()
        _pieces[number] = cases.piece_of_cases(number)
    return _pieces[number]
