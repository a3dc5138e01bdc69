"""What a run that is asked to go on finds in its folder: nothing, its end, or a checkpoint of the same case and mesh."""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ancf_petsc.analysis.identity import values_of
from ancf_petsc.analysis.provenance import Provenance, recorded_case
from ancf_petsc.errors import CaseError, EnvironmentProblem
from ancf_petsc.input.load import Case
from ancf_petsc.model.ramp import make_ramp
from ancf_petsc.results.checkpoint_file import Saved, all_in

EXTENSIONS = (
    r"petsc(\..*)?|note|dynamics\.(duration|outputs)"
    r"|statics\.(steps|times|strokes|tolerance|smallest_step)"
)
"""Keys that may differ from those of the checkpoint where a run is extended: they change what is to come."""
RAMPS = r"(constraint|load)\.[^.]+\.ramp"
"""Keys that may be written anew for another duration, if they mean the same for what is done."""
SAME = 1e-12
"""Of a ramp's factors at one time."""
log = logging.getLogger("ancf")


@dataclass(frozen=True)
class Found:
    """is_done: nothing is left to do. goes_on: from the checkpoint `saved`, which the root rank knows; else the run starts from
    the beginning.
    """

    is_done: bool = False
    goes_on: bool = False
    saved: Saved | None = None


def find(folder: Path, about: Provenance, *, extend: bool) -> Found:
    """What there is to go on from. Raises CaseError where it is of another case or mesh, EnvironmentProblem where nothing of it
    is whole. On the root rank; nothing is touched.
    """
    if not folder.is_dir():
        log.info("%s: there is no such folder: the run starts from the beginning", folder)
        return Found()
    try:
        whole, wrong = all_in(folder)
    except OSError as error:
        raise EnvironmentProblem(f"{error.filename or folder}: cannot be read: {error.strerror}") from error
    if _is_done(folder, about):
        log.info("%s: the run of this case is done; nothing is left to do", folder)
        return Found(is_done=True)
    if not whole and wrong:
        raise _nothing_whole(folder, {path.name: why for path, why in wrong.items()})
    if not whole:
        _refuse_another_case(folder, about)
        log.info("%s: there is no checkpoint: the run starts from the beginning", folder)
        return Found()
    for path, why in wrong.items():
        log.warning("%s: damaged (%s): the checkpoint before it is taken", path, why)
    usable = list(_with_results(folder, whole))
    if not usable:
        size = _size(folder)
        reasons = {
            saved.path.name: f"results.h5 had {saved.about['files']['size']} bytes, now {size}"
            for saved in whole
        }
        raise _nothing_whole(folder, {path.name: why for path, why in wrong.items()} | reasons)
    _refuse_other_program(usable[0], about)
    _compare(usable[0], about, extend=extend)
    return Found(goes_on=True, saved=usable[0])


def _refuse_other_program(saved: Saved, about: Provenance) -> None:
    """Raise EnvironmentProblem for a checkpoint of another version of the program, which may carry on something else."""
    theirs, ours = (said["ancf_petsc"] for said in (saved.about["run"]["versions"], about.versions))
    if theirs != ours:
        raise EnvironmentProblem(
            f"{saved.path}: written by ancf_petsc {theirs}, this is {ours}: go on with that version, or run without --restart "
            "to start from the beginning"
        )


def _is_done(folder: Path, about: Provenance) -> bool:
    try:
        said = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return said["status"] == "done" and said["hash"] == about.identity.hash
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _size(folder: Path) -> int:
    try:
        return (folder / "results.h5").stat().st_size
    except OSError:
        return 0


def _with_results(folder: Path, whole: list[Saved]) -> Iterator[Saved]:
    """Those whose fields are still there, the newest first."""
    size = _size(folder)
    for saved in whole:
        if size >= saved.about["files"]["size"]:
            yield saved
        else:
            log.warning("%s: fields of results.h5 that belong to it are lost", saved.path)


def _nothing_whole(folder: Path, reasons: dict[str, str]) -> EnvironmentProblem:
    said = "; ".join(f"{name}: {why}" for name, why in reasons.items())
    return EnvironmentProblem(
        f"{folder}: no checkpoint can be gone on from ({said}); run without --restart to start from the beginning"
    )


def _refuse_another_case(folder: Path, about: Provenance) -> None:
    """Name what differs from the run in a folder that has no checkpoint, if that is known."""
    try:
        before = values_of(recorded_case(folder))
    except (CaseError, OSError, ValueError, KeyError):
        return
    if changed := differences(before, values_of(about.case)):
        raise _refusal(folder, "the run here", changed, "")


def _compare(saved: Saved, about: Provenance, *, extend: bool) -> None:
    """Raise CaseError unless the checkpoint is of this case and mesh, or of one that may be extended to it."""
    before, now = saved.about["values"], values_of(about.case)
    case, mesh = saved.about["identity"]
    changed = differences(before, now) if case != about.identity.case else []
    if extend:
        past = _past_of(saved)
        allowed = f"{EXTENSIONS}|{RAMPS}" if about.case.spec.dynamics else EXTENSIONS
        changed = [each for each in changed if not re.fullmatch(allowed, each[0])]
        if not changed and past is not None:
            _refuse_another_past(past, about, saved)
    if changed:
        hint = (
            ", or --extend for a longer duration, more outputs, other options of PETSc" if not extend else ""
        )
        raise _refusal(saved.path, "the checkpoint", changed, hint)
    if mesh != about.identity.mesh:
        raise CaseError(
            "the mesh is not the one of the checkpoint",
            file=saved.path,
            key="mesh",
            got=f"sha256 {about.identity.mesh}",
            expected=f"sha256 {mesh}",
            cure="bring that mesh back, or start anew without --restart, with --force or another --out",
        )


def _refusal(place: Path, what: str, changed: list[tuple[str, Any, Any]], hint: str) -> CaseError:
    key, before, now = changed[0]
    others = ", ".join(name for name, _, _ in changed[1:4]) + (", ..." if len(changed) > 4 else "")
    return CaseError(
        f"the case is not the one of {what}",
        file=place,
        key=key,
        got=_shown(now),
        expected=str(_shown(before)),
        cure=(f"changed too: {others}; " if others else "")
        + f"give case, --set and options as at the start{hint}, or run without --restart",
    )


def differences(before: Any, now: Any, path: str = "") -> list[tuple[str, Any, Any]]:
    """Dotted keys with the values before and now; None where there is none. Entries of lists go by group or name."""
    if before == now:
        return []
    old, new = _table(before), _table(now)
    if old is None or new is None:
        return [(path, before, now)]
    found = (
        differences(old.get(name), new.get(name), f"{path}.{name}" if path else name)
        for name in dict.fromkeys((*old, *new))
    )
    return [each for part in found for each in part]


def _table(value: Any) -> dict[str, Any] | None:
    """A table, or a list of tables by what names them; None for anything else."""
    if value is None:
        return {}
    if isinstance(value, dict):
        return value
    if isinstance(value, list) and len(value) == 1 and isinstance(value[0], dict) and not _name(value[0]):
        return value[0]
    if isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
        names = [_name(row) or str(number) for number, row in enumerate(value)]
        return {
            name if names.count(name) == 1 else str(k): row
            for k, (name, row) in enumerate(zip(names, value, strict=True))
        }
    return None


def _name(row: dict[str, Any]) -> str:
    return str(row.get("name") or row.get("group") or "")


def _shown(value: Any) -> Any:
    """As a case has it: values are compared with numbers as texts."""
    if value is None:
        return "nothing"
    try:
        number = float(value)
    except (TypeError, ValueError):
        return value
    return int(number) if number == int(number) and abs(number) < 1e6 else number


# --- an extension


def _past_of(saved: Saved) -> Case | None:
    """The case of a checkpoint; None of another version's that cannot be read."""
    try:
        return recorded_case(saved.path.parent, saved.about["run"])
    except CaseError:
        return None


def _refuse_another_past(past: Case, about: Provenance, saved: Saved) -> None:
    """Raise CaseError where what is done so far would have been something else by the case as it is now."""
    before, now = past.spec.dynamics, about.case.spec.dynamics
    if before is None or now is None or past.spec == about.case.spec:
        return
    reached = saved.about["state"]["integrator"]["time"]
    if now.duration < reached * (1.0 - SAME):
        raise CaseError(
            "the motion is beyond that already",
            file=saved.path,
            key="dynamics.duration",
            got=now.duration,
            expected=f"at least {reached:.6g}, the time of the checkpoint",
        )
    times = np.linspace(0.0, reached, 257)
    for table in ("constraint", "load"):
        for old, new in zip(getattr(past.spec, table), getattr(about.case.spec, table), strict=True):
            if table == "constraint" and not old.move:
                continue
            ramps = make_ramp(old.ramp, "linear"), make_ramp(new.ramp, "linear")
            was, is_now = (
                np.array([ramp.value(t / duration) for t in times])
                for ramp, duration in zip(ramps, (before.duration, now.duration), strict=True)
            )
            if np.abs(was - is_now).max() > SAME * max(1.0, np.abs(was).max()):
                name = getattr(new, "group", None) or getattr(new, "type", "")
                raise CaseError(
                    "ramps go over the duration: with another one the past would have been another",
                    file=saved.path,
                    key=f"{table}.{name}.ramp",
                    got=new.ramp,
                    expected="the same factors at the same times as before",
                    cure="write the ramp as a table over the new duration",
                )
