"""The folder of a run: whether a run may have it, what an earlier run left in it, the summary."""

from __future__ import annotations

import errno
import json
import logging
import math
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ancf_petsc.errors import CaseError, cannot_write, error_number
from ancf_petsc.results.checkpoint_file import NAMES, sweep, sync
from ancf_petsc.results.mark import MARK, Mark, read_mark, refuse_live_run
from ancf_petsc.results.tables import file_text

RUN_FILES = (
    *NAMES, "results.h5", "results.xdmf", "curve.csv", "probes.csv", "modes.csv", "summary.json", "log.txt"
)  # fmt: skip
STATUSES = ("done", "stopped", "interrupted")
log = logging.getLogger("ancf")


class Holding(NamedTuple):
    """The run that a folder holds: its title, and the hash of its case and mesh ("" where none is recorded)."""

    title: str
    identity: str


def check_folder(
    path: Path, title: str, identity: str = "", *, force: bool = False, kept: bool = False
) -> None:
    """Raise CaseError unless a run of `title` may write into `path`; nothing in it is touched.

    A folder may be new, empty, or hold an earlier run of the same case: of the same `identity`, a hash of
    effective case and mesh. `force` allows any other, but never one that a live run writes into. `kept`: the run goes on
    with what is there, which has been looked at.
    """
    path = Path(path)
    if "\0" in str(path):
        raise CaseError("a NUL character in a path", key="--out", got=str(path), expected="a folder")
    there = _nearest_existing(path)
    if not there.is_dir():
        what = "is a file" if there == path else f"cannot be made: {there} is a file"
        raise CaseError(what, file=path, key="--out", expected="a folder", cure="choose another folder")
    try:
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        if kept or error_number(error) in (errno.ENOSPC, errno.EDQUOT):
            raise cannot_write(error, path / "results.h5") from error
        raise CaseError(
            f"cannot be written: {error.strerror or error}",
            file=path,
            key="--out",
            cure="choose a folder you may write to, by --out DIR",
        ) from error
    if there == path:
        refuse_live_run(path, force=force)
        _refuse_other_content(path, Holding(title, identity), force=force or kept)


def _refuse_other_content(path: Path, ours: Holding, *, force: bool) -> None:
    """Raise CaseError where the folder holds anything but an earlier run of the same case."""
    if force or not any(file.name != MARK for file in path.iterdir()):
        return
    held = run_in(path)
    if held is not None and held.identity == ours.identity and (ours.identity or held.title == ours.title):
        return
    got, expected = "files that do not belong to a run", f"an empty folder, or a run of {ours.title!r}"
    if held is not None:
        got = f"a run of {held.title!r}"
        if held.title == ours.title:
            got += (
                " with other values or another mesh" if held.identity else ", which did not record its case"
            )
            expected = "an empty folder, or a run of exactly this case and mesh"
    raise CaseError(
        "the folder is not empty",
        file=path,
        key="--out",
        got=got,
        expected=expected,
        cure="keep both by --out DIR, or overwrite by --force",
    )


def _nearest_existing(path: Path) -> Path:
    there = path.absolute()
    while not os.path.lexists(there):
        there = there.parent
    return path if there == path.absolute() else there


def run_in(path: Path) -> Holding | None:
    """The run in a folder, finished or not; None where there is none."""
    results = Path(path) / "results.h5"
    if results.is_file():
        import h5py

        try:
            with unlocked(), h5py.File(results, "r", locking=False) as file:
                return Holding(str(file.attrs["title"]), str(file.attrs.get("hash", "")))
        except (OSError, KeyError, RuntimeError, ValueError, TypeError, AttributeError):
            pass  # broken by a crash: summary or mark may still tell
    try:
        said = json.loads(file_text(Path(path) / "summary.json"))
        return Holding(str(said["title"]), str(said.get("hash", "")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    mark = read_mark(path)
    return Holding(str(mark["title"]), str(mark.get("hash", ""))) if mark and "title" in mark else None


@contextmanager
def unlocked() -> Iterator[None]:
    """Around an opening of an HDF5 file: without HDF5's own locks, which the environment may force on readers.

    What guards the file is `store`'s shared lock: readers pass, another writer does not.
    """
    name = "HDF5_USE_FILE_LOCKING"
    before = os.environ.get(name)
    os.environ[name] = "FALSE"
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def claim_folder(path: Path, title: str = "", identity: str = "", *, force: bool = False) -> Mark:
    """Make the folder, mark it as a live run's and remove the files of an earlier run; whatever else is in it stays.

    Checks again: since `check_folder` another run may have begun or ended there. Returns the mark, to be
    released at the end. Raises CaseError, EnvironmentProblem.
    """
    path = Path(path)
    mark = Mark(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        _refuse_other_content(path, Holding(title, identity), force=force)
        earlier = run_in(path)
        mark.take({"title": title, "hash": identity}, force=force)
        _refuse_other_content(path, Holding(title, identity), force=force)
        sweep(path)
        for name in RUN_FILES:
            (path / name).unlink(missing_ok=True)
            (path / f"{name}.part").unlink(missing_ok=True)
        if earlier is not None:
            same = "of this case" if earlier.identity == identity else f"{earlier.title!r}, of another case,"
            log.info("%s: the earlier run %s is replaced", path, same)
    except OSError as error:
        mark.release()
        raise cannot_write(error, error.filename or path) from error
    except CaseError:
        mark.release()
        raise
    return mark


def reclaim_folder(path: Path, title: str = "", identity: str = "", *, force: bool = False) -> Mark:
    """Mark a folder as a live run's that goes on with what is in it; its summary goes. Raises CaseError, EnvironmentProblem."""
    mark = Mark(path)
    try:
        refuse_live_run(path, force=force)
        mark.take({"title": title, "hash": identity}, force=force)
        sweep(path)
        (path / "summary.json").unlink(missing_ok=True)
    except OSError as error:
        mark.release()
        raise cannot_write(error, error.filename or path) from error
    return mark


def write_atomic(path: Path, text: str) -> None:
    """Replace a file as a whole: a reader sees the old text or the new, never a part, after a power cut neither. Raises
    OSError.
    """
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(text, encoding="utf-8")
        sync(part)
        os.replace(part, path)
    except OSError:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def write_summary(
    folder: Path,
    *,
    title: str,
    status: str,
    seconds: dict[str, float],
    memory_peak_bytes: list[int],
    nodes: int,
    elements: int,
    dof: int,
    ranks: int,
    iterations: dict[str, int],
    final: dict[str, float],
    versions: dict[str, str],
    **more: Any,
) -> None:
    """seconds: import, read, setup, solve, output, total; memory: per rank; iterations: newton, linear."""
    for name in RUN_FILES:  # what the summary says is there has to be on the disk before it
        if (folder / name).is_file():
            sync(folder / name)
    if status not in STATUSES:
        raise ValueError(f"status {status!r} is none of {STATUSES}")
    summary = {
        "title": title,
        "status": status,
        "seconds": seconds,
        "memory_peak_bytes": memory_peak_bytes,
        "nodes": nodes,
        "elements": elements,
        "dof": dof,
        "ranks": ranks,
        "iterations": iterations,
        "final": final,
        "versions": versions,
        **more,
    }
    write_atomic(Path(folder) / "summary.json", json.dumps(_plain(summary), indent=2, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    """The same in JSON's own types; JSON has no word for nan and infinity: null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | None) else str(value)
