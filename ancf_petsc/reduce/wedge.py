"""The sector of a body of revolution between two planes through its axis, as a solid whose sides stay in these planes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.kinds import KINDS, qualities
from ancf_petsc.reduce.half import POOR
from ancf_petsc.reduce.profile import profile_of
from ancf_petsc.reduce.profile_lines import simplified
from ancf_petsc.reduce.profile_mesh import meshed
from ancf_petsc.reduce.revolution import Ring
from ancf_petsc.reduce.section import axes_of_section, follow_axis, require_groups, ring_or_refuse
from ancf_petsc.reduce.shape import CLOSE
from ancf_petsc.reduce.sweep import swept
from ancf_petsc.reduce.symmetry import SceneModel
from ancf_petsc.reduce.tables import SmallerCase, free_name, tables_and_mesh

NARROW, WIDEST = 5.0, 90.0
"""Degrees: of a wedge where none are given, and at most."""
KEPT, OTHERWISE = ("3413", "3-10-1-3"), "3-10-1-3"
"""Elements of tetrahedra that a wedge keeps, and the one in place of another."""


def reduced_to_wedge(scene: SceneModel, size: float | None, degrees: float | None) -> SmallerCase:
    """The case of a wedge. size: length of edges of its section, that of the body's by default. Raises CaseError."""
    ring = ring_or_refuse(scene, "wedge")
    angle = np.radians(_checked(degrees, ring))
    radial, axial = axes_of_section(ring)
    section = meshed(simplified(profile_of(scene, ring)), radial, axial, size)
    first = free_name(scene.mesh, "symmetry_1")
    walls = (first, free_name(scene.mesh, "symmetry_2"))
    mesh = swept(section, ring, angle, radial, axial, walls)
    smaller = replace(tables_and_mesh(scene.case, scene.mesh), mesh=mesh)
    _fill_tables(smaller, scene, ring, angle, walls)
    follow_axis(smaller, ring, axial, "wedge")
    require_groups(smaller, scene)
    worst = float(qualities(mesh.points, mesh.cells, KINDS[mesh.kind]).min())
    if worst < POOR:
        smaller.notes.append(
            f"its worst element has a quality of {worst:.2g}: at the axis elements are as narrow as the wedge"
        )
    return smaller


def _checked(degrees: float | None, ring: Ring) -> float:
    """The angle that is asked for, in degrees. Raises CaseError where it is none of a wedge of the ring."""
    sector = float(np.degrees(ring.angle))
    most = min(WIDEST, sector)
    if degrees is None:
        return min(NARROW, sector / 2)
    if not 0.0 < degrees <= most * (1.0 + CLOSE):
        raise CaseError(
            "the wedge is no part of the body between two planes through its axis",
            key="--angle",
            got=degrees,
            expected=f"degrees above 0 and up to {most:.6g}",
            cure=f"such as {min(NARROW, sector / 2):.6g}",
        )
    return min(degrees, sector)


def _fill_tables(
    smaller: SmallerCase, scene: SceneModel, ring: Ring, angle: float, walls: tuple[str, str]
) -> None:
    data, part = smaller.data, angle / ring.angle
    data["title"] = f"{data['title']}, wedge of {np.degrees(angle):.6g} degrees"
    own = scene.case.spec.mesh.element
    element = own if own in KEPT else OTHERWISE
    rule = {"rule": data["mesh"]["rule"]} if element == own and "rule" in data["mesh"] else {}
    data["mesh"] = {"element": element, **rule}
    if element != own:
        smaller.notes.append(f"mesh.element: {element}, for the wedge is made of tetrahedra")
    rows = [row for row in data.get("constraint", []) if f"constraint.{row['group']}" not in ring.walls]
    data["constraint"] = [*rows, *({"group": name, "fix": ["normal"]} for name in walls)]
    for load in data.get("load", []):
        if load["type"] == "force":
            load["total"] = [float(value) * part for value in load["total"]]
    output = data.setdefault("output", {})
    output["symmetry"] = float(output.get("symmetry", 1)) / part
