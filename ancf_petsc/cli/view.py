"""`ancf view`: a run in motion, or a case before it is solved."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ancf_petsc.cli.run import add_case_arguments, changes
from ancf_petsc.errors import CaseError, writing

if TYPE_CHECKING:
    from ancf_petsc.mesh.mesh import Mesh
    from ancf_petsc.post.case_view import Marked
    from ancf_petsc.results.reader import Results

HELP = "look at a run, or at a case before it runs"
PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_case_arguments(parser, "the folder of a run; or a case file, or a folder with case.toml")
    parser.add_argument(
        "--screenshot", type=Path, metavar="FILE", help="write a picture instead, no display needed"
    )
    run = parser.add_argument_group("of a run")
    run.add_argument("--field", default="displacement", metavar="NAME", help="what the colours mean")
    run.add_argument(
        "--component",
        default="",
        metavar="C",
        help="x, y, z, magnitude; of tensors xx, xy, ..., max, min (principal)",
    )
    when = run.add_mutually_exclusive_group()
    when.add_argument(
        "--step", type=int, default=-1, metavar="N", help="from 0, or from the end: -1 (default)"
    )
    when.add_argument("--time", type=float, metavar="T", help="the step nearest to this time")
    run.add_argument("--scale", type=float, default=1.0, metavar="S", help="displacements times this")
    run.add_argument(
        "--undeformed",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="outline of the undeformed body",
    )
    run.add_argument("--movie", type=Path, metavar="FILE", help="write an animated .gif of all steps")


def execute(arguments: argparse.Namespace) -> int:
    _check_suffix(arguments.screenshot, "--screenshot", PICTURES)
    _check_suffix(arguments.movie, "--movie", (".gif",))
    if (arguments.case / "results.h5").is_file():
        _show_run(arguments)
    else:
        _show_case(arguments)
    return 0


def _check_suffix(file: Path | None, key: str, known: tuple[str, ...]) -> None:
    if file is None:
        return
    if file.suffix.lower() not in known:
        raise CaseError(key=key, got=str(file), expected="a file name that ends in " + ", ".join(known))
    if not file.parent.is_dir():
        raise CaseError("no such folder", key=key, got=str(file.parent), cure="make it first")


def _show_run(arguments: argparse.Namespace) -> None:
    from ancf_petsc.post import view
    from ancf_petsc.results.reader import open_results

    results = open_results(arguments.case)
    if arguments.changes:
        raise CaseError("applies to cases; this is a finished run", file=arguments.case, key="--set")
    look = view.Look(arguments.field, arguments.component, arguments.scale, arguments.undeformed)
    step = _step(results, arguments)
    if arguments.screenshot:
        with writing(arguments.screenshot, "--screenshot"):
            view.screenshot(results, look, step, arguments.screenshot)
        print(arguments.screenshot)
    if arguments.movie:
        with writing(arguments.movie, "--movie"):
            view.movie(results, look, arguments.movie)
        print(arguments.movie)
    if not (arguments.screenshot or arguments.movie):
        view.explore(results, look, step)


def _step(results: Results, arguments: argparse.Namespace) -> int:
    return arguments.step if arguments.time is None else results.step_at(arguments.time)


def _show_case(arguments: argparse.Namespace) -> None:
    from ancf_petsc.input.load import load_case
    from ancf_petsc.mesh.groups import choose_groups
    from ancf_petsc.plan.case_mesh import mesh_of
    from ancf_petsc.post import case_view

    if arguments.movie:
        raise CaseError("needs a finished run; this is a case", file=arguments.case, key="--movie")
    case = load_case(arguments.case, changes(arguments))
    mesh = mesh_of(case)
    chosen = {name: group.model_dump(exclude_none=True) for name, group in case.spec.groups.items()}
    mesh.groups |= choose_groups(mesh, chosen, file=case.file)
    shown = (mesh, _supports(case, mesh), case.spec.title, case.spec.note)
    if arguments.screenshot:
        with writing(arguments.screenshot, "--screenshot"):
            case_view.screenshot(*shown, arguments.screenshot)
        print(arguments.screenshot)
    else:
        case_view.explore(*shown)


def _supports(case, mesh: Mesh) -> list[Marked]:
    """What the case holds, moves and pushes. Raises CaseError for a group that is not in the mesh."""
    from ancf_petsc.mesh.groups import find_group
    from ancf_petsc.post.case_view import Marked

    supports = [Marked(one.group, one.fix, dict(one.move)) for one in case.spec.constraint]
    supports += [Marked(one.group, force=one.total) for one in case.spec.load if one.type == "force"]
    for support in supports:
        find_group(mesh, support.group, "group", case.file)
    return supports
