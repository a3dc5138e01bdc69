"""Writing a smaller case with its mesh into a folder."""

from __future__ import annotations

from pathlib import Path

from ancf_petsc.errors import CaseError, writing
from ancf_petsc.input.load import CASE_FILE, Case, load_case
from ancf_petsc.plan.plan import Plan, make_plan
from ancf_petsc.reduce.half import HALVES, QUARTER, reduced_by_planes
from ancf_petsc.reduce.mesh_file import write_mesh
from ancf_petsc.reduce.section import reduced_to_section
from ancf_petsc.reduce.symmetry import SceneModel
from ancf_petsc.reduce.tables import SmallerCase
from ancf_petsc.reduce.wedge import reduced_to_wedge

MESH_FILE = "mesh.msh"
SECTION, WEDGE = "section", "wedge"
KINDS_OF_PARTS = (*HALVES, QUARTER, SECTION, WEDGE)
"""What a case can be reduced to."""


def reduce(case: Case, to: str, size: float | None = None, angle: float | None = None) -> SmallerCase:
    """The smaller case of a kind. size: length of edges of a section or wedge (None: as the body's). angle: of a wedge, in degrees.

    Raises CaseError where the scene does not allow it, with the reason.
    """
    plan = make_plan(case)
    if plan.element.cell.dimension != 3:
        raise CaseError(
            "only solids are reduced",
            file=case.file,
            key="mesh.element",
            got=plan.element.code,
            expected="a solid element",
        )
    if angle is not None and to != WEDGE:
        raise CaseError(
            "only a wedge has an angle", key="--angle", got=angle, expected="--to wedge", cure="leave it out"
        )
    scene = SceneModel(case, plan)
    if to == WEDGE:
        return reduced_to_wedge(scene, size, angle)
    return reduced_to_section(scene, size) if to == SECTION else reduced_by_planes(scene, to)


def write_case(smaller: SmallerCase, folder: Path) -> tuple[Case, Plan]:
    """Write case.toml and mesh.msh into a folder that has neither. Returns what is read back of them."""
    with writing(folder, "--out"):
        folder.mkdir(parents=True, exist_ok=True)
    for name in (CASE_FILE, MESH_FILE):
        if (folder / name).exists():
            raise CaseError(
                f"{name} is there already", file=folder, key="--out", cure="choose another folder"
            )
    write_mesh(smaller.mesh, folder / MESH_FILE)
    with writing(folder / CASE_FILE, "--out"):
        (folder / CASE_FILE).write_text(smaller.text(MESH_FILE))
    case = load_case(folder)
    return case, make_plan(case)
